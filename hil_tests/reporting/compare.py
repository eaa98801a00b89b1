"""Runs side by side: where verdicts and margins differ, as table, plain data and plot."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from hil_tests.reporting.plotting import COLOURS, ShareAxis, document, element, legend, titled
from hil_tests.reporting.summary import Stand, Summary, show_share
from hil_tests.reporting.tally import GRAVITY

NOTICEABLE = 0.05
"""Margins closer together than that share of the room are the same for a table."""

_BAD = GRAVITY[: GRAVITY.index("passed")]
_ROW = 22
_WIDTH = 900


def differing(runs: Sequence[Summary], *, everything: bool = False) -> list[str]:
    """The requirements on which runs differ, in order.

    Args:
        runs: at least two.
        everything: those on which they agree, too.
    """
    names = sorted({name for run in runs for name in run.stands})
    return [name for name in names if everything or _differs([r.stands.get(name) for r in runs])]


def _differs(stands: Sequence[Stand | None]) -> bool:
    if len({stand.outcome if stand else "" for stand in stands}) > 1:
        return True
    shares = [stand.share for stand in stands if stand and stand.share is not None]
    return bool(shares) and max(shares) - min(shares) > NOTICEABLE


def table(runs: Sequence[Summary], names: Sequence[str]) -> list[str]:
    """A line for each requirement: its outcome and the room left, run by run."""
    lines = [f"{chr(ord('A') + place)}  {run.label}" for place, run in enumerate(runs)]
    if any(run.state != "complete" for run in runs):
        lines += [f"   {run.name} was interrupted" for run in runs if run.state != "complete"]
    if not names:
        return [*lines, "", "no requirement stands otherwise"]
    head = ["", *(chr(ord("A") + place) for place in range(len(runs)))]
    rows = [[name, *(_cell(run.stands.get(name)) for run in runs)] for name in names]
    widths = [max(len(row[place]) for row in [head, *rows]) for place in range(len(head))]
    return [*lines, "", *("  ".join(_padded(row, widths)).rstrip() for row in [head, *rows])]


def _padded(row: Sequence[str], widths: Sequence[int]) -> list[str]:
    return [f"{cell:{width}}" for cell, width in zip(row, widths, strict=True)]


def _cell(stand: Stand | None) -> str:
    if stand is None:
        return "no test"
    return stand.outcome if stand.share is None else f"{stand.outcome} {show_share(stand)}"


def worse(first: Summary, last: Summary) -> list[str]:
    """The requirements that stand worse in the last run than in the first.

    One that is not judged is neither better nor worse than one that passed.
    """

    def gravity(stand: Stand | None) -> int:
        return _BAD.index(stand.outcome) if stand and stand.outcome in _BAD else len(_BAD)

    return [
        name
        for name in sorted({*first.stands, *last.stands})
        if gravity(last.stands.get(name)) < gravity(first.stands.get(name))
    ]


def to_json(runs: Sequence[Summary], names: Sequence[str]) -> dict[str, Any]:
    """The same as plain data."""
    heads = [{k: v for k, v in asdict(run).items() if k != "stands"} for run in runs]
    stands = {
        name: [asdict(found) if (found := run.stands.get(name)) else None for run in runs]
        for name in names
    }
    return {"runs": heads, "requirements": stands, "worse": worse(runs[0], runs[-1])}


def plot(runs: Sequence[Summary], names: Sequence[str]) -> str:
    """A row for each requirement, a dot for each run: the room that was left."""
    measured = [
        name
        for name in names
        if any((stand := run.stands.get(name)) and stand.share is not None for run in runs)
    ]
    top = 40 + 18 * len(runs)
    height = top + _ROW * len(measured) + 40
    axis = ShareAxis(110.0, float(_WIDTH - 30))
    parts = legend([run.label for run in runs], 20.0, 28.0)
    for x, text, class_ in axis.ticks():
        parts.append(element("line", x1=x, x2=x, y1=top - 10, y2=height - 30, class_=class_))
        parts.append(element("text", text, x=x, y=height - 12, text_anchor="middle", class_="dim"))
    for row, name in enumerate(measured):
        y = top + _ROW * row + 4.0
        parts.append(element("text", name, x=20, y=y + 4))
        for place, run in enumerate(runs):
            stand = run.stands.get(name)
            if stand is not None and stand.share is not None:
                parts.append(_dot(axis.at(stand.share), y, place, name, stand))
    return document(_WIDTH, height, "Room left to the limits, by requirement and run", parts)


def _dot(x: float, y: float, place: int, name: str, stand: Stand) -> str:
    colour = COLOURS[place % len(COLOURS)]
    size = max(7 - 2 * place, 3)  # runs that agree stay visible inside each other
    shape = element("circle", cx=x, cy=y, r=size, fill=colour)
    return titled(shape, f"{name}: {stand.outcome}, {show_share(stand)}; {stand.what}")
