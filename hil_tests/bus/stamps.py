"""Time stamps of adapters on our clock, and the detection of clock steps.

The ports' clock is CLOCK_REALTIME, because the kernel stamps CAN frames with it. Two
things can spoil it: an adapter that counts on a clock of its own, and somebody who sets
the host's clock while a test runs.
"""

from __future__ import annotations

import time
from collections.abc import Callable

from hil_tests.clock import FOREVER, MS, S

FOLLOW_NS = 10 * S
"""How long a quickest arrival counts: two crystals 100 ppm apart drift 1 ms in 10 s."""

STEP_NS = 10 * MS
"""A change of the clock's offset that no slewing explains (NTP slews at most 500 ppm)."""

_LONG_NS = 5 * MS
_SLACK_SHARE = 500

_SLEW_SHARE = 1000
"""Allowed drift is elapsed time / 1000, twice the most that the kernel slews."""


def patience_ns(left_ns: int) -> int:
    """How long to wait in `select` so as not to wake up late.

    Linux may serve a time-out of select, poll or epoll late by a thousandth of its length
    (fs/select.c, select_estimate_accuracy), 1 ms in a second. So a long wait is made in
    two: nearly all of it, then the rest.
    """
    if left_ns <= _LONG_NS:
        return max(left_ns, 0)
    return left_ns - left_ns // _SLACK_SHARE


class Follower:
    """Puts stamps of a foreign clock onto ours.

    A frame is never seen before it ended, so the smallest delay between its own stamp and
    our sight of it is the best estimate of the offset of the two clocks. The smallest
    delay of the last one to two windows is used; what remains is a constant bias.
    """

    __slots__ = ("_newer", "_older", "_since", "_window_ns")

    def __init__(self, window_ns: int = FOLLOW_NS) -> None:
        self._window_ns = window_ns
        self._older = FOREVER
        self._newer = FOREVER
        self._since = -FOREVER

    def ours(self, stamp: int, seen_at: int) -> int:
        """The instant on our clock of a foreign `stamp` seen at `seen_at`; never later."""
        delay = seen_at - stamp
        if seen_at - self._since > self._window_ns:
            self._older, self._newer, self._since = self._newer, delay, seen_at
        elif delay < self._newer:
            self._newer = delay
        return stamp + min(self._older, self._newer)


class StepWatch:
    """Notices that the realtime clock was set, by comparing it with the monotonic one."""

    __slots__ = ("_at", "_monotonic", "_offset", "_real")

    def __init__(
        self,
        real: Callable[[], int] = time.time_ns,
        monotonic: Callable[[], int] = time.monotonic_ns,
    ) -> None:
        self._real = real
        self._monotonic = monotonic
        self._at = monotonic()
        self._offset = real() - self._at

    def step(self) -> int:
        """By how many ns the clock was set since the last call; 0 = it was not."""
        before = self._monotonic()
        real = self._real()
        if self._monotonic() - before > MS:
            return 0  # we were stopped between the readings; the next call will tell
        moved = real - before - self._offset
        allowed = STEP_NS + (before - self._at) // _SLEW_SHARE
        self._at = before
        self._offset += moved
        return moved if abs(moved) > allowed else 0
