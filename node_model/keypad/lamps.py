"""The LEDs of the keypad: two independent maps, one for steady light, one for blinking."""

from __future__ import annotations

from node_model.blink import BlinkWave
from node_model.keypad.profile import Profile


class Lamps:
    """Steady and blinking map, and the light that follows from them.

    Args:
        profile: names, bits and waveform of the LEDs.
        now: origin of the blink waveform, common to all LEDs.
    """

    def __init__(self, profile: Profile, now: int = 0) -> None:
        self._profile = profile
        self._wave = BlinkWave(profile.blink_on_ns, profile.blink_off_ns, now)
        self.steady = 0
        self.blinking = 0

    def map_in(self, data: bytes) -> int | None:
        """The map that a frame holds, first byte lowest; None where it is too short."""
        size = self._profile.led_bytes
        if len(data) < size:
            return None
        return int.from_bytes(data[:size], "little") & self._profile.led_mask

    def set_steady(self, data: bytes) -> None:
        """A frame 200h+id arrived."""
        found = self.map_in(data)
        if found is not None:
            self.steady = found

    def set_blinking(self, data: bytes) -> None:
        """A frame 300h+id arrived."""
        found = self.map_in(data)
        if found is not None:
            self.blinking = found

    def lit(self, led: str, now: int) -> bool:
        """Whether the LED of that name shines at `now`."""
        bit = 1 << self._profile.leds[led]
        blinking = self.blinking & bit
        if self.steady & bit and (self._profile.steady_wins or not blinking):
            return True
        return bool(blinking) and self._wave.lit(now)

    def change(self, now: int) -> int | None:
        """The next instant after `now` at which some LED changes by itself."""
        blinking = self.blinking & ~self.steady if self._profile.steady_wins else self.blinking
        return self._wave.change(now) if blinking else None
