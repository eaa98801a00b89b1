"""What a synchronous window leaves of RPDOs: a pure function of when things were on the bus.

A synchronous RPDO that came within the window since the last SYNC takes effect with the next
one; of several the last. One that came later is ignored. Around the end of the window either
may be, and before the first SYNC nobody knows of a window. (CiA 301 4.2.0, 7.2.5.2, 7.5.2.7)
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from hil_tests.clock import FOREVER, Interval

Values = frozenset[int]


@dataclass(frozen=True, slots=True)
class Received:
    """An RPDO: when it was on the bus, and what it carries."""

    when: Interval
    value: int


@dataclass(frozen=True, slots=True)
class Window:
    """The synchronous window, and how exactly it is asked for, in ns.

    Args:
        length_ns: 0 = there is none.
        margin_ns: so far from its end either is right.
    """

    length_ns: int
    margin_ns: int

    def holds(self, span: Interval) -> frozenset[bool]:
        """Whether a frame that comes this long after a SYNC may count, or may not."""
        if not self.length_ns:
            return frozenset((True,))
        surely = span.latest <= self.length_ns - self.margin_ns
        surely_not = span.earliest > self.length_ns + self.margin_ns
        return frozenset((True,) if surely else (False,) if surely_not else (True, False))


def permitted(
    start: int, syncs: Sequence[Interval], rpdos: Sequence[Received], window: Window
) -> list[Values]:
    """The values that the object may have after each SYNC.

    Args:
        start: its value before the first one.
        syncs: when they ended, in order.
        rpdos: in order.
        window: see there.
    """
    found: list[Values] = []
    now: Values = frozenset((start,))
    since = Interval(-FOREVER, -FOREVER)
    for sync in syncs:
        for rpdo in rpdos:
            if since.latest < rpdo.when.latest <= sync.latest:
                now = _with(now, rpdo, since, window)
        found.append(now)
        since = sync
    return found


def _with(now: Values, rpdo: Received, since: Interval, window: Window) -> Values:
    """What the object may be, as far as this RPDO is concerned."""
    counts = window.holds(rpdo.when.since(since))
    if since.latest == -FOREVER:
        counts = frozenset((True, False) if window.length_ns else (True,))
    values = set[int]()
    if True in counts:
        values.add(rpdo.value)
    if False in counts:
        values |= now
    return frozenset(values)
