"""Blink waveform: light as a function of time, so that lamps with one origin are in phase."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class BlinkWave:
    """On for `on_ns`, off for `off_ns`, for ever; on at its origin."""

    on_ns: int
    off_ns: int
    origin: int = 0

    def lit(self, now: int) -> bool:
        """Whether the lamp shines at `now`."""
        return (now - self.origin) % (self.on_ns + self.off_ns) < self.on_ns

    def change(self, now: int) -> int:
        """The first instant after `now` at which it changes."""
        phase = (now - self.origin) % (self.on_ns + self.off_ns)
        start = now - phase
        return start + (self.on_ns if phase < self.on_ns else self.on_ns + self.off_ns)
