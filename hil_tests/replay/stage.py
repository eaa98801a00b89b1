"""The stage of a recording: a port and drivers that say again what was recorded."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Generic, TypeVar

from hil_tests.bench import chronicle
from hil_tests.bench.action import (
    BitRateDriver,
    FaultsDriver,
    HealthDriver,
    KeysDriver,
    LedEdges,
    LedsDriver,
    PowerDriver,
)
from hil_tests.bus.port import BURST
from hil_tests.clock import FOREVER, Interval, show_span
from hil_tests.errors import BenchError
from hil_tests.replay.record import TestRecord
from hil_tests.replay.source import Source
from hil_tests.trace import Burst, BusEvent, Moment, Sighting
from node_model.frame import Frame

if TYPE_CHECKING:
    from hil_tests.config import Setup

T = TypeVar("T")


class ReplayPort:
    """The tester's end of a bus that was recorded."""

    def __init__(self, record: TestRecord) -> None:
        self.enter(record)

    def enter(self, record: TestRecord) -> None:
        """From now on this is what happens."""
        self.name: str = record.fact("name", str, "port")
        self.timed: bool = record.fact("timed", bool, "port")
        self.clock: str = record.fact("clock", str, "port")
        self.doubt_ns: int = record.fact("doubt_ns", int, "port")
        self.source = Source(record, virtual=record.fact("virtual", bool))

    def now(self) -> int:
        """The instant up to which the record was told."""
        return self.source.now

    def told(self) -> int:
        """See ToldPort."""
        return self.source.told()

    def send(self, frame: Frame) -> None:
        """See Port."""
        self.source.send(frame)

    def next(self, until: int, also: Sequence[int] = ()) -> Sighting | BusEvent | None:  # noqa: ARG002
        """See Port; nobody waits."""
        return self.source.next(until)

    def burst(self, until: int, most: int = BURST) -> Burst:
        """See BurstPort."""
        return self.source.burst(until, most)

    def set_bit_rate(self, bit_rate: int) -> None:
        """The record says at which rate it was."""

    def close(self) -> None:
        """Nothing to leave."""


class Recorded(Generic[T]):
    """An action of which the record says when it took effect.

    Args:
        source: the record.
        what: verb of its note.
        detail: what must stand in the note.
        asked: what the test does, for people.
        read: the result, from the note.
    """

    descriptors: Sequence[int] = ()
    wake_at = FOREVER

    def __init__(
        self,
        source: Source,
        what: str,
        detail: Mapping[str, object],
        asked: str,
        read: Callable[[Moment], T],
    ) -> None:
        self._source = source
        self._what = what
        self._detail = detail
        self._asked = asked
        self._read = read
        self._found: Moment | None = None

    def start(self, now: int) -> None:
        """It was started when it was."""

    def poll(self, now: int) -> bool:  # noqa: ARG002  the verb of an action
        """Whether the record has come to it."""
        self._found = self._source.await_that(self._what, self._detail, self._asked)
        return self._found is not None

    def result(self) -> T:
        """What the record says."""
        assert self._found is not None
        return self._read(self._found)


class Told(Generic[T]):
    """An action that is done at once."""

    descriptors: Sequence[int] = ()
    wake_at = 0

    def __init__(self, say: Callable[[], T]) -> None:
        self._say = say

    def start(self, now: int) -> None:
        """Nothing to begin."""

    def poll(self, now: int) -> bool:  # noqa: ARG002  the verb of an action
        """It is done."""
        return True

    def result(self) -> T:
        """What there is to say."""
        return self._say()


