"""`results.json`: every verdict of a run, completed as the run goes.

Laws: the file is valid JSON with running totals at every instant, whatever kills its writer;
adding costs the same for the first test and the ten-thousandth; until the run has come to its
end the file says "interrupted", so a killed run says so without having to. The fields are
described in docs/results.md and in results.schema.json beside this module.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Self

from hil_tests.errors import BenchError
from hil_tests.reporting.growing import GrowingFile
from hil_tests.reporting.rows import OUTCOMES, TestResult, TraceFile, VerdictRow
from hil_tests.reporting.tally import Tally, Totals

__all__ = ["OUTCOMES", "SCHEMA", "ResultsFile", "TestResult", "TraceFile", "VerdictRow"]

SCHEMA = "nodeproof-results/1"
"""Rises when a reader of the older one would misunderstand the file."""

INTERRUPTED = "interrupted"
COMPLETE = "complete"

_OPENING = '\n"results":[\n'


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
        self.tally = Tally()
        self._rows: dict[str, str] = {}
        """The standing of each requirement as JSON: most do not change from test to test."""
        self._under_way: Mapping[str, object] | None = None
        head = f'{{"schema":{_dumps(SCHEMA)},\n"run":{_dumps(dict(header))},{_OPENING}'.encode()
        try:
            self._file = GrowingFile(path, head, self._tail(None))
        except OSError as error:
            raise self._lost(error) from error

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def begin(self, test: str, trace: str | None) -> None:
        """Say which test is under way, and where its recording grows.

        Raises:
            BenchError: the disk is full, or gone.
        """
        self._under_way = {"test": test, "trace": trace}
        self._append(b"", None)

    def add(self, result: Mapping[str, Any]) -> None:
        """Store the result of one test, e.g. `TestResult(...).to_json()`; numbers it.

        Raises:
            BenchError: the disk is full, or gone; the result comes with the next one.
            KeyError, TypeError, ValueError: no `test` or `outcome`, an unknown outcome, or
                something that JSON has no word for; the file is as it was.
        """
        totals = self.totals.plus(result)
        comma = ",\n" if self.totals.tests else ""
        row = {"test": result["test"], **result, "number": totals.tests}
        item = f"{comma}{_dumps(row)}".encode()
        changed = self.tally.add(totals.tests, result)
        self.totals = totals
        self._under_way = None
        for name in changed:
            self._rows[name] = f"{_dumps(name)}:{_dumps(self.tally.standings[name].to_json())}"
        self._append(item, None)

    def finish(self, summary: Mapping[str, object], state: str = COMPLETE) -> None:
        """Say that the run came to its end, with its exit status and last words; close.

        Args:
            summary: plain data; see docs/results.md.
            state: `COMPLETE`, or `INTERRUPTED` where the run was told to stop.

        Raises:
            BenchError: the disk is full, or gone.
        """
        self._under_way = None
        self._append(b"", (summary, state))
        self.close()

    def close(self) -> None:
        """Let go of the file; a second call does nothing."""
        self._file.close()

    def _tail(self, end: tuple[Mapping[str, object], str] | None) -> bytes:
        summary, state = end if end is not None else ({}, INTERRUPTED)
        fields = {
            "requirements": "{" + ",\n".join(self._rows.values()) + "}",
            "totals": _dumps(self.totals.to_json()),
            "under_way": _dumps(self._under_way),
            "finished": _dumps(end is not None),
            "state": _dumps(state),
            "summary": _dumps(dict(summary)),
        }
        lines = ",\n".join(f'"{name}":{text}' for name, text in fields.items())
        return f"\n],\n{lines}}}\n".encode()

    def _append(self, item: bytes, end: tuple[Mapping[str, object], str] | None) -> None:
        try:
            self._file.append(item, self._tail(end))
        except OSError as error:
            raise self._lost(error) from error

    def _lost(self, error: OSError) -> BenchError:
        return BenchError(
            f"results {self.path}: {error.strerror or error}; make room there or choose another "
            "place with --can-reports DIR"
        )
