"""Plain tables and interleaved medians for the benchmarks."""

from __future__ import annotations

import gc
import statistics
from collections.abc import Callable, Iterable, Mapping, Sequence
from time import process_time

ROUNDS = 5


def timed(work: Callable[[], object]) -> float:
    """Processor time of one call in seconds, of all its threads.

    Nothing that is timed so ever sleeps, so on an idle machine it is the wall time; on a
    shared one the neighbours' turns do not count. Garbage of earlier calls is out of the way.
    """
    gc.collect()
    began = process_time()
    work()
    return process_time() - began


def interleaved(
    measures: Mapping[str, Callable[[], float]], rounds: int = ROUNDS
) -> dict[str, list[float]]:
    """Each measure once a round, so that a drifting machine harms all of them alike."""
    results: dict[str, list[float]] = {name: [] for name in measures}
    for _ in range(rounds):
        for name, measure in measures.items():
            results[name].append(measure())
    return results


def ratio(above: Sequence[float], below: Sequence[float]) -> float:
    """Median of the ratios of the rounds: what was measured together is compared."""
    return statistics.median(a / b for a, b in zip(above, below, strict=True))


def against(value: float, bar: float, least: bool = True) -> str:
    """The bar and whether the figure keeps it: ">= 5 yes"."""
    kept = value >= bar if least else value <= bar
    return f"{'>=' if least else '<='} {bar:g} {'yes' if kept else 'NO'}"


def show(title: str, heads: Sequence[str], rows: Iterable[Sequence[str]]) -> None:
    """A table with its first column to the left and the others to the right."""
    table = [list(heads), *map(list, rows)]
    widths = [max(len(row[column]) for row in table) for column in range(len(heads))]
    print(f"\n{title}")
    for row in table:
        cells = [
            text.rjust(width) if column else text.ljust(width)
            for column, (text, width) in enumerate(zip(row, widths, strict=True))
        ]
        print("  ".join(cells).rstrip())
