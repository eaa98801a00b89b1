"""The story of a device and its keys, as a bench recorded it, held against the key oracle."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

from hil_tests.api import LOOK_ON_NS, KeypadBench, NotRun, Outcome, Verdict
from hil_tests.judge.keys import KeyRules, KeyTimeline, judge_keys
from hil_tests.judge.keys_time import Steps, worked_with
from hil_tests.scenarios.record import Life


class KeyStory:
    """What happens between a device and its keys, from a start of the device on.

    Args:
        bench: the device is about to be switched on, or reset.
    """

    def __init__(self, bench: KeypadBench) -> None:
        self._bench = bench
        self._from = bench.trace.mark()
        self._held = bench.keys.mask if bench.keys else 0

    @classmethod
    def begin(
        cls, bench: KeypadBench, prefer: Mapping[str, int] | None = None, **needed: int
    ) -> KeyStory:
        """A regular start, no key held: the device is pre-operational."""
        bench.fresh(prefer, **needed)
        story = cls(bench)
        bench.boot()
        bench.wait(bench.profile.limits.emcy_ns)
        return story

    @classmethod
    def operational(
        cls, bench: KeypadBench, prefer: Mapping[str, int] | None = None, **needed: int
    ) -> KeyStory:
        """A regular start and the command "start", its key frame awaited."""
        story = cls.begin(bench, prefer, **needed)
        bench.enter_operational()
        return story

    def rules(self) -> KeyRules:
        """Facts and limits of the device as it is commissioned now."""
        return key_rules(self._bench)

    def life(self) -> Life:
        """What was recorded since it began."""
        return Life(self._bench, self._bench.node_id, self._from, self._held)

    def timeline(self, until: int) -> KeyTimeline:
        """The recorded timeline."""
        return timeline_of(self.life(), until)

    def settle(self) -> None:
        """Wait until every change that still may come has been reported."""
        rules = self.rules()
        self._bench.wait(rules.surely_ns + rules.key_frame_ns + rules.command_ns)

    def verdicts(self) -> list[Verdict]:
        """What the oracle says of the story so far."""
        until = self._bench.watch.quiet_from(self._bench.now())
        self._bench.settle()

        def judged() -> list[Verdict]:
            life = self.life()
            return doubted(judge_key_frames(life, self.rules(), until), life)

        return when_all_is_told(self._bench, judged)

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


def when_all_is_told(
    bench: KeypadBench, judged: Callable[[], list[Verdict]], patience_ns: int = 0
) -> list[Verdict]:
    """Verdicts on what was recorded; where something is wrong, once more a while later.

    In real time a host may have been stopped with a frame in hand, which seems to be missing.

    Args:
        bench: that recorded it.
        judged: judges what was recorded so far.
        patience_ns: how long a change of keys that was not shown may be waited for, for late
            (KEY-05) is not lost (KEY-06, KEY-20).
    """
    found = judged()
    wrong = {verdict.requirement for verdict in found if verdict.outcome is Outcome.FAIL}
    longer_ns = patience_ns if wrong & _NOT_SHOWN else 0
    if wrong and (longer_ns or not bench.stage.virtual):
        bench.wait(max(longer_ns, LOOK_ON_NS))
        bench.settle()
        found = judged()
    return found


def key_rules(bench: KeypadBench) -> KeyRules:
    """Facts and limits of a device's keys as it is commissioned now.

    Raises:
        NotRun: what it is commissioned to is not known.
    """
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


_NOT_SHOWN = frozenset(("KEY-06", "KEY-20", "KEY-22", "COM-23"))
"""Verdicts on changes of keys that were not shown, as far as anybody knows."""

_BY_TIME = frozenset(("KEY-02", "KEY-04", "KEY-05", "KEY-06", "KEY-22"))
"""Verdicts on keys that rest on the debounce time."""


def _unfiltered(verdict: Verdict) -> Verdict:
    """What a debounce time of 0 means is our own reading: whoever filters departs from that."""
    return replace(verdict, requirement="COM-23") if verdict.requirement in _BY_TIME else verdict


def judge_key_frames(
    life: Life, rules: KeyRules, until: int, *, doubts: bool = True
) -> list[Verdict]:
    """What is wrong with the key frames of a life.

    Args:
        life: as it was recorded.
        rules: facts and limits.
        until: every frame that was asked for before this is in it.
        doubts: also what is wrong only if every doubt goes against the device.
    """
    found = judge_keys(timeline_of(life, until), rules, doubts=doubts)
    return found if rules.debounce_ns else [_unfiltered(verdict) for verdict in found]


def debounce_times(bench: KeypadBench, life: Life, until: int) -> Steps:
    """The debounce times, in steps, that explain the key frames of a life."""
    acts = [request.at for request in life.requests]
    return worked_with(timeline_of(life, until), key_rules(bench), acts)


def timeline_of(life: Life, until: int) -> KeyTimeline:
    """What the key oracle is told of a life, up to an instant."""
    return KeyTimeline(life.edges, life.turns, life.reports, until)


def doubted(found: list[Verdict], life: Life) -> list[Verdict]:
    """Verdicts on frames, no longer certain where frames were lost."""
    if not life.losses:
        return found
    why = f"perhaps, for frames were lost ({life.losses[0].kind.value}): "
    return [replace(v, outcome=Outcome.INCONCLUSIVE, text=why + v.text) for v in found]
