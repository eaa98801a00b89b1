"""Instants, spans and intervals of time, in integer nanoseconds, and how they are shown.

Instants end in `_at`, spans in `_ns`. What is not known exactly is an `Interval`: the
instant lay somewhere in it, both ends included.
"""

from __future__ import annotations

import re
from typing import NamedTuple

US = 1_000
MS = 1_000_000
S = 1_000_000_000
FOREVER = 1 << 62
"""An instant later than every other."""

_UNITS = {"ns": 1, "us": US, "ms": MS, "s": S, "min": 60 * S, "h": 3600 * S}
_SPAN = re.compile(r"\s*([0-9]+(?:\.[0-9]+)?)\s*(ns|us|ms|s|min|h)\s*")


named = tuple.__new__
"""Makes a named tuple of its class and its fields, without the call in between: in half the
time. For what is made once a frame, for hours of bus time a second."""


class Interval(NamedTuple):
    """A span of time that holds an instant which is not known better.

    As the difference of two instants it holds a duration.
    """

    earliest: int
    latest: int

    @property
    def doubt_ns(self) -> int:
        """Its width in ns; 0 = known exactly."""
        return self.latest - self.earliest

    def since(self, other: Interval) -> Interval:
        """The duration from an instant in `other` to an instant in this one."""
        return named(Interval, (self.earliest - other.latest, self.latest - other.earliest))

    def shifted(self, span_ns: int) -> Interval:
        """The same interval, `span_ns` later."""
        return Interval(self.earliest + span_ns, self.latest + span_ns)


def exactly(instant: int) -> Interval:
    """An instant that is known to the nanosecond."""
    return named(Interval, (instant, instant))


def parse_span(text: str) -> int:
    """A span of time with its unit, e.g. "500 ms", as integer ns.

    Raises:
        ValueError: no number, no unit, or an unknown unit; the text says which are known.
    """
    found = _SPAN.fullmatch(text)
    if not found:
        raise ValueError(f"{text!r} is no time: write a number and one of {', '.join(_UNITS)}")
    number, unit = found.groups()
    whole, _, fraction = number.partition(".")
    digits = len(fraction)
    scaled = int(whole + fraction) * _UNITS[unit]
    if scaled % 10**digits:
        raise ValueError(f"{text!r} is no whole number of nanoseconds")
    return int(scaled // 10**digits)


def show_span(span_ns: int) -> str:
    """A span for people: three decimals at most, in the unit that suits its size."""
    size = abs(span_ns)
    for unit, scale in (("s", S), ("ms", MS), ("us", US)):
        if size >= scale and not (unit == "s" and size < 10 * S and span_ns % S):
            text = f"{span_ns / scale:.3f}".rstrip("0").rstrip(".")
            return f"{text} {unit}"
    return f"{span_ns} ns"


def show_interval(interval: Interval) -> str:
    """A duration with its doubt: "99.8 ms", or "99.8 .. 100.4 ms" style ends."""
    if interval.earliest == interval.latest:
        return show_span(interval.earliest)
    return f"{show_span(interval.earliest)} .. {show_span(interval.latest)}"
