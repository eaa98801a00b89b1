"""What went wrong on the bus while frames were counted: error frames, and frames lost."""

from __future__ import annotations

from dataclasses import dataclass

from hil_tests.trace import EventKind, Trace


@dataclass(slots=True)
class Census:
    """Sums over traces.

    Args:
        error_frames: that were seen on the bus.
        losses: how often frames were lost on the way to the tester.
        lost: how many frames that were, as far as it is known.
    """

    error_frames: int = 0
    losses: int = 0
    lost: int = 0

    def add(self, trace: Trace) -> None:
        """Count a trace that has ended."""
        for event in trace.events():
            self.error_frames += event.kind is EventKind.ERROR
            self.losses += event.kind in {EventKind.GAP, EventKind.OVERFLOW}
            self.lost += event.lost
