"""Plots of measured times as static SVG: histogram, run chart, empirical distribution.

In each the limits are lines, what they allow is green, and the guard band is hatched: there
the doubt of the measurement does not let one say whether a value is inside.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import floor, log10

from markupsafe import Markup

from hil_tests.clock import show_span
from hil_tests.reporting.html import svg
from hil_tests.reporting.html.timing import Series

_WIDTH, _HEIGHT = 560, 210
_LEFT, _RIGHT, _TOP, _BOTTOM = 58, 22, 14, 40
_BINS, _POINTS = 60, 500

Scale = Callable[[float], float]


@dataclass(frozen=True, slots=True)
class _Axis:
    """From values to places in the drawing."""

    low: float
    high: float
    start: float
    end: float

    def __call__(self, value: float) -> float:
        share = (value - self.low) / (self.high - self.low)
        return self.start + share * (self.end - self.start)


def _reach(series: Series) -> tuple[float, float]:
    """From the smallest to the largest of values and limits, with room at both sides."""
    ends = [end for end in series.limits if end is not None]
    low = min([low for low, _ in series.values] + ends)
    high = max([high for _, high in series.values] + ends)
    room = max((high - low) * 0.08, 1.0)
    return low - room, high + room


def _across(series: Series) -> _Axis:
    return _Axis(*_reach(series), _LEFT, _WIDTH - _RIGHT)


def _bands(series: Series, axis: _Axis, box: Callable[..., Markup]) -> list[Markup]:
    """What is allowed, the guard bands, and the limits."""
    low, high = series.limits
    inside = (axis.low if low is None else low, axis.high if high is None else high)
    parts = [box(axis(inside[0]), axis(inside[1]), "allowed", "")]
    for limit in (low, high):
        if limit is None:
            continue
        guard = max(series.doubt_ns, 0)
        text = f"limit {show_span(limit)}, doubt {show_span(guard)}"
        parts.append(box(axis(limit - guard), axis(limit + guard), "guard", text))
        parts.append(box(axis(limit) - 0.75, axis(limit) + 0.75, "limit", text))
    return parts


def _columns(start: float, end: float, class_: str, title: str) -> Markup:
    left, right = max(min(start, end), _LEFT), min(max(start, end), _WIDTH - _RIGHT)
    return svg.rect(left, _TOP, right - left, _HEIGHT - _TOP - _BOTTOM, class_, title)


def _rows(start: float, end: float, class_: str, title: str) -> Markup:
    top, bottom = max(min(start, end), _TOP), min(max(start, end), _HEIGHT - _BOTTOM)
    return svg.rect(_LEFT, top, _WIDTH - _LEFT - _RIGHT, bottom - top, class_, title)


def _ticks(low: float, high: float, count: int = 5) -> list[float]:
    """Round values between two others."""
    wish = (high - low) / count
    power = 10 ** floor(log10(wish))
    step = next(each * power for each in (1, 2, 5, 10) if each * power >= wish)
    first = floor(low / step) + 1
    return [number * step for number in range(first, floor(high / step) + 1)]


def _below(axis: _Axis) -> list[Markup]:
    """The axis of spans under a plot."""
    y = _HEIGHT - _BOTTOM
    parts = [svg.line(_LEFT, y, _WIDTH - _RIGHT, y, "axis")]
    for tick in _ticks(axis.low, axis.high):
        x = axis(tick)
        parts.append(svg.line(x, y, x, y + 4, "axis"))
        parts.append(svg.label(x, y + 17, show_span(round(tick)), "tick", "middle"))
    return parts


def histogram(series: Series) -> Markup:
    """How often which period came."""
    axis = _across(series)
    width = (axis.high - axis.low) / _BINS
    middles = [(low + high) / 2 for low, high in series.values]
    counts = Counter(int((value - axis.low) / width) for value in middles)
    most = max(counts.values())
    up = _Axis(0, most, _HEIGHT - _BOTTOM, _TOP + 6)
    parts = _bands(series, axis, _columns)
    for place, count in sorted(counts.items()):
        start = axis.low + place * width
        text = f"{count} of {show_span(round(start))} to {show_span(round(start + width))}"
        left, top = axis(start), min(up(count), _HEIGHT - _BOTTOM - 1.5)
        size = axis(start + width) - left - 1
        parts.append(svg.rect(left, top, size, _HEIGHT - _BOTTOM - top, "bar", text))
    parts += _below(axis)
    parts.append(svg.label(_LEFT - 6, up(most) + 4, str(most), "tick", "end"))
    parts.append(svg.label(_LEFT - 6, _HEIGHT - _BOTTOM + 4, "0", "tick", "end"))
    parts.append(svg.label((_LEFT + _WIDTH - _RIGHT) / 2, _HEIGHT - 4, "period", "name", "middle"))
    title = f"Histogram of the {series.name}: {_numbers(series)}"
    return svg.drawing(_WIDTH, _HEIGHT, title, parts)


def run_chart(series: Series) -> Markup:
    """One period after the other, in the order in which they came."""
    low, high = _reach(series)
    up = _Axis(low, high, _HEIGHT - _BOTTOM, _TOP)
    across = _Axis(0, max(len(series.values) - 1, 1), _LEFT, _WIDTH - _RIGHT)
    parts = _bands(series, up, _rows)
    columns = []
    for first, lowest, highest in _thinned(series.values):
        top, bottom = up(highest), up(lowest)
        height = bottom - top + 2
        columns.append(f"M{across(first) - 1:.1f},{top - 1:.1f}h2v{height:.1f}h-2z")
    parts.append(svg.element("path", d="".join(columns), class_="points"))
    parts.append(svg.line(_LEFT, _HEIGHT - _BOTTOM, _WIDTH - _RIGHT, _HEIGHT - _BOTTOM, "axis"))
    for tick in _ticks(low, high, 4):
        parts.append(svg.label(_LEFT - 4, up(tick) + 4, show_span(round(tick)), "tick", "end"))
    for place, anchor in ((0, "start"), (len(series.values) - 1, "end")):
        x, y = across(place), _HEIGHT - _BOTTOM + 17
        parts.append(svg.label(x, y, f"no. {place + 1}", "tick", anchor))
    parts.append(
        svg.label((_LEFT + _WIDTH) / 2, _HEIGHT - 4, "in order of time", "name", "middle")
    )
    title = f"Run chart of the {series.name}: {_numbers(series)}"
    return svg.drawing(_WIDTH, _HEIGHT, title, parts)


def _thinned(values: Sequence[tuple[int, int]]) -> list[tuple[int, int, int]]:
    """Place, lowest and highest of stretches of the values, few enough to draw."""
    size = -(-len(values) // _POINTS)
    return [
        (
            place,
            min(low for low, _ in values[place : place + size]),
            max(high for _, high in values[place : place + size]),
        )
        for place in range(0, len(values), size)
    ]


def distribution(series: Series) -> Markup:
    """Share of the values up to each span; between the two lines lies the doubt."""
    axis = _across(series)
    up = _Axis(0, 1, _HEIGHT - _BOTTOM, _TOP)
    parts = _bands(series, axis, _columns)
    early = _staircase(sorted(low for low, _ in series.values), axis, up)
    late = _staircase(sorted(high for _, high in series.values), axis, up)
    area = "M" + " L".join([*early, *reversed(late)]) + " Z"
    parts.append(svg.element("path", d=area, class_="doubt"))
    parts.append(svg.element("path", d="M" + " L".join(early), class_="curve"))
    parts.append(svg.element("path", d="M" + " L".join(late), class_="curve"))
    parts += _below(axis)
    for share in (0.0, 0.5, 1.0):
        parts.append(svg.label(_LEFT - 6, up(share) + 4, f"{share:.0%}", "tick", "end"))
    title = f"Distribution of {series.name}: {_numbers(series)}"
    return svg.drawing(_WIDTH, _HEIGHT, title, parts)


def _staircase(values: Sequence[int], axis: _Axis, up: _Axis) -> list[str]:
    """Corners of the empirical distribution."""
    corners = [f"{axis(axis.low):.1f},{up(0):.1f}"]
    count = len(values)
    for place, value in enumerate(values, 1):
        if place < count and values[place] == value:
            continue
        x = axis(value)
        corners += [f"{x:.1f},{corners[-1].partition(',')[2]}", f"{x:.1f},{up(place / count):.1f}"]
    return [*corners, f"{axis(axis.high):.1f},{up(1):.1f}"]


def _numbers(series: Series) -> str:
    """How many, from where to where."""
    low = min(value[0] for value in series.values)
    high = max(value[1] for value in series.values)
    return f"{len(series.values)} values from {show_span(low)} to {show_span(high)}"
