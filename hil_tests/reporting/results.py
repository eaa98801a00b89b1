"""`results.json`: every verdict of a run, completed as the run goes.

Laws: after each `add` the file is valid JSON with running totals; adding costs the same
for the first test and the ten-thousandth, because one write lays the new item and the new
end over the old end; a killed run leaves what it had (`finished` is then false). The
fields are described in docs/results.md and in results.schema.json beside this module.
"""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Self

from hil_tests.errors import BenchError

SCHEMA = "nodeproof-results/1"
"""Rises when a reader of the older one would misunderstand the file."""

OUTCOMES = (
    "passed",
    "failed",
    "observation",
    "characteristic",
    "inconclusive",
    "not run",
    "not applicable",
    "error",
)
"""Of a test and of a verdict, in the words of every report."""

_COUNTED = ("seconds", "bus_ns", "frames")
_OPENING = '\n"results":[\n'


@dataclass(frozen=True, slots=True)
class VerdictRow:
    """What one test found out about one requirement.

    Args:
        requirement: its id.
        outcome: one of `OUTCOMES`.
        what: what was judged, e.g. "interval of the heartbeat".
        measured_ns: interval in which the measured value lies; None = not a time.
        limits_ns: at least, at most; None = no limit on that side.
        text: the sentence for people.
    """

    requirement: str
    outcome: str
    what: str = ""
    measured_ns: tuple[int, int] | None = None
    limits_ns: tuple[int | None, int | None] | None = None
    text: str = ""

    def to_json(self) -> dict[str, object]:
        """As plain data."""
        return {
            "requirement": self.requirement,
            "outcome": _known(self.outcome),
            "what": self.what,
            "measured_ns": list(self.measured_ns) if self.measured_ns else None,
            "limits_ns": list(self.limits_ns) if self.limits_ns else None,
            "text": self.text,
        }


@dataclass(frozen=True, slots=True)
class TestResult:
    """What came of one test.

    Args:
        test: its node id.
        outcome: one of `OUTCOMES`; the worst of its verdicts, or an error of the bench.
        seconds: wall-clock time it took.
        bus_ns: time that passed on the bus.
        frames: how many frames it saw.
        requirements: ids it claims.
        verdicts: what it found; also on requirements of monitors, which it does not claim.
        trace: its recording, relative to the folder of the run.
        reproduce: a command line that repeats it.
        text: why, where the verdicts do not say: reason of a skip, error of the bench.
    """

    __test__ = False  # pytest would take it for a test class

    test: str
    outcome: str
    seconds: float = 0.0
    bus_ns: int = 0
    frames: int = 0
    requirements: Sequence[str] = ()
    verdicts: Sequence[VerdictRow] = ()
    trace: str | None = None
    reproduce: str | None = None
    text: str = ""

    def to_json(self) -> dict[str, object]:
        """As plain data."""
        return {
            "test": self.test,
            "outcome": _known(self.outcome),
            "seconds": round(self.seconds, 6),
            "bus_ns": self.bus_ns,
            "frames": self.frames,
            "requirements": list(self.requirements),
            "verdicts": [row.to_json() for row in self.verdicts],
            "trace": self.trace,
            "reproduce": self.reproduce,
            "text": self.text,
        }


@dataclass(frozen=True, slots=True)
class Totals:
    """Sums over the results so far."""

    tests: int = 0
    outcomes: Mapping[str, int] = field(default_factory=lambda: dict.fromkeys(OUTCOMES, 0))
    verdicts: Mapping[str, int] = field(default_factory=lambda: dict.fromkeys(OUTCOMES, 0))
    sums: Mapping[str, float] = field(default_factory=lambda: dict.fromkeys(_COUNTED, 0))

    def plus(self, result: Mapping[str, Any]) -> Totals:
        """The sums with one result more.

        Raises:
            KeyError, TypeError, ValueError: no result, or an outcome that no report knows.
        """
        outcomes, verdicts = dict(self.outcomes), dict(self.verdicts)
        outcomes[_known(str(result["outcome"]))] += 1
        for row in result.get("verdicts", ()):
            verdicts[_known(str(row["outcome"]))] += 1
        sums = {key: self.sums[key] + (result.get(key) or 0) for key in _COUNTED}
        return Totals(self.tests + 1, outcomes, verdicts, sums)

    def to_json(self) -> dict[str, object]:
        """As plain data."""
        sums = {**self.sums, "seconds": round(self.sums["seconds"], 6)}
        return {"tests": self.tests, **self.outcomes, "verdicts": dict(self.verdicts), **sums}


def _known(outcome: str) -> str:
    if outcome not in OUTCOMES:
        raise ValueError(f"outcome {outcome!r} is none of {', '.join(OUTCOMES)}")
    return outcome


def _dumps(value: object) -> str:
    return json.dumps(value, separators=(",", ":"), allow_nan=False)


class ResultsFile:
    """Writes `results.json`.

    Args:
        path: the file; it must not exist yet.
        header: facts of the run, plain data; see docs/results.md.

    Raises:
        BenchError: it exists, or cannot be written.
    """

    def __init__(self, path: Path, header: Mapping[str, object]) -> None:
        self.path = path
        self.totals = Totals()
        head = f'{{"schema":{_dumps(SCHEMA)},\n"run":{_dumps(dict(header))},{_OPENING}'.encode()
        try:
            self._descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_EXCL, 0o666)
        except OSError as error:
            raise self._lost(error) from error
        self._end = len(head)
        """Where the next item begins; what stands behind is the end of the document."""
        self._size = 0
        self._write(head + self._tail(self.totals, None), 0)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def add(self, result: Mapping[str, Any]) -> None:
        """Store the result of one test, e.g. `TestResult(...).to_json()`; numbers it.

        Raises:
            BenchError: the disk is full, or gone.
            KeyError, TypeError, ValueError: no `test` or `outcome`, an unknown outcome, or
                something that JSON has no word for; the file is as it was.
        """
        totals = self.totals.plus(result)
        comma = ",\n" if self.totals.tests else ""
        row = {"test": result["test"], **result, "number": totals.tests}
        item = f"{comma}{_dumps(row)}".encode()
        self._write(item + self._tail(totals, None), self._end)
        self._end += len(item)
        self.totals = totals

    def finish(self, summary: Mapping[str, object]) -> None:
        """Say that the run came to its end, with its exit status and last words; close."""
        self._write(self._tail(self.totals, summary), self._end)
        self.close()

    def close(self) -> None:
        """Let go of the file; a second call does nothing."""
        if self._descriptor >= 0:
            os.close(self._descriptor)
            self._descriptor = -1

    def _tail(self, totals: Totals, summary: Mapping[str, object] | None) -> bytes:
        done = summary is not None
        return (
            f'\n],\n"totals":{_dumps(totals.to_json())},'
            f'\n"finished":{_dumps(done)},\n"summary":{_dumps(dict(summary or {}))}}}\n'
        ).encode()

    def _write(self, content: bytes, place: int) -> None:
        """One write from `place` over the old end; blanks where the old one reached further."""
        content += b" " * (self._size - place - len(content))
        self._size = place + len(content)
        try:
            while content:
                written = os.pwrite(self._descriptor, content, place)
                content, place = content[written:], place + written
        except OSError as error:
            raise self._lost(error) from error

    def _lost(self, error: OSError) -> BenchError:
        return BenchError(
            f"results {self.path}: {error.strerror or error}; make room there or choose another "
            "place with --can-reports DIR"
        )
