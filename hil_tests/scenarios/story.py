"""Plays steps on a bench, and reads from its trace what happened between keys and frames.

What is judged are the recorded instants, never the planned ones: a host that was busy made
other stimuli than were planned, and they are judged as they were.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from hil_tests.api import (
    MS,
    Bench,
    Interval,
    Moment,
    Nmt,
    NotRun,
    Outcome,
    Seen,
    Verdict,
    cobs,
    matchers,
)
from hil_tests.judge.keys import Edge, KeyRules, KeyTimeline, Report, Turn, judge_keys
from hil_tests.scenarios.scenario import Scenario, Step
from hil_tests.trace import BusEvent, EventKind, Sighting

LOOK_ON_NS = 250 * MS
"""How much longer a frame that seems to be missing is waited for."""

_RESETS = (Nmt.RESET_NODE, Nmt.RESET_COMMUNICATION)
_WORDS = {
    "start": Nmt.START,
    "stop": Nmt.STOP,
    "pre-operational": Nmt.PRE_OPERATIONAL,
    "reset": Nmt.RESET_NODE,
}
_LOSSES = (EventKind.BUS_OFF, EventKind.OVERFLOW, EventKind.GAP, EventKind.DOWN)


class KeyStory:
    """What happens between a device and its keys, from a start of the device on.

    Args:
        bench: the device is about to be switched on, or reset.
    """

    def __init__(self, bench: Bench) -> None:
        self._bench = bench
        self._from = bench.trace.mark()
        self._held = bench.keys.mask if bench.keys else 0

    @classmethod
    def begin(
        cls, bench: Bench, prefer: Mapping[str, int] | None = None, **needed: int
    ) -> KeyStory:
        """A regular start, no key held: the device is pre-operational."""
        bench.fresh(prefer, **needed)
        story = cls(bench)
        bench.boot()
        bench.wait(bench.profile.limits.emcy_ns)
        return story

    @classmethod
    def operational(
        cls, bench: Bench, prefer: Mapping[str, int] | None = None, **needed: int
    ) -> KeyStory:
        """A regular start and the command "start", its key frame awaited."""
        story = cls.begin(bench, prefer, **needed)
        bench.enter_operational()
        return story

    def rules(self) -> KeyRules:
        """Facts and limits of the device as it is commissioned now."""
        bench = self._bench
        parameters = bench.parameters
        if parameters is None:
            raise NotRun("what the device is commissioned to is not known")
        profile, limits = bench.profile, bench.profile.limits
        return KeyRules(
            keys=profile.key_bits,
            debounce_ns=parameters.debounce_ns,
            scan_ns=limits.scan_ns,
            key_frame_ns=limits.key_frame_ns,
            command_ns=limits.command_ns,
            releases_reported=profile.releases_reported,
        )

    def timeline(self, until: int) -> KeyTimeline:
        """The recorded timeline."""
        reader = _Reader(self._bench, self._held)
        index = self._from[0]
        for entry in self._bench.trace.entries(*self._from):
            if isinstance(entry, Sighting):
                reader.frame(self._bench.seen(index))
                index += 1
            elif isinstance(entry, Moment):
                reader.moment(entry)
        return KeyTimeline(reader.edges, reader.turns, reader.reports, until)

    def settle(self) -> None:
        """Wait until every change that still may come has been reported."""
        rules = self.rules()
        self._bench.wait(rules.surely_ns + rules.key_frame_ns + rules.command_ns)

    def verdicts(self) -> list[Verdict]:
        """What the oracle says of the story so far."""
        bench = self._bench
        until = bench.watch.quiet_from(bench.now())
        bench.settle()
        found = judge_keys(self.timeline(until), self.rules())
        if any(verdict.outcome is Outcome.FAIL for verdict in found):
            # A host may have been stopped with a frame of its model in hand.
            bench.wait(LOOK_ON_NS)
            bench.settle()
            found = judge_keys(self.timeline(until), self.rules())
        lost = self._losses()
        if not lost:
            return found
        why = f"perhaps, for frames were lost ({lost[0].kind.value}): "
        return [
            Verdict(v.requirement, Outcome.INCONCLUSIVE, why + v.text, v.measured, v.limits, v.at)
            for v in found
        ]

    def _losses(self) -> Sequence[BusEvent]:
        """Bus events that cost frames."""
        entries = self._bench.trace.entries(*self._from)
        return [e for e in entries if isinstance(e, BusEvent) and e.kind in _LOSSES]

    def judge(self, *claims: str) -> None:
        """Let everything be reported, and hold it against the clause.

        Args:
            claims: the requirements that the test is about. Doubt ends a test only where it
                concerns them; what is certainly wrong ends it always.

        Raises:
            DeviceFailure: something is certainly wrong.
            InconclusiveResult: doubt decides over one of `claims`.
        """
        self.settle()
        for verdict in self.verdicts():
            if verdict.outcome is Outcome.FAIL or verdict.requirement in claims:
                self._bench.conclude(verdict, self._look_from(verdict))
        for name in claims:
            self._bench.record(Verdict(name, Outcome.PASS, "every key frame is as it must be"))

    def _look_from(self, verdict: Verdict) -> int:
        """From where on the evidence is shown."""
        rules = self.rules()
        span_ns = 2 * rules.surely_ns + rules.key_frame_ns + rules.command_ns
        return (verdict.at or self._bench.now()) - span_ns


class _Reader:
    """Picks edges, turns and key frames out of a trace, from the first start on."""

    def __init__(self, bench: Bench, held: int) -> None:
        self._bench = bench
        self._node_id = bench.node_id
        self._report = matchers.key_frame(bench.node_id)
        self._boot_up = matchers.boot_up(bench.node_id)
        self._deaf_until = -1
        self.edges = [Edge(Interval(-1, -1), held)]
        self.turns: list[Turn] = []
        self.reports: list[Report] = []

    def moment(self, moment: Moment) -> None:
        """A stimulus."""
        if moment.what == "keys":
            self._edge(moment)
        elif moment.what == "power":
            self._power(moment)

    def _edge(self, moment: Moment) -> None:
        bits = self._bench.profile.key_bits
        names = moment.detail["held"]
        assert isinstance(names, list)
        edge = Edge(moment.when, sum(1 << bits[name] for name in names))
        if not self.turns:
            self.edges.clear()  # before the first start only the outcome counts
        self.edges.append(edge)

    def _power(self, moment: Moment) -> None:
        if moment.detail["on"]:
            self._start(moment.when, 0)
        elif self.turns:
            self.turns.append(Turn(moment.when, operational=False))

    def _start(self, when: Interval, delay_ns: int) -> None:
        """A power-on or reset, ready at the latest when the profile says so."""
        if not self.turns:
            # What it asked for before it began anew belongs to an earlier life.
            self._deaf_until = when.latest + delay_ns
        ready_at = when.latest + self._bench.profile.limits.boot_up_ns
        self.turns.append(Turn(when, operational=False, ready_at=ready_at))

    def frame(self, seen: Seen) -> None:
        """A frame on the bus."""
        if seen.own:
            self._command(seen)
        elif self._report.accepts(seen.frame):
            wanted = self._bench.when(seen)
            if self.turns and wanted.earliest > self._deaf_until:
                mask = int.from_bytes(seen.frame.data, "little")
                self.reports.append(Report(wanted, mask))
        elif self._boot_up.accepts(seen.frame) and self.turns:
            last = self.turns[-1]
            if last.ready_at is not None:
                self.turns[-1] = last._replace(ready_at=seen.wanted.latest)

    def _command(self, seen: Seen) -> None:
        command = cobs.nmt_for(seen.frame, self._node_id)
        if command in _RESETS:
            self._start(seen.when, self._bench.profile.limits.command_ns)
        elif command is not None and self.turns:
            self.turns.append(Turn(seen.when, operational=command is Nmt.START))


def play(bench: Bench, scenario: Scenario) -> KeyStory:
    """Play a scenario on a bench that has keys.

    Raises:
        NotRun: it has none, or the device cannot be commissioned as the scenario asks.
    """
    story = KeyStory.operational(bench, {"node_id": 6}, debounce=scenario.debounce)
    play_steps(bench, scenario.steps)
    return story


def play_steps(bench: Bench, steps: Sequence[Step]) -> None:
    """Do what the steps say, from now on.

    Steps of keys that follow each other are handed to the bench together, because some
    benches can time them better than we can from afar.
    """
    at = bench.now()
    batch: list[tuple[int, frozenset[str]]] = []
    for span_ms, what in steps:
        at += span_ms * MS
        if isinstance(what, int):
            batch.append((at, held_by(bench, what)))
            continue
        _play_keys(bench, batch)
        batch = []
        bench.wait_until(at)
        _command(bench, _WORDS[what])
    _play_keys(bench, batch)


def _play_keys(bench: Bench, batch: Sequence[tuple[int, frozenset[str]]]) -> None:
    if not batch:
        return
    if bench.keys is None:
        raise NotRun(f"bench {bench.stage.name!r} has no Keys to play this with")
    start = batch[0][0]
    bench.wait_until(start)
    bench.keys.sequence([(at - start, held) for at, held in batch])


def _command(bench: Bench, command: Nmt) -> None:
    sent = bench.nmt(command)
    if command in _RESETS:
        within = bench.profile.limits.boot_up_ns
        boot_up = matchers.boot_up(bench.node_id)
        bench.expect(boot_up, after=sent, within=within, requirement="NMT-06")


def held_by(bench: Bench, mask: int) -> frozenset[str]:
    """The keys of a scenario's mask.

    Bits 0 and 1 are the first two keys of the profile, further ones count from its end.
    """
    names = bench.keys.names if bench.keys else ()
    order = (*names[:2], *reversed(names[2:]))
    return frozenset(name for index, name in enumerate(order) if mask >> index & 1)
