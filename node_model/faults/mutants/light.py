"""Faults in how the LEDs shine: waveform, precedence, reset (requirements LED-05, 20, 21)."""

from __future__ import annotations

from dataclasses import replace

from node_model.faults.parts import Fault
from node_model.keypad import Profile
from node_model.keypad.lamps import Lamps
from node_model.keypad.operation import Operation
from node_model.nmt import NmtCommand
from node_model.node import Frames, earliest


class _FastBlink(Lamps):
    """Another waveform."""

    def __init__(self, profile: Profile, now: int = 0) -> None:
        half = replace(
            profile, blink_on_ns=profile.blink_on_ns // 2, blink_off_ns=profile.blink_off_ns // 2
        )
        super().__init__(half, now)


class BlinkTooFast(Operation, Fault):
    """LEDs blink twice as fast as they should."""

    violates = ("LED-05",)
    lamps_type = _FastBlink


class _UnevenBlink(Lamps):
    """Another duty cycle."""

    def __init__(self, profile: Profile, now: int = 0) -> None:
        on_ns = profile.blink_on_ns // 4
        off_ns = profile.blink_off_ns + profile.blink_on_ns - on_ns
        super().__init__(replace(profile, blink_on_ns=on_ns, blink_off_ns=off_ns), now)


class BlinkOfWrongDutyCycle(Operation, Fault):
    """Blinking LEDs flash for a quarter of their time, at the right period."""

    violates = ("LED-05",)
    lamps_type = _UnevenBlink


class _OutOfPhase(Lamps):
    """Every second lamp is ahead by a quarter of the period."""

    def _ahead(self, led: str) -> int:
        period = self._profile.blink_on_ns + self._profile.blink_off_ns
        return period // 4 if self._profile.leds[led] % 2 else 0

    def lit(self, led: str, now: int) -> bool:
        return super().lit(led, now + self._ahead(led))

    def change(self, now: int) -> int | None:
        shifts = {self._ahead(led) for led in self._profile.leds}
        changes = ((super(_OutOfPhase, self).change(now + by), by) for by in shifts)
        return earliest(*(at - by for at, by in changes if at is not None))


class BlinkOutOfPhase(Operation, Fault):
    """Every second blinking LED is a quarter of a period ahead of the others."""

    violates = ("LED-05",)
    lamps_type = _OutOfPhase


class _BlinkWins(Lamps):
    """The other precedence."""

    def __init__(self, profile: Profile, now: int = 0) -> None:
        super().__init__(replace(profile, steady_wins=not profile.steady_wins), now)


class BlinkWins(Operation, Fault):
    """An LED in both maps blinks where it should be steady (or the other way round)."""

    violates = ("LED-20",)
    lamps_type = _BlinkWins


class LedsSurviveReset(Operation, Fault):
    """LEDs stay as they were through an NMT reset."""

    violates = ("LED-21",)

    def reset(self, command: NmtCommand, now: int) -> Frames:
        """All but the lamps."""
        lamps = self.lamps
        frames = super().reset(command, now)
        self.lamps = lamps
        return frames


class _LampTest(Lamps):
    """All lamps shine at first."""

    def __init__(self, profile: Profile, now: int = 0) -> None:
        super().__init__(profile, now)
        self.steady = profile.led_mask


class LedsOnAfterReset(Operation, Fault):
    """All LEDs are on after a start until a frame puts them out."""

    violates = ("LED-21",)
    lamps_type = _LampTest


FAULTS: tuple[type[Fault], ...] = (
    BlinkTooFast,
    BlinkOfWrongDutyCycle,
    BlinkOutOfPhase,
    BlinkWins,
    LedsSurviveReset,
    LedsOnAfterReset,
)
