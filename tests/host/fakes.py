"""A small node, a wire and a clock for the tests of the host."""

from __future__ import annotations

from collections import deque

from node_model.frame import Frame
from node_model.node import MS, NOTHING, Frames

PERIOD_NS = 100 * MS
BLINK_NS = 500 * MS


class Clock:
    """A clock that is told the time; each reading may take some."""

    def __init__(self, now: int = 1_000_000_000_000) -> None:
        self.now = now
        self.takes_ns = 0

    def __call__(self) -> int:
        """The present."""
        self.now += self.takes_ns
        return self.now


class FakeWire:
    """Holds what came in, and keeps what went out with the instant at which it did."""

    name = "wire0"
    descriptor: int | None = None

    def __init__(self, clock: Clock) -> None:
        self.clock = clock
        self.incoming: deque[tuple[Frame, int]] = deque()
        self.sent: list[tuple[Frame, int]] = []
        self.full = 0
        """How many sends to refuse."""
        self.takes_ns = 0
        """How long a send takes."""

    def receive(self) -> tuple[Frame, int] | None:
        """The next frame with its stamp."""
        return self.incoming.popleft() if self.incoming else None

    def send(self, frame: Frame) -> bool:
        """Send, unless the queue is full."""
        if self.full:
            self.full -= 1
            return False
        self.clock.now += self.takes_ns
        self.sent.append((frame, self.clock.now))
        return True

    def close(self) -> None:
        """Nothing to close."""


class FakePanel:
    """Beats every 100 ms, answers frames to 123h, reports its keys, blinks one lamp."""

    name = "fake"
    keys: tuple[str, ...] = ("a", "b")
    leds: tuple[str, ...] = ("red", "green")
    faults: tuple[str, ...] = ("short", "open")

    def __init__(self) -> None:
        self.powered = False
        self.bit_rate = 0
        self.listens_to: frozenset[int] | None = frozenset({0x123})
        self.log: list[tuple[str, int]] = []
        self.on_at = 0
        self.green = False
        self._beat_at: int | None = None

    def power_on(self, now: int) -> Frames:
        """Boot at once."""
        self._told("power_on", now)
        if self.powered:
            return NOTHING
        self.powered, self.bit_rate, self.on_at = True, 125_000, now
        self._beat_at = now + PERIOD_NS
        return (Frame(0x701, b"\0"),)

    def power_off(self, now: int) -> Frames:
        """Silence."""
        self._told("power_off", now)
        self.powered, self.bit_rate, self._beat_at = False, 0, None
        return NOTHING

    def receive(self, frame: Frame, now: int) -> Frames:
        """Say the same one identifier up; the data switch the green lamp."""
        self._told(f"receive {frame}", now)
        self.green = frame.data == b"\1"
        return (Frame(frame.can_id + 1, frame.data),)

    def advance(self, now: int) -> Frames:
        """Beat as often as is due."""
        self._told("advance", now)
        beats = []
        while self._beat_at is not None and self._beat_at <= now:
            self._beat_at += PERIOD_NS
            beats.append(Frame(0x701, b"\5"))
        return beats

    def deadline(self) -> int | None:
        """The next beat."""
        return self._beat_at

    def hold(self, held: frozenset[str], now: int) -> Frames:
        """Report the keys."""
        self._told(f"hold {sorted(held)}", now)
        return (Frame(0x181, bytes([len(held)])),) if self.powered else NOTHING

    def fail(self, active: frozenset[str], now: int) -> Frames:
        """Report the errors."""
        self._told(f"fail {sorted(active)}", now)
        return (Frame(0x081, bytes([len(active)])),) if self.powered else NOTHING

    def lit(self, led: str, now: int) -> bool:
        """Red blinks from power-on, green is switched by frames."""
        if led == "green":
            return self.powered and self.green
        return self.powered and (now - self.on_at) // BLINK_NS % 2 == 0

    def lamp_change(self, now: int) -> int | None:
        """The next edge of the red lamp."""
        return now + BLINK_NS - (now - self.on_at) % BLINK_NS if self.powered else None

    def image(self) -> bytes:
        """It remembers nothing."""
        return b""

    def _told(self, verb: str, now: int) -> None:
        assert not self.log or now >= self.log[-1][1], f"time went back at {verb}"
        self.log.append((verb, now))
