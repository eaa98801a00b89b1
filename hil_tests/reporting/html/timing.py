"""Measured times of a run, gathered for plots: periods of heartbeats, and how long answers took.

Periods are read off the recordings, frame end to frame end, so they show the wire as it was;
the judge, who allows for other traffic, may be milder. Answers are what the checks measured.
"""

from __future__ import annotations

import re
from bisect import bisect_right
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

from hil_tests.reporting.html.checks import Check
from hil_tests.reporting.html.recording import Recording
from hil_tests.reporting.html.view import TestView
from hil_tests.reporting.margins import Ends

ENOUGH = 5
"""So many values make a distribution worth drawing."""
_MOST_PERIODS, _MOST_ANSWERS = 4, 12
_PERIODIC = re.compile(r"heartbeat\b.*\bintervals?\b")
_NUMBERS = re.compile(r"\b(?:[0-9A-F]{3}#[0-9A-F]*|[0-9a-f]{2}h|\d+(?:\.\d+)?)\b")


@dataclass(slots=True)
class Series:
    """Values that were held against the same limits.

    Args:
        name: what was measured.
        limits: at least, at most, in ns.
        values: the interval in which each value lies, in ns, in order of time.
        tests: numbers of the tests that they come from.
        worst: the smallest margin as a share of what the limits allow.
    """

    name: str
    limits: Ends
    values: list[tuple[int, int]] = field(default_factory=list)
    tests: dict[int, None] = field(default_factory=dict)
    worst: float = float("inf")

    @property
    def doubt_ns(self) -> int:
        """The largest doubt of a value."""
        return max((high - low for low, high in self.values), default=0)


def periods(tests: Sequence[TestView]) -> list[Series]:
    """Periods of heartbeats, for each pair of limits; those with most values first."""
    found: dict[Ends, Series] = {}
    for test in tests:
        judged = {*_limits_of_periods(test.checks)}
        if test.recording is None or len(judged) != 1:
            continue  # of several periods in one recording nobody says which beat keeps which
        limits = judged.pop()
        series = found.setdefault(limits, Series("period of the heartbeat", limits))
        series.values += _gaps(test.recording, limits)
        series.tests[test.number] = None
    enough = [series for series in found.values() if len(series.values) >= ENOUGH]
    return sorted(enough, key=lambda series: -len(series.values))[:_MOST_PERIODS]


def _limits_of_periods(checks: Sequence[Check]) -> Iterator[tuple[int, int]]:
    """Limits of single periods, where a test judged some."""
    for check in checks:
        low, high = check.row.limits_ns or (None, None)
        if low is not None and high is not None and _PERIODIC.match(check.row.what):
            yield low, high


def _gaps(recording: Recording, limits: tuple[int, int]) -> Iterator[tuple[int, int]]:
    """Distances of a node's heartbeats between which nothing was done to it."""
    kinds, numbers, at = recording.kinds, recording.kind, recording.at
    beats = {
        number
        for number in set(numbers)
        if not kinds.all[number].own and 0x700 < kinds.all[number].frame.can_id < 0x780
    }
    acts = [index for index, number in enumerate(numbers) if number in kinds.own]
    acts = sorted({*acts, *(place for place, _ in recording.notes)})
    low, high = limits
    for before, after in pairwise(
        index for index, number in enumerate(numbers) if number in beats
    ):
        gap = at[after] - at[before]
        if not low // 2 <= gap <= 2 * high:
            continue
        first, second = kinds.all[numbers[before]], kinds.all[numbers[after]]
        undisturbed = bisect_right(acts, before) == bisect_right(acts, after)
        if undisturbed and first.frame == second.frame:
            yield gap - second.doubt_ns, gap + first.doubt_ns


def answers(tests: Sequence[TestView]) -> list[Series]:
    """What checks measured, by requirement and limits; what came nearest to a limit first."""
    found: dict[tuple[str, Ends], Series] = {}
    for test in tests:
        for check in test.checks:
            row, margin = check.row, check.margin
            if margin is None or row.measured_ns is None or row.limits_ns is None:
                continue
            if _PERIODIC.match(row.what):
                continue
            series = found.get((row.requirement, row.limits_ns))
            if series is None:
                series = Series(f"{row.requirement}: {_general(row.what)}", row.limits_ns)
                found[row.requirement, row.limits_ns] = series
            series.values.append(row.measured_ns)
            series.tests[test.number] = None
            if margin.share is not None:
                series.worst = min(series.worst, margin.share)
    enough = [series for series in found.values() if len(series.values) >= ENOUGH]
    return sorted(enough, key=lambda series: series.worst)[:_MOST_ANSWERS]


def _general(what: str) -> str:
    """What was judged, without the numbers of one case."""
    return _NUMBERS.sub("…", what)[:64]
