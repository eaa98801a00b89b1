"""From what a run knows of a test to its row in results.json."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from hil_tests.reporting.rows import TestResult, TraceFile, VerdictRow
from hil_tests.requirements import LENIENT, Requirement
from hil_tests.run import outcome
from hil_tests.run.header import sha256_of

if TYPE_CHECKING:
    from hil_tests.bench.bench import Bench
    from hil_tests.clock import Interval
    from hil_tests.judge.verdict import Verdict

_INTERMISSION = 3
"""Bits between two frames, CiA 301's physical layer: ISO 11898-1."""


@dataclass(frozen=True, slots=True)
class Ending:
    """What came of a test.

    Args:
        test: its node id.
        outcome: in the words of every report.
        seconds: wall-clock time it took.
        claimed: the requirements that it claims.
        text: why, for people.
        title: the fact that it states.
    """

    test: str
    outcome: str
    seconds: float
    claimed: Sequence[str]
    text: str
    title: str = ""


@dataclass(frozen=True, slots=True)
class Reading:
    """Counters of a bench at an instant; the difference of two is what a test saw."""

    frames: int = 0
    bus_ns: int = 0
    error_frames: int = 0
    losses: int = 0
    lost: int = 0


def reading(bench: Bench | None) -> Reading:
    """The counters as they are now; all 0 where there is no bench."""
    if bench is None:
        return Reading()
    census = bench.census
    return Reading(bench.frames, bench.bus_ns, census.error_frames, census.losses, census.lost)


def busy_ns(bench: Bench) -> int | None:
    """How long frames took the wire in the trace of the test; None = it has no bit times."""
    if not bench.stage.port.timed:
        return None
    return sum(
        (bench.trace.bits(start, stop) + _INTERMISSION * (stop - start)) * bit_ns
        for start, stop, bit_ns in bench.rates.stretches(len(bench.trace))
    )


def trace_file(path: Path, name: str, frames: int) -> TraceFile:
    """A recording that is closed.

    Args:
        path: where it is.
        name: relative to the folder of the run.
        frames: that it holds.
    """
    return TraceFile(name, sha256_of(path) or "", frames)


def verdict_rows(
    verdicts: Sequence[Verdict], ending: Ending, kinds: Mapping[str, Requirement], *, strict: bool
) -> list[VerdictRow]:
    """What a test found, in the words of the reports.

    Args:
        verdicts: of its checks and of the monitors.
        ending: of the test.
        kinds: the catalogue: who is outside a derived requirement is observed, not failed.
        strict: observations count as failures.
    """
    first = next(iter(ending.claimed), "")
    rows = []
    for each in verdicts:
        name = each.requirement or first
        known = kinds.get(name)
        lenient = known is not None and known.kind in LENIENT and not strict
        lenient = lenient or ending.outcome == outcome.OBSERVATION
        found = each.outcome.value
        if found == outcome.FAILED and lenient:
            found = outcome.OBSERVATION
        rows.append(_row(each, name, found))
    return rows


def _row(verdict: Verdict, requirement: str, found: str) -> VerdictRow:
    return VerdictRow(
        requirement=requirement,
        outcome=found,
        what=verdict.text,
        measured_ns=_pair(verdict.measured),
        limits_ns=verdict.limits.ends if verdict.limits else None,
        text=str(verdict),
        at=verdict.at,
        cause_at=_pair(verdict.cause),
        effect_at=_pair(verdict.effect),
    )


def _pair(interval: Interval | None) -> tuple[int, int] | None:
    return (interval.earliest, interval.latest) if interval else None


def result_of(
    ending: Ending,
    rows: Sequence[VerdictRow],
    seen: tuple[Reading, Reading],
    *,
    busy: int | None,
    trace: TraceFile | None,
    reproduce: str,
) -> TestResult:
    """The row of a test.

    Args:
        ending: what came of it.
        rows: what it found.
        seen: counters of the bench before it and after it.
        busy: see `busy_ns`; None = no record was kept.
        trace: its recording.
        reproduce: a command line that repeats it.
    """
    before, after = seen
    return TestResult(
        test=ending.test,
        outcome=ending.outcome,
        title=ending.title,
        seconds=ending.seconds,
        bus_ns=after.bus_ns - before.bus_ns,
        frames=after.frames - before.frames,
        error_frames=after.error_frames - before.error_frames,
        losses=after.losses - before.losses,
        lost=after.lost - before.lost,
        busy_ns=busy,
        requirements=tuple(ending.claimed),
        verdicts=rows,
        trace=trace,
        reproduce=reproduce,
        text=ending.text,
    )
