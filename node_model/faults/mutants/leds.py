"""Faults of the LED frames and maps (requirements LED-01..04, LED-06)."""

from __future__ import annotations

from abc import abstractmethod

from node_model.faults.link import Slow, base_of
from node_model.faults.parts import Fault
from node_model.frame import Frame
from node_model.keypad.lamps import Lamps
from node_model.keypad.operation import BLINK_BASE, STEADY_BASE, Operation
from node_model.nmt import NmtState
from node_model.node import MS, NOTHING, Frames


class LedsLate(Slow, Fault):
    """LED frames take effect after 51 ms."""

    violates = ("LED-01", "LED-02")
    span_ns = 51 * MS

    def picks(self, frame: Frame) -> bool:
        """LED frames only."""
        return base_of(frame) in {STEADY_BASE, BLINK_BASE}


class _SteadyDeaf(Lamps):
    """Steady light never changes."""

    def set_steady(self, data: bytes) -> None:
        pass


class SteadyIgnored(Operation, Fault):
    """Frames 200h+X have no effect."""

    violates = ("LED-01",)
    lamps_type = _SteadyDeaf


class _BlinkDeaf(Lamps):
    """Blinking never changes."""

    def set_blinking(self, data: bytes) -> None:
        pass


class BlinkIgnored(Operation, Fault):
    """Frames 300h+X have no effect."""

    violates = ("LED-02",)
    lamps_type = _BlinkDeaf


class _Adds(Lamps):
    """Lamps go on, never off."""

    def set_steady(self, data: bytes) -> None:
        self.steady |= self.map_in(data) or 0


class SteadyOnlyAdds(Operation, Fault):
    """A frame 200h+X lights LEDs, but never puts one out."""

    violates = ("LED-01",)
    lamps_type = _Adds


class _BlinkAdds(Lamps):
    """Lamps begin to blink and never end."""

    def set_blinking(self, data: bytes) -> None:
        self.blinking |= self.map_in(data) or 0


class BlinkOnlyAdds(Operation, Fault):
    """A frame 300h+X makes LEDs blink, but never ends it."""

    violates = ("LED-02",)
    lamps_type = _BlinkAdds


class _Reversed(Lamps):
    """The first LED is the last bit."""

    def map_in(self, data: bytes) -> int | None:
        found = super().map_in(data)
        bits = 8 * self._profile.led_bytes
        return None if found is None else int(f"{found:0{bits}b}"[::-1], 2)


class LedBitsReversed(Operation, Fault):
    """The bits of both LED maps are counted from the other end."""

    violates = ("LED-01", "LED-02")
    lamps_type = _Reversed


class _HalfMap(Lamps):
    """Four lamps are enough."""

    def map_in(self, data: bytes) -> int | None:
        found = super().map_in(data)
        return None if found is None else found & 0x0F


class UpperLedsDead(Operation, Fault):
    """Only the LEDs of bits 0..3 can be lit."""

    violates = ("LED-01", "LED-02")
    lamps_type = _HalfMap


class _BlinkIsSteady(Lamps):
    """Blinking lamps shine steadily."""

    def lit(self, led: str, now: int) -> bool:
        return super().lit(led, now) or bool(self.blinking >> self._profile.leds[led] & 1)


class BlinkIsSteady(Operation, Fault):
    """LEDs in the blink map shine steadily."""

    violates = ("LED-02", "LED-05")
    lamps_type = _BlinkIsSteady


class _Swapped(Lamps):
    """The two frames are mistaken for each other."""

    def set_steady(self, data: bytes) -> None:
        super().set_blinking(data)

    def set_blinking(self, data: bytes) -> None:
        super().set_steady(data)


class LedMapsSwapped(Operation, Fault):
    """200h+X makes LEDs blink and 300h+X lights them steadily."""

    violates = ("LED-01", "LED-02")
    lamps_type = _Swapped


class _BlinkClears(Lamps):
    """A blink frame clears the steady map."""

    def set_blinking(self, data: bytes) -> None:
        super().set_blinking(data)
        self.steady = 0


class BlinkClearsSteady(Operation, Fault):
    """A frame 300h+X puts out the steady LEDs."""

    violates = ("LED-03",)
    lamps_type = _BlinkClears


class _SteadyClears(Lamps):
    """A steady frame clears the blink map."""

    def set_steady(self, data: bytes) -> None:
        super().set_steady(data)
        self.blinking = 0


class SteadyClearsBlink(Operation, Fault):
    """A frame 200h+X ends all blinking."""

    violates = ("LED-03",)
    lamps_type = _SteadyClears


class _OneMap(Lamps):
    """A lamp lit steadily leaves the blink map."""

    def set_steady(self, data: bytes) -> None:
        super().set_steady(data)
        self.blinking &= ~self.steady


class SteadyTakesFromBlink(Operation, Fault):
    """An LED lit steadily leaves the blink map for good."""

    violates = ("LED-03",)
    lamps_type = _OneMap


