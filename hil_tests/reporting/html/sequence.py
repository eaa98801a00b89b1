"""The message sequence chart of a window of a test: bench, tester and nodes, as static SVG."""

from __future__ import annotations

from collections.abc import Sequence

from markupsafe import Markup

from hil_tests.reporting.html import svg
from hil_tests.reporting.html.narrative import (
    CHECK,
    EVENT,
    NOTE,
    SEEN,
    SENT,
    STIMULUS,
    Line,
    show_at,
    with_finding,
)

_WIDTH, _ROW, _TOP = 900, 26, 46
_BENCH, _TESTER, _DEVICE = 190, 420, 790
_TIME_X = 84
_LONG_NS = 50_000_000
"""A pause that gets a break in the lines."""
_LONGEST_TEXT = 52

_LANES = ((_BENCH, "bench"), (_TESTER, "tester"), (_DEVICE, "device"))


def chart(lines: Sequence[Line], origin_at: int, finding: Line | None) -> Markup:
    """The chart.

    Args:
        lines: stimuli, frames and bus events in order.
        origin_at: the instant that is shown as 0.
        finding: the check that is argued about, drawn across at its instant.
    """
    rows = with_finding(lines, finding)
    height = _TOP + _ROW * len(rows) + 16
    parts = [_lane(x, name, height) for x, name in _LANES]
    before: int | None = None
    for number, line in enumerate(rows):
        y = _TOP + _ROW * number + 14
        parts += _row(line, y, origin_at, before)
        before = line.at if line.at is not None else before
    return svg.drawing(_WIDTH, height, "Message sequence chart", parts, "chart")


def _lane(x: int, name: str, height: int) -> Markup:
    return Markup("").join(
        (
            svg.rect(x - 46, 6, 92, 24, "lane-head"),
            svg.label(x, 22, name, "lane-name", "middle"),
            svg.line(x, 30, x, height - 6, "lane-line"),
        )
    )


def _row(line: Line, y: int, origin_at: int, before: int | None) -> list[Markup]:
    parts = [svg.label(_TIME_X, y + 4, show_at(line.at, origin_at), "time", "end")]
    if before is not None and line.at is not None and line.at - before > _LONG_NS:
        parts += [
            svg.line(x - 5, y - 15 + up, x + 5, y - 18 + up, "pause")
            for x, _ in _LANES
            for up in (0, 4)
        ]
    return parts + _DRAWN[line.what](line, y)


def _message(line: Line, y: int) -> list[Markup]:
    own = line.what == SENT
    start, end = (_TESTER, _DEVICE) if own else (_DEVICE, _TESTER)
    return _arrow(start, end, y, "sent" if own else "seen", f"{line.raw}  {line.text}")


def _arrow(start: int, end: int, y: int, class_: str, text: str) -> list[Markup]:
    way = 1 if end > start else -1
    tip = f"M{end},{y} l{-9 * way},-4 l0,8 z"
    return [
        svg.line(start, y, end - 4 * way, y, f"arrow {class_}"),
        svg.element("path", d=tip, class_=f"tip {class_}"),
        svg.label((start + end) / 2, y - 4, _cut(text), f"message {class_}", "middle"),
    ]


def _stimulus(line: Line, y: int) -> list[Markup]:
    text = _cut(line.text, 70)
    return [
        svg.element("circle", cx=_BENCH, cy=y, r=4, class_="tip stimulus"),
        svg.line(_BENCH, y, _DEVICE - 4, y, "arrow stimulus"),
        svg.element("path", d=f"M{_DEVICE},{y} l-9,-4 l0,8 z", class_="tip stimulus"),
        svg.label(_BENCH + 12, y - 4, text, "message stimulus"),
    ]


def _note(line: Line, y: int) -> list[Markup]:
    return [
        svg.element("circle", cx=_BENCH, cy=y, r=3, class_="tip note"),
        svg.label(_BENCH + 12, y + 4, _cut(line.text, 110), "message note"),
    ]


def _event(line: Line, y: int) -> list[Markup]:
    return [
        svg.rect(_TESTER, y - 11, _DEVICE - _TESTER, 18, "event"),
        svg.label((_TESTER + _DEVICE) / 2, y + 2, _cut(line.text), "message event", "middle"),
    ]


def _check(line: Line, y: int) -> list[Markup]:
    text = _cut(f"{line.outcome}: {line.text}", 118)
    return [
        svg.rect(
            _TIME_X + 14, y - 12, _WIDTH - _TIME_X - 22, 22, f"finding {_slug(line.outcome)}"
        ),
        svg.label(_TIME_X + 24, y + 3, text, f"finding-text {_slug(line.outcome)}"),
    ]


def _slug(outcome: str) -> str:
    return outcome.replace(" ", "-")


def _cut(text: str, most: int = _LONGEST_TEXT) -> str:
    return text if len(text) <= most else f"{text[: most - 1]}…"


_DRAWN = {
    SENT: _message,
    SEEN: _message,
    STIMULUS: _stimulus,
    NOTE: _note,
    EVENT: _event,
    CHECK: _check,
}