class ReplayStage:
    """What stood behind the bench when a run was recorded.

    Args:
        record: of any test of the run: the facts of the bench are the same in all.
        facilities: that the bench had.
    """

    timed_sequences = True
    about = "as it was recorded"

    def __init__(self, record: TestRecord, facilities: Sequence[str]) -> None:
        self.port = ReplayPort(record)
        self._enter(record)
        self.power: PowerDriver | None = self if "power" in facilities else None
        self.keys: KeysDriver | None = self if "keys" in facilities else None
        self.leds: LedsDriver | None = self if "leds" in facilities else None
        self.faults: FaultsDriver | None = self if "faults" in facilities else None
        self.bitrate: BitRateDriver | None = self if "bitrate" in facilities else None
        self.health: HealthDriver | None = self if record.fact("health", bool) else None

    def _enter(self, record: TestRecord) -> None:
        self.name: str = record.fact("bench", str)
        self.virtual: bool = record.fact("virtual", bool)
        self.exclusive: bool = record.fact("exclusive", bool)
        self.writes_allowed: bool = record.fact("writes_allowed", bool)
        self.fades: bool = record.fact("fades", bool)
        self.bit_rate: int = record.fact("bit_rate", int)
        self.timed_sequences = record.fact("timed_sequences", bool)
        self.sees_edges: bool = record.fact("sees_edges", bool)

    def enter(self, record: TestRecord) -> None:
        """From now on this record is told."""
        self.port.enter(record)
        self._enter(record)

    # The stage.

    def renew(self, parameters: Setup) -> bool:
        """See Stage: on a real bench a device is what it is."""
        if not self.virtual:
            return False
        asked = f"it begins anew with {parameters}"
        self.port.source.renew({"parameters": chronicle.plain(parameters)}, asked)
        self.bit_rate = parameters.bit_rate
        return True

    def load(self, frames: Sequence[Frame], share_ppm: int) -> bool:
        """See Stage."""
        if not self.virtual:
            return False
        detail = chronicle.loading(0, frames, share_ppm).detail
        self.port.source.do(
            "load", detail, f"another station is to load {share_ppm} ppm of the bus"
        )
        return True

    def end_load(self) -> None:
        """See Stage."""
        self.port.source.do("unload", {}, "other stations are to fall silent")

    def disturb(self) -> bool:
        """See Stage."""
        if not self.virtual:
            return False
        self.port.source.do("disturb", {}, "an error frame is to be sent")
        return True

    def check(self) -> None:
        """See Stage.

        Raises:
            BenchError: never; a record does not break.
        """

    def close(self) -> None:
        """Nothing to leave."""

    # Drivers.

    def switch(self, on: bool) -> Recorded[Interval]:
        """See PowerDriver."""
        asked = f"it switches power {'on' if on else 'off'}"
        return self._recorded("power", {"on": on}, asked, _when)

    def hold(self, held: frozenset[str]) -> Recorded[Interval]:
        """See KeysDriver."""
        names = sorted(held)
        asked = f"it holds keys: {', '.join(names) or 'none'}"
        return self._recorded("keys", {"held": names}, asked, _when)

    def sequence(self, steps: Sequence[tuple[int, frozenset[str]]]) -> _Sequence:
        """See KeysDriver."""
        return _Sequence([self.hold(held) for _, held in steps])

    def fail(self, active: frozenset[str]) -> Recorded[Interval]:
        """See FaultsDriver."""
        names = sorted(active)
        asked = f"it brings about errors: {', '.join(names) or 'none'}"
        return self._recorded("faults", {"active": names}, asked, _when)

    def set(self, bit_rate: int) -> Recorded[Interval]:
        """See BitRateDriver."""
        asked = f"it sets the bit rate {bit_rate}"
        return self._recorded("bitrate", {"bit_rate": bit_rate}, asked, _when)

    def read(self) -> Recorded[Mapping[str, str]]:
        """See LedsDriver."""
        return self._recorded("leds", {}, "it reads the LEDs", self._lights)

    def watch(self, for_ns: int) -> Recorded[LedEdges]:
        """See LedsDriver."""
        asked = f"it watches the LEDs for {show_span(for_ns)}"
        return self._recorded("lights", {}, asked, self._edges)

    def late(self) -> Told[Sequence[tuple[int, int]]]:
        """See HealthDriver."""
        return Told(self.port.source.lateness)

    def _recorded(
        self,
        what: str,
        detail: Mapping[str, object],
        asked: str,
        read: Callable[[Moment], T],
    ) -> Recorded[T]:
        return Recorded(self.port.source, what, detail, asked, read)

    def _lights(self, note: Moment) -> Mapping[str, str]:
        leds = note.detail.get("leds")
        if not isinstance(leds, dict):
            raise BenchError("the recording does not say which LEDs were lit")
        return {str(name): str(light) for name, light in leds.items()}

    def _edges(self, note: Moment) -> LedEdges:
        start, edges = note.detail.get("start"), note.detail.get("edges")
        if not isinstance(start, dict) or not isinstance(edges, list):
            raise BenchError("the recording does not say how the LEDs changed")
        changes = [
            (Interval(earliest, latest), str(led), bool(lit))
            for earliest, latest, led, lit in edges
        ]
        return LedEdges(note.when, start, changes)


class _Sequence:
    """Keys that move at instants: one note for each step."""

    descriptors: Sequence[int] = ()
    wake_at = FOREVER

    def __init__(self, steps: list[Recorded[Interval]]) -> None:
        self._steps = steps
        self._done = 0

    def start(self, now: int) -> None:
        """It was started when it was."""

    def poll(self, now: int) -> bool:
        """Whether the record has come to the last step."""
        while self._done < len(self._steps) and self._steps[self._done].poll(now):
            self._done += 1
        return self._done == len(self._steps)

    def result(self) -> Sequence[Interval]:
        """One interval a step."""
        return [step.result() for step in self._steps]


def _when(note: Moment) -> Interval:
    return note.when