class _TakesIn(Operation):
    """LED frames act in another state too."""

    state_too: NmtState

    def takes_leds(self) -> bool:
        """There, or where they should."""
        return self.state is self.state_too or super().takes_leds()


class LedsInPreOperational(_TakesIn, Fault):
    """LED frames act in pre-operational too."""

    violates = ("LED-04",)
    state_too = NmtState.PRE_OPERATIONAL


class LedsInStopped(_TakesIn, Fault):
    """LED frames act in stopped too."""

    violates = ("LED-04",)
    state_too = NmtState.STOPPED


class LedsMadeUpFor(Operation, Fault):
    """The last LED frame received outside operational acts on entering it."""

    violates = ("LED-04",)
    kept: Frame | None = None

    def receive(self, frame: Frame, now: int) -> Frames:
        """Keep what may not act."""
        if frame.can_id and not self.takes_leds():
            self.kept = frame
        return super().receive(frame, now)

    def entry_frames(self, now: int) -> Frames:
        """Let it act now."""
        kept, self.kept = self.kept, None
        if kept:
            self.receive(kept, now)
        return super().entry_frames(now)


class _ShortTaken(Lamps):
    """What is missing counts as zero."""

    def map_in(self, data: bytes) -> int | None:
        return super().map_in(data.ljust(self._profile.led_bytes, b"\0"))


class ShortLedFrameTaken(Operation, Fault):
    """An LED frame without data puts out all LEDs of its map."""

    violates = ("LED-06",)
    lamps_type = _ShortTaken


class _LongRefused(Lamps):
    """Exactly as many bytes as there should be."""

    def map_in(self, data: bytes) -> int | None:
        return super().map_in(data) if len(data) == self._profile.led_bytes else None


class LongLedFrameRefused(Operation, Fault):
    """An LED frame with extra bytes is ignored."""

    violates = ("LED-06",)
    lamps_type = _LongRefused


class _LastByte(Lamps):
    """The map stands at the end."""

    def map_in(self, data: bytes) -> int | None:
        return super().map_in(data[-self._profile.led_bytes :])


class LastByteIsLedMap(Operation, Fault):
    """In an LED frame with extra bytes the last one is taken for the map."""

    violates = ("LED-06",)
    lamps_type = _LastByte


class RemoteLedFrameTaken(Operation, Fault):
    """A remote frame 200h+X puts out all steady LEDs."""

    violates = ("LED-06", "LED-01", "ROB-01")

    def receive(self, frame: Frame, now: int) -> Frames:
        """Its empty buffer is taken for the map."""
        asked = frame.remote and not frame.extended
        if asked and frame.can_id == STEADY_BASE + self.node_id and self.takes_leds():
            self.lamps.set_steady(bytes(self.profile.led_bytes))
            return NOTHING
        return super().receive(frame, now)


class _TakesFrom(Operation):
    """LED frames are taken under other identifiers."""

    def acceptance(self) -> frozenset[int] | None:
        """Everything."""
        return None

    @abstractmethod
    def own(self, frame: Frame) -> Frame:
        """The frame as it is understood."""

    def receive(self, frame: Frame, now: int) -> Frames:
        """The usual, with what is understood."""
        return super().receive(self.own(frame), now)


class ExtendedLedFrameTaken(_TakesFrom, Fault):
    """Frames with the 29-bit identifiers 200h+X and 300h+X act on the LEDs."""

    violates = ("LED-01", "LED-02", "ROB-01")

    def own(self, frame: Frame) -> Frame:
        """The format is not looked at; NMT has a filter of its own."""
        led = frame.can_id in {STEADY_BASE + self.node_id, BLINK_BASE + self.node_id}
        taken = led and frame.extended and not frame.remote
        return Frame(frame.can_id, frame.data) if taken else frame


class LedFramesOfAllNodesTaken(_TakesFrom, Fault):
    """LED frames of every node act on the LEDs."""

    violates = ("LED-01", "LED-02", "ROB-01")

    def own(self, frame: Frame) -> Frame:
        """The id is not looked at."""
        base = base_of(frame)
        if frame.extended or frame.remote or base not in {STEADY_BASE, BLINK_BASE}:
            return frame
        return Frame(base + self.node_id, frame.data)


FAULTS: tuple[type[Fault], ...] = (
    LedsLate,
    SteadyIgnored,
    BlinkIgnored,
    SteadyOnlyAdds,
    BlinkOnlyAdds,
    LedBitsReversed,
    UpperLedsDead,
    BlinkIsSteady,
    LedMapsSwapped,
    BlinkClearsSteady,
    SteadyClearsBlink,
    SteadyTakesFromBlink,
    LedsInPreOperational,
    LedsInStopped,
    LedsMadeUpFor,
    ShortLedFrameTaken,
    LongLedFrameRefused,
    LastByteIsLedMap,
    RemoteLedFrameTaken,
    ExtendedLedFrameTaken,
    LedFramesOfAllNodesTaken,
)
