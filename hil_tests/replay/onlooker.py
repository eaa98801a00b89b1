"""Judging a recording of somebody else's, in which nobody says what was done to the device.

The monitors judge it, told what a recording shows by itself: NMT commands, SDO and guarding
requests are the tester's, wherever they came from. Laws: what a recording cannot tell is
never held against the device. A boot-up that no command led to may follow power-on. A device
that was not heard may be without supply. A stretch in which nobody was heard may not have been
recorded, unless it is too short for a beat to be missing.
"""

from __future__ import annotations

from array import array
from bisect import bisect_left
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field, replace

from hil_tests.clock import FOREVER, MS, Interval, S
from hil_tests.judge.causal import Lateness, Seen
from hil_tests.judge.cobs import (
    ERROR_CONTROL,
    LSS_ANSWER,
    RESETS,
    SDO_REQUEST,
    SYNC,
    TIME,
    TPDOS,
    Nmt,
    State,
    nmt_for,
)
from hil_tests.judge.expected import Expected
from hil_tests.judge.timeline import ANY_STATE
from hil_tests.judge.verdict import Outcome, Verdict
from hil_tests.judge.watch import Watch
from hil_tests.trace import BusEvent, EventKind, Moment, Sighting
from node_model.frame import Frame

BUSY_NS = 2 * MS
"""Frames that come more often, on average, may keep others from the bus."""

_LOST = {EventKind.GAP, EventKind.OVERFLOW, EventKind.DOWN, EventKind.STALL, EventKind.BUS_OFF}
_RUNNING = {State.STOPPED, State.PRE_OPERATIONAL, State.OPERATIONAL}
_SHARED = {SYNC, TIME, LSS_ANSWER}
"""Identifiers of which nobody can say who used them."""


@dataclass(slots=True)
class Findings:
    """What a recording shows of one device.

    Args:
        verdicts: of the monitors: what is wrong, or may be.
        beats: of each stretch in which the heartbeat was undisturbed, when each was asked for.
        counts: how often something was seen, see `Onlooker`.
        commands: NMT commands that the device was given while it was heard.
        first_at: instant of the first entry.
        last_at: and of the last one.
    """

    verdicts: list[Verdict] = field(default_factory=list)
    beats: list[list[Interval]] = field(default_factory=list)
    counts: Counter[str] = field(default_factory=Counter)
    commands: set[Nmt] = field(default_factory=set)
    first_at: int | None = None
    last_at: int = 0


