"""How far a measurement stays from its limits, in time and in units of its own doubt."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import chain

from hil_tests.clock import show_span
from hil_tests.reporting.results import VerdictRow


@dataclass(frozen=True, slots=True)
class Margin:
    """The distance from the end of the measured interval that lies nearest to a limit.

    Args:
        span_ns: to that limit; negative = beyond it.
        doubt_ns: width of the measured interval.
    """

    span_ns: int
    doubt_ns: int

    @property
    def units(self) -> float | None:
        """In units of doubt; None where the measurement is exact."""
        return self.span_ns / self.doubt_ns if self.doubt_ns else None

    def __str__(self) -> str:
        units = self.units
        if units is None:
            return f"{show_span(self.span_ns)} (exact)"
        shown = f"{units:.1f}" if abs(units) < 100 else f"{units:,.0f}".replace(",", "\u202f")
        return f"{show_span(self.span_ns)} = {shown} × doubt"


def margin_of(row: VerdictRow) -> Margin | None:
    """The margin of a verdict; None where nothing was held against a limit."""
    if row.measured_ns is None or row.limits_ns is None:
        return None
    earliest, latest = row.measured_ns
    low, high = row.limits_ns
    distances = chain(
        () if low is None else (earliest - low,), () if high is None else (high - latest,)
    )
    nearest = min(distances, default=None)
    return None if nearest is None else Margin(nearest, latest - earliest)


def is_near(row: VerdictRow) -> bool:
    """Whether a verdict deserves a look: not plainly passed, or within ten doubts of a limit."""
    if row.outcome not in {"passed", "characteristic"}:
        return True
    margin = margin_of(row)
    return margin is not None and margin.doubt_ns > 0 and margin.span_ns < 10 * margin.doubt_ns
