"""Judging a periodic service: each interval, and the mean, guard-banded.

FAIL if one interval or the mean lies outside for certain; PASS if enough intervals are
conclusive and all of those pass and the mean passes; else INCONCLUSIVE.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from hil_tests.clock import Interval, show_interval, show_span
from hil_tests.judge.verdict import Limits, Outcome, Verdict

ENOUGH = 20
"""Conclusive intervals that a PASS needs."""


@dataclass(frozen=True, slots=True)
class Periodic:
    """What a row of beats showed.

    Args:
        intervals: number of intervals between beats.
        conclusive: how many of them lie clearly inside or outside.
        failed: index of the first beat whose distance to the one before is wrong.
        worst: that interval, or else the one nearest to a limit.
        worst_index: index of the beat that ends it.
        mean: mean interval, with its doubt; None without an interval.
        mean_outcome: of the mean.
    """

    intervals: int
    conclusive: int
    failed: int | None
    worst: Interval | None
    mean: Interval | None
    mean_outcome: Outcome
    worst_index: int = 0

    @property
    def inconclusive_share(self) -> float:
        """Share of the intervals whose doubt straddles a limit, 0..1."""
        return 1 - self.conclusive / self.intervals if self.intervals else 0.0


def mean_interval(beats: Sequence[Interval]) -> Interval:
    """Mean distance of consecutive beats, rounded outwards; two beats or more."""
    total = beats[-1].since(beats[0])
    count = len(beats) - 1
    return Interval(total.earliest // count, -(-total.latest // count))


def _exceeds(measured: Interval, limits: Limits) -> int:
    """How far the middle of a measured span is from the middle of the limits, for ranking."""
    middle = limits.at_least_ns + limits.at_most_ns
    return abs(measured.earliest + measured.latest - middle)


def survey(beats: Sequence[Interval], each: Limits, mean: Limits) -> Periodic:
    """Hold a row of beats against limits for each interval and for their mean.

    Args:
        beats: the interval in which each beat was asked for, in order.
        each: limits of a single interval, both finite.
        mean: limits of the mean.
    """
    conclusive = 0
    failed: int | None = None
    worst: Interval | None = None
    worst_index = 0
    for index in range(1, len(beats)):
        measured = beats[index].since(beats[index - 1])
        outcome = each.check(measured)
        conclusive += outcome is not Outcome.INCONCLUSIVE
        if failed is not None:
            continue
        if outcome is Outcome.FAIL:
            failed, worst, worst_index = index, measured, index
        elif worst is None or _exceeds(measured, each) > _exceeds(worst, each):
            worst, worst_index = measured, index
    count = max(len(beats) - 1, 0)
    middle = mean_interval(beats) if count else None
    outcome = mean.check(middle) if middle is not None else Outcome.INCONCLUSIVE
    return Periodic(count, conclusive, failed, worst, middle, outcome, worst_index)


def judge_periodic(
    name: str,
    beats: Sequence[Interval],
    each: Limits,
    mean: Limits,
    requirement: str = "",
    enough: int = ENOUGH,
) -> Verdict:
    """The verdict on a periodic service.

    Args:
        name: for people, e.g. "heartbeat of node 5".
        beats: the interval in which each beat was asked for, in order.
        each: limits of a single interval.
        mean: limits of the mean; judged over `enough` intervals or more.
        requirement: id; "" = the one under test.
        enough: conclusive intervals that a PASS needs.
    """
    seen = survey(beats, each, mean)
    ends = tuple(beats[seen.worst_index - 1 : seen.worst_index + 1]) if seen.worst else ()
    if seen.failed is not None and seen.worst is not None:
        text = f"{name}: interval {seen.failed} of {seen.intervals} is {show_interval(seen.worst)}"
        at = beats[seen.failed].latest
        return Verdict(requirement, Outcome.FAIL, text, seen.worst, each, at, *ends)
    whole = f"{name}: {seen.intervals} intervals, {seen.conclusive} conclusive"
    if seen.intervals >= enough and seen.mean_outcome is Outcome.FAIL and seen.mean:
        text = f"{whole}, mean {show_interval(seen.mean)}"
        return Verdict(requirement, Outcome.FAIL, text, seen.mean, mean, beats[-1].latest)
    if seen.conclusive >= enough and seen.mean_outcome is Outcome.PASS and seen.mean:
        text = f"{whole}, mean {show_interval(seen.mean)}"
        return Verdict(requirement, Outcome.PASS, text, seen.worst, each, None, *ends)
    need = f"; a verdict needs {enough} conclusive ones"
    if seen.mean is not None and seen.mean_outcome is not Outcome.PASS:
        need += f" and a clear mean (now {show_interval(seen.mean)}, {mean})"
    text = whole + need
    return Verdict(requirement, Outcome.INCONCLUSIVE, text, seen.worst, each, None, *ends)


def around(period_ns: int, tolerance_ns: int) -> Limits:
    """Limits `period_ns` plus or minus `tolerance_ns`.

    Raises:
        ValueError: a negative tolerance.
    """
    if tolerance_ns < 0:
        raise ValueError(f"tolerance {show_span(tolerance_ns)} is negative")
    return Limits(period_ns - tolerance_ns, period_ns + tolerance_ns)
