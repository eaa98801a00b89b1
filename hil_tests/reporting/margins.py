"""How much room a measurement left: in ns, in units of its own doubt, and as a share.

The room that is certain: from the end of the measured interval that lies worst to the limit
it comes nearest to. So a check that passed has a margin of 0 or more, one that failed for
certain has less than minus one doubt, and what lies between was inconclusive.
"""

from __future__ import annotations

from typing import NamedTuple

Ends = tuple[int | None, int | None]
"""At least, at most, in ns; None = no limit on that side."""


class Margin(NamedTuple):
    """The room that is left; negative = the limit is, or may be, exceeded.

    Args:
        ns: the certain distance to the nearest limit.
        doubts: the same in units of the measurement's doubt (its width; an exact one counts
            as 1 ns).
        share: the same as a share of what the limits allow: of half their distance where
            there are two (1 = right in the middle), of the limit itself where there is one.
            None where that limit is 0.
    """

    ns: int
    doubts: float
    share: float | None


def margin_of(measured: tuple[int, int] | None, limits: Ends | None) -> Margin | None:
    """The margin of a check; None where nothing was measured, or held against nothing.

    Args:
        measured: interval in which the measured span lies, ns.
        limits: what it was held against.
    """
    if measured is None or limits is None or limits == (None, None):
        return None
    low, high = limits
    below = measured[0] - low if low is not None else None
    above = high - measured[1] if high is not None else None
    room = min(side for side in (below, above) if side is not None)
    doubt = max(measured[1] - measured[0], 1)
    whole = _allowed(low, high)
    share = round(room / whole, 6) if whole else None
    return Margin(room, round(room / doubt, 3), share)


def _allowed(low: int | None, high: int | None) -> float:
    """The largest margin that the limits leave: 0 where there is no such thing."""
    if low is not None and high is not None:
        return (high - low) / 2
    return abs(low if low is not None else high or 0)