class Onlooker:
    """Watches one device in a recording.

    `Findings.counts` holds: "frames" of anybody; "device" frames; "beats"; "boots", of which
    "answered" follow a reset, and "unexplained" no command though the device was heard before;
    "first beats" after a boot-up; "resets" of a device that was heard; "commands" to it that
    reset nothing; "unheard" commands to it while it was not; "pdos" while its state was known;
    "gaps" in which nobody was heard for longer than a beat takes, or of which the recording
    says so; "errors".

    Args:
        expected: the device as it should be; its node id must be known, and others are there.
        bit_ns: duration of a bit; 0 = stamps are taken as they are.
        doubt_ns: a frame ended so much before its stamp, at most.
        late_ns: and so much after it, at most: stamps that were cut off.
    """

    def __init__(self, expected: Expected, bit_ns: int, doubt_ns: int, late_ns: int = 0) -> None:
        assert expected.node_id is not None
        self._node_id = expected.node_id
        self._doubt_ns, self._late_ns = doubt_ns, late_ns
        self._watch = Watch(expected, bit_ns, ANY_STATE)
        self._beat_id = ERROR_CONTROL + expected.node_id
        self._requests = {0, SDO_REQUEST + expected.node_id} | _SHARED
        self._heard_at = -1
        """The last frame of the device; -1 = none was seen."""
        self._asked_at = -1
        """The last command."""
        self._free_until = -FOREVER
        """A command may still show in an extra beat, or a new phase."""
        self._instants = array("q")
        self._fresh = False
        """The last frame of the device was its boot-up."""
        self.found = Findings()
        self.index = 0

    def see_all(self, entries: Iterable[Sighting | BusEvent]) -> Iterable[Sighting | BusEvent]:
        """Watch a recording; hands its entries on, with doubt and direction as they are judged."""
        for entry in entries:
            found = self.found
            found.first_at = entry.at if found.first_at is None else found.first_at
            if isinstance(entry, BusEvent):
                self._event(entry)
                yield entry
            else:
                yield self._frame(entry)
            found.last_at = entry.at

    def finish(self) -> Findings:
        """Everything that was found, up to the last frame of the device."""
        if self._heard_at >= 0:
            told = self._watch.finish(self._heard_at, Lateness())
            self.found.verdicts += map(self._allow_for_load, told)
        return self.found

    def _allow_for_load(self, verdict: Verdict) -> Verdict:
        """Without bit times nobody can say how long a busy bus kept a beat back."""
        ids, measured = self._watch.expected.ids, verdict.measured
        late = verdict.requirement in {ids.beat, ids.beat_first} and measured and verdict.at
        if self._watch.clock.bit_ns or not late:
            return verdict
        assert measured is not None
        assert verdict.at is not None
        since = bisect_left(self._instants, verdict.at - measured.latest)
        frames = bisect_left(self._instants, verdict.at) - since
        if frames * BUSY_NS < measured.latest:
            return verdict
        text = f"{verdict.text}, among {frames} other frames: say the bit rate with --bitrate"
        return replace(verdict, outcome=Outcome.INCONCLUSIVE, text=text)

    def _event(self, event: BusEvent) -> None:
        if event.kind in _LOST:
            self._lose(event.at, event.kind)
        elif event.kind is EventKind.ERROR:
            self.found.counts["errors"] += 1
            self._watch.happened(event)
            self.found.beats.append([])

    def _lose(self, at: int, kind: EventKind = EventKind.GAP) -> None:
        """From here on nothing is known of what came before."""
        self.found.counts["gaps"] += 1
        self._watch.happened(BusEvent(kind, at))
        self.found.beats.append([])

    def _frame(self, sighting: Sighting) -> Sighting:
        frame, at = sighting.frame, sighting.at + self._late_ns
        own = sighting.own or frame.remote
        own = own or (not frame.extended and frame.can_id in self._requests)
        judged = Sighting(frame, at, self._doubt_ns + self._late_ns, own)
        self._mind_the_gap(sighting.at)
        self._instants.append(at)
        self.found.counts["frames"] += 1
        if own:
            self._asked(frame, at)
        elif self._is_of_device(frame):
            self._answered(frame, at)
        seen = self._watch.see(judged, self.index)
        self.index += 1
        if not own and frame.can_id == self._beat_id and not frame.extended:
            self._beat(seen)
        elif not own and self._is_of_device(frame) and frame.can_id - self._node_id in TPDOS:
            possible = self._watch.timeline.possible(seen.wanted)
            self.found.counts["pdos"] += not possible >= _RUNNING
        return judged

    def _mind_the_gap(self, at: int) -> None:
        """Where nobody was heard for so long that a beat is missing, it may not be recorded."""
        period_ns = self._watch.expected.heartbeat_ns
        longest_ns = period_ns * 3 // 2 if period_ns else FOREVER
        if self._heard_at >= 0 and at - self.found.last_at > longest_ns:
            self._lose(at)

    def _is_of_device(self, frame: Frame) -> bool:
        return not frame.extended and frame.can_id & 0x7F == self._node_id

    def _asked(self, frame: Frame, at: int) -> None:
        """Somebody commands the device, perhaps."""
        command = nmt_for(frame, self._node_id)
        if frame.can_id or command is None:
            return
        self.found.beats.append([])
        if self._heard_at <= self._asked_at:
            self.found.counts["unheard"] += 1  # it may be without supply
            self._watch.happened(BusEvent(EventKind.GAP, at))
        else:
            self.found.counts["resets" if command in RESETS else "commands"] += 1
            self.found.commands.add(command)
        self._asked_at = at
        expected = self._watch.expected
        self._free_until = at + expected.command_ns + min(expected.heartbeat_each.at_most_ns, S)

    def _answered(self, frame: Frame, at: int) -> None:
        self.found.counts["device"] += 1
        if frame.can_id == self._beat_id and frame.data == b"\x00":
            self.found.counts["boots"] += 1
            self.found.beats.append([])
            in_time = at - self._asked_at <= self._watch.expected.boot_up_ns
            if self._watch.owes_boot_up and in_time:
                self.found.counts["answered"] += 1
            else:
                self.found.counts["unexplained"] += self._heard_at >= 0
                began_at = max(self._heard_at, self.found.first_at or 0)
                detail = {"on": True, "mode": "regular", "held": []}
                start = at - self._doubt_ns - self._late_ns - frame.bits * self._watch.clock.bit_ns
                self._watch.did(Moment("power", min(began_at, start), start, detail))
        self._heard_at = at

    def _beat(self, seen: Seen) -> None:
        if seen.frame.data == b"\x00":
            self._fresh = True
        if len(seen.frame.data) != 1 or seen.frame.data == b"\x00":
            return
        self.found.counts["beats"] += 1
        self.found.counts["first beats"] += self._fresh
        self._fresh = False
        if not self.found.beats:
            self.found.beats.append([])
        if seen.wanted.earliest > self._free_until:
            self.found.beats[-1].append(seen.wanted)


def nodes(entries: Iterable[Sighting | BusEvent]) -> Counter[int]:
    """Node ids that error control was heard from, and how often."""
    return Counter(
        entry.frame.can_id - ERROR_CONTROL
        for entry in entries
        if isinstance(entry, Sighting)
        and not entry.frame.extended
        and not entry.frame.remote
        and ERROR_CONTROL < entry.frame.can_id < ERROR_CONTROL + 128
    )


def grain(entries: Iterable[Sighting | BusEvent]) -> int:
    """The unit in which stamps count, ns: 1 ms where all are whole ms, else 1 us, or 1 ns."""
    unit = 1_000_000
    for entry in entries:
        while entry.at % unit:
            unit //= 1000
        if unit == 1:
            break
    return unit
