"""A bench on a table: a port that plays what it is told, drivers that note what is asked."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from typing import Any

from hil_tests.bench.action import LedEdges
from hil_tests.bench.keypad import KeypadBench
from hil_tests.bench.virtual import Done
from hil_tests.clock import MS, US, Interval, exactly
from hil_tests.config import Parameters, Setup, load_keypad
from hil_tests.errors import BusUnavailable
from hil_tests.trace import BusEvent, Sighting
from node_model.frame import Frame

PROFILE = load_keypad("keypad")
HOME = PROFILE.factory
ECHO_NS = 100 * US


class FakePort:
    """Plays frames at their instants, on an untimed wire unless told otherwise."""

    name = "fake0"
    clock = "a fake one"

    def __init__(self, *, timed: bool = False, doubt_ns: int = 0) -> None:
        self.timed = timed
        self.doubt_ns = doubt_ns
        self.at = 0
        self.coming: deque[Sighting | BusEvent] = deque()
        self.sent: list[Frame] = []
        self.late_ns = 0
        """How much too late every wait ends."""
        self.acknowledged = True
        self.gone = ""
        self.closed = 0

    def now(self) -> int:
        """Fake time in ns."""
        return self.at

    def plays(self, frame: Frame | str, at: int, doubt_ns: int = 0) -> None:
        """A frame of somebody else at an instant; as text "701#00"."""
        if isinstance(frame, str):
            can_id, _, data = frame.partition("#")
            frame = Frame(int(can_id, 16), bytes.fromhex(data))
        self._insert(Sighting(frame, at, doubt_ns or self.doubt_ns))

    def tells(self, event: BusEvent) -> None:
        """A bus event."""
        self._insert(event)

    def _insert(self, item: Sighting | BusEvent) -> None:
        later = [each for each in self.coming if each.at > item.at]
        sooner = [each for each in self.coming if each.at <= item.at]
        self.coming = deque([*sooner, item, *later])

    def send(self, frame: Frame) -> None:
        """Seen again a little later, if anybody acknowledges."""
        self._check()
        self.sent.append(frame)
        if self.acknowledged:
            self._insert(Sighting(frame, self.at + ECHO_NS, 0, own=True))

    def next(self, until: int, also: Sequence[int] = ()) -> Sighting | BusEvent | None:
        """What comes by `until`; a readable descriptor is never there."""
        del also
        self._check()
        if self.coming and self.coming[0].at <= max(until, self.at):
            item = self.coming.popleft()
            self.at = max(self.at, item.at)
            return item
        if until > self.at:
            self.at = until + self.late_ns
        return None

    def _check(self) -> None:
        if self.gone:
            raise BusUnavailable(self.gone)

    def set_bit_rate(self, bit_rate: int) -> None:
        """Nothing to set."""

    def close(self) -> None:
        """Note it."""
        self.closed += 1


class FakeStage:
    """A bench whose drivers take a millisecond each, and note what was asked of them."""

    virtual = False
    exclusive = True
    fades = False
    health: Any = None
    timed_sequences = False
    sees_edges = False

    def __init__(
        self, port: FakePort, *, without: Sequence[str] = (), writes_allowed: bool = True
    ) -> None:
        self.name = "desk"
        self.port = port
        self.bit_rate = HOME.bit_rate
        self.writes_allowed = writes_allowed
        self.asked: list[str] = []
        self.power: Any = None if "power" in without else self
        self.keys: Any = None if "keys" in without else self
        self.leds: Any = None if "leds" in without else self
        self.faults: Any = None if "faults" in without else self
        self.bitrate: Any = None if "bitrate" in without else self
        self.loadable = False
        self.leave = ExitStack()

    def _noted(self, what: str) -> Done[Interval]:
        def do() -> Interval:
            self.asked.append(what)
            return Interval(self.port.at - 1 * MS, self.port.at)

        return Done(do, 1 * MS)

    def switch(self, on: bool) -> Done[Interval]:
        """See PowerDriver."""
        return self._noted(f"power {'on' if on else 'off'}")

    def hold(self, held: frozenset[str]) -> Done[Interval]:
        """See KeysDriver."""
        return self._noted(f"keys {' '.join(sorted(held)) or '-'}")

    def fail(self, active: frozenset[str]) -> Done[Interval]:
        """See FaultsDriver."""
        return self._noted(f"faults {' '.join(sorted(active)) or '-'}")

    def sequence(self, steps: Sequence[tuple[int, frozenset[str]]]) -> Done[Sequence[Interval]]:
        """See KeysDriver."""

        def do() -> Sequence[Interval]:
            self.asked.append(f"sequence of {len(steps)}")
            start = self.port.at - steps[-1][0]
            return [exactly(start + span_ns) for span_ns, _ in steps]

        return Done(do, steps[-1][0])

    def set(self, bit_rate: int) -> Done[Interval]:
        """See BitRateDriver."""
        return self._noted(f"bitrate {bit_rate}")

    def read(self) -> Done[Mapping[str, str]]:
        """See LedsDriver."""
        return Done(lambda: {"aut": "blink"}, 3 * MS)

    def watch(self, for_ns: int) -> Done[LedEdges]:
        """See LedsDriver."""
        return Done(lambda: LedEdges(exactly(self.port.at), {}, []), for_ns)

    def renew(self, parameters: Setup) -> bool:
        """A real bench has no other device."""
        del parameters
        return False

    def load(self, frames: Sequence[Frame], share_ppm: int) -> bool:
        """As the test wants."""
        del frames, share_ppm
        return self.loadable

    def end_load(self) -> None:
        """Note it."""
        self.asked.append("end load")

    def disturb(self) -> bool:
        """As the test wants."""
        return self.loadable

    def check(self) -> None:
        """It is there."""

    def close(self) -> None:
        """Note it."""
        self.asked.append("close")


def bench_of(
    port: FakePort | None = None, parameters: Parameters | None = HOME, **options: Any
) -> tuple[KeypadBench, FakeStage]:
    """A bench on a fake stage."""
    stage = FakeStage(port or FakePort(), **options)
    return KeypadBench(stage, PROFILE, parameters), stage
