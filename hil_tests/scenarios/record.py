"""Reads from a trace what happened in one life of a device, from a start to its end.

What is judged are the recorded instants, never the planned ones: a host that was busy made
other stimuli than were planned, and they are judged as they were.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

from hil_tests.api import Frame, Interval, KeypadBench, Moment, Nmt, Seen, State, cobs
from hil_tests.clock import FOREVER, exactly
from hil_tests.judge.echoes import Echo, Request
from hil_tests.judge.glow import GlowRules, Watched, shown
from hil_tests.judge.keys import Edge, Report, Turn
from hil_tests.judge.lights import Chance, Event, Leave, Look, Restart, Write
from hil_tests.judge.starts import Emergency, Start
from hil_tests.trace import BusEvent, EventKind, Wanted

LOSSES = (EventKind.BUS_OFF, EventKind.OVERFLOW, EventKind.GAP, EventKind.DOWN)
_LED_FRAMES = frozenset((cobs.LED_STEADY, cobs.LED_BLINK))
_NOT_YET = (State.STARTING, State.OFF, State.COMMISSIONING)


class Life:
    """Everything that a trace holds of one life, in the words of the oracles.

    Args:
        bench: whose trace, timeline and limits.
        node_id: of the device; in commissioning it has none of its own, and any will do.
        since: the place in the trace at which the life begins.
        held: the keys held then, as bits of the key frame.
    """

    def __init__(
        self, bench: KeypadBench, node_id: int, since: tuple[int, int], held: int
    ) -> None:
        self._bench = bench
        self._node_id = node_id
        self._limits = bench.profile.limits
        self._alive_from = -FOREVER
        self._deaf_until = -1
        self._written_at = -FOREVER
        self._wrote_blink = False
        self._full = False
        """The boot-up that comes next is one of power-on or reset node, for certain."""
        self._beat_id = cobs.ERROR_CONTROL + node_id
        self._ids: Mapping[int, Callable[[Life, Seen], None]] = {
            cobs.KEYS + node_id: Life._key_frame,
            cobs.ERROR_CONTROL + node_id: Life._error_control,
            cobs.EMCY + node_id: Life._emergency,
            cobs.ECHO: Life._echo,
        }
        self.edges = [Edge(exactly(-FOREVER), held)]
        self.turns: list[Turn] = []
        self.reports: list[Report] = []
        self.starts: list[Start] = []
        self.emergencies: list[Emergency] = []
        self.requests: list[Request] = []
        self.echoes: list[Echo] = []
        self.lights: list[Event] = []
        self.looks: list[Look] = []
        """What the LEDs showed while no LED frame may act."""
        self.watched: list[Watched] = []
        self.losses: list[BusEvent] = []
        self._read(since)

    def _read(self, since: tuple[int, int]) -> None:
        wanted = Wanted(self._ids, self._beat_id)  # beats, most of what there is, tell nothing
        trace = self._bench.trace
        for entry in trace.places(*since, wanted):
            if isinstance(entry, int):
                if trace.is_own(entry):
                    self._own(*trace.frame(entry)[:2])
                else:
                    self._frame(self._bench.seen(entry))
            elif isinstance(entry, Moment):
                if entry.what == "bitrate":
                    return  # what came while nobody could hear it is not known
                self._moment(entry)
            elif entry.kind in LOSSES:
                self.losses.append(entry)
                self._disturbed(entry.at)

    # What was done.

    def _moment(self, moment: Moment) -> None:
        if moment.what == "keys":
            self._edge(moment)
        elif moment.what == "power":
            self._power(moment)
        elif moment.what == "leds":
            self._look(moment)
        elif moment.what == "lights":
            self._watch(moment)

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
            self._deaf_until = self._alive_from = moment.when.earliest
            self._full = True
            self.lights.append(Restart())
        elif self.turns:
            self.turns.append(Turn(moment.when, operational=False))
            self._disturbed(moment.began_at)

    def _start(self, when: Interval, delay_ns: int) -> None:
        """A power-on or reset, ready at the latest when the profile says so."""
        if not self.turns:
            # What it asked for before it began anew belongs to an earlier life.
            self._deaf_until = when.latest + delay_ns
        ready_at = when.latest + self._limits.boot_up_ns
        self.turns.append(Turn(when, operational=False, ready_at=ready_at))

    def _look(self, moment: Moment) -> None:
        lights = moment.detail["leds"]
        assert isinstance(lights, dict)
        if self._written_at > moment.began_at - self._limits.led_ns:
            return  # it changed under the eye
        possible = self._bench.watch.timeline.possible(moment.when)
        if State.COMMISSIONING in possible and possible <= set(_NOT_YET):
            self.looks.append(Look(moment.ended_at, lights, operational=False))
        elif not possible & set(_NOT_YET):
            operational = possible == {State.OPERATIONAL}
            self.lights.append(Look(moment.ended_at, lights, operational))

    def _watch(self, moment: Moment) -> None:
        """A stretch in which every change of light was seen: what it showed, and when."""
        possible = self._bench.watch.timeline.possible(moment.when)
        if possible != {State.OPERATIONAL}:
            return
        start, edges = moment.detail["start"], moment.detail["edges"]
        assert isinstance(start, dict)
        assert isinstance(edges, list)
        watched = Watched(
            moment.began_at,
            moment.ended_at,
            start,
            [(Interval(first, last), led, lit) for first, last, led, lit in edges],
            self._written_at,
            self._wrote_blink,
        )
        self.watched.append(watched)
        look = shown(watched, glow_rules(self._bench))
        if look is not None:
            self.lights.append(look)

    def _disturbed(self, at: int) -> None:
        """Something that may keep back the EMCY of the last boot-up."""
        if self.starts and self.starts[-1].disturbed_at == FOREVER:
            self.starts[-1] = self.starts[-1]._replace(disturbed_at=at)

    # What was seen.

    def _frame(self, seen: Seen) -> None:
        take = self._ids.get(seen.frame.can_id)
        if take is not None and not seen.frame.extended and not seen.frame.remote:
            take(self, seen)

    def _key_frame(self, seen: Seen) -> None:
        earliest, latest = self._bench.when(seen)
        # Before its supply it asked for nothing.
        wanted = Interval(max(earliest, self._alive_from), latest)
        if self.turns and wanted.earliest >= self._deaf_until:
            mask = int.from_bytes(seen.frame.data, "little")
            self.reports.append(Report(wanted, mask))

    def _error_control(self, seen: Seen) -> None:
        if seen.frame.data != b"\x00" or not self.turns:
            return
        last = self.turns[-1]
        if last.ready_at is not None:
            self.turns[-1] = last._replace(ready_at=seen.wanted.latest)
        if self._full:
            self.starts.append(Start(self._bench.when(seen), FOREVER))
        self._full = False

    def _emergency(self, seen: Seen) -> None:
        if len(seen.frame.data) == 8:
            self.emergencies.append(Emergency(self._bench.when(seen), seen.frame))

    def _echo(self, seen: Seen) -> None:
        self.echoes.append(Echo(self._bench.when(seen), seen.frame.data))

    # What we sent.

    def _own(self, frame: Frame, at: int) -> None:
        base = frame.can_id - self._node_id
        self.requests.append(Request(at, frame))
        if not frame.can_id:
            self._command(frame, at)
        elif base in _LED_FRAMES and not frame.extended and not frame.remote:
            self._written_at, self._wrote_blink = at, base == cobs.LED_BLINK
            self.lights.append(Write(base == cobs.LED_BLINK, frame.data, self._acts(at)))

    def _acts(self, at: int) -> Chance:
        """Whether a frame at that instant found the device operational when it took effect."""
        takes_effect = Interval(at, at + self._limits.led_ns)
        possible = self._bench.watch.timeline.possible(takes_effect)
        if State.OPERATIONAL not in possible:
            return Chance.NO
        return Chance.SURE if len(possible) == 1 else Chance.PERHAPS

    def _command(self, frame: Frame, at: int) -> None:
        command = cobs.nmt_for(frame, self._node_id)
        perhaps = command or cobs.long_nmt_for(frame, self._node_id)
        if perhaps is None:
            return
        self._disturbed(at)
        self._darkens(perhaps, at, certain=command is not None)
        if command in cobs.RESETS:
            self._full = command is Nmt.RESET_NODE and self._hears(at)
            self._start(exactly(at), self._limits.command_ns)
        elif command is not None and self.turns:
            self.turns.append(Turn(exactly(at), operational=command is Nmt.START))

    def _hears(self, at: int) -> bool:
        """Whether the device was surely not initialising: a command may be lost there."""
        return not self._bench.watch.timeline.possible(Interval(at - 1, at - 1)) & set(_NOT_YET)

    def _darkens(self, command: Nmt, at: int, *, certain: bool) -> None:
        settled = at - self._written_at > self._limits.led_ns
        self._written_at = at
        if command in cobs.RESETS:
            sure = certain and settled and self._hears(at)
            self.lights.append(Restart(Chance.SURE if sure else Chance.PERHAPS))
        elif command is not Nmt.START:
            self.lights.append(Leave())


def glow_rules(bench: KeypadBench) -> GlowRules:
    """Facts and limits of the device's lights."""
    profile = bench.profile
    return GlowRules(profile.limits.led_ns, profile.blink_on_ns, profile.blink_off_ns)
