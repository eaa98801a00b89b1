"""A run, read and weighed: what the report and the certificate are made of."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hil_tests.reporting.html.artefacts import Artefact, artefacts_of
from hil_tests.reporting.html.coverage import Covered, cover, proofs_of
from hil_tests.reporting.html.embed import embed
from hil_tests.reporting.html.facts import fact, table_of
from hil_tests.reporting.html.view import TestView, views_of
from hil_tests.reporting.results_reader import RESULTS, Results, load_results

REPORT = "report.html"
CERTIFICATE = "certificate.pdf"
_MATRIX = "matrix.json"
_PROVED_BY = {"generic": "drive"}
"""A device of any EDS is judged by tests that faulty drives have proved."""


@dataclass(frozen=True, slots=True)
class Subject:
    """A run, read and weighed; what every page is made of.

    Args:
        folder: of the run.
        results: its `results.json`.
        tests: one view a test.
        covered: one entry a requirement.
        matrix: its `matrix.json`; empty = none.
        files: its files with their hashes.
        notes: what could not be read.
    """

    folder: Path
    results: Results
    tests: list[TestView]
    covered: list[Covered]
    matrix: Mapping[str, Any]
    files: list[Artefact]
    notes: list[str]


def read_run(folder: Path, aimed: Mapping[str, Iterable[str]]) -> Subject:
    """Everything that a report of a run is made from.

    Args:
        folder: of the run; `results.json` is needed, all else is optional.
        aimed: requirement -> names of the faulty models that violate it.

    Raises:
        RecordUnreadable: no readable `results.json`.
    """
    results = load_results(folder / RESULTS)
    kind = fact(results.run, "device", "profile", "kind")
    tests = views_of(folder, results, str(kind or "keypad"))
    embed(tests)
    matrix, notes = _matrix(folder)
    matrix = _of_kind(matrix, str(kind))
    covered = cover(results, proofs_of(aimed, matrix))
    files = artefacts_of(folder, without={REPORT, CERTIFICATE})
    return Subject(folder, results, tests, covered, matrix, files, notes)


def _of_kind(matrix: Mapping[str, Any], kind: str) -> Mapping[str, Any]:
    """The models of one kind of device; of a table that does not say, all."""
    chosen = dict(matrix)
    for table in ("mutants", "variants"):
        models = table_of(matrix, table)
        if table in matrix:
            chosen[table] = {
                name: model
                for name, model in models.items()
                if (fact(model, "kind") or kind) in {kind, _PROVED_BY.get(kind)}
            }
    return chosen


def _matrix(folder: Path) -> tuple[Mapping[str, Any], list[str]]:
    """The table of faulty models, if it is there and what it should be."""
    path = folder / _MATRIX
    if not path.is_file():
        return {}, []
    try:
        found = json.loads(path.read_text("utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        return {}, [f"{_MATRIX} cannot be read: {error}"]
    if not isinstance(fact(found, "mutants"), dict):
        return {}, [f"{_MATRIX} is no table of faulty models"]
    return found, []
