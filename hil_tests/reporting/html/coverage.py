"""What a run says of each requirement: worst verdict, worst margin, tests, faulty models."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from hil_tests.reporting.html.margins import Margin, margin_of
from hil_tests.reporting.results import TestResult, VerdictRow
from hil_tests.requirements import Requirement

UNTESTED = "untested"
GRAVITY = (
    "failed",
    "error",
    "inconclusive",
    "observation",
    "passed",
    "characteristic",
    "not run",
    "not applicable",
    UNTESTED,
)
"""Outcomes, the gravest first."""


@dataclass(frozen=True, slots=True)
class Proof:
    """Faulty models that are aimed at a requirement.

    Args:
        aimed: names of those that violate it.
        killed: names of those among them that some test found; None = never tried here.
    """

    aimed: tuple[str, ...] = ()
    killed: tuple[str, ...] | None = None


@dataclass(slots=True)
class Covered:
    """One requirement and what was found of it.

    Args:
        id: of the requirement.
        requirement: its entry in the catalogue; None = the catalogue does not know it.
        tests: numbers of the tests that claim it or judged it, by outcome of the test.
        outcomes: how often each outcome was found.
        worst: the measurement that came nearest to its limit, or went farthest beyond.
        worst_test: number of its test.
        proof: the faulty models.
    """

    id: str
    requirement: Requirement | None
    tests: list[int] = field(default_factory=list)
    outcomes: dict[str, int] = field(default_factory=dict)
    worst: Margin | None = None
    worst_row: VerdictRow | None = None
    worst_test: int = 0
    notes: list[str] = field(default_factory=list)
    proof: Proof = field(default_factory=Proof)

    @property
    def outcome(self) -> str:
        """The gravest outcome; "untested" where there is none."""
        return next((each for each in GRAVITY if self.outcomes.get(each)), UNTESTED)

    def count(self, outcome: str) -> None:
        """One more of an outcome."""
        self.outcomes[outcome] = self.outcomes.get(outcome, 0) + 1

    def measure(self, row: VerdictRow, test: int) -> None:
        """Keep the margin of a verdict if it is the worst; in time, where doubts are alike."""
        margin = margin_of(row)
        if margin is not None and (self.worst is None or _rank(margin) < _rank(self.worst)):
            self.worst, self.worst_row, self.worst_test = margin, row, test


def _rank(margin: Margin) -> tuple[float, int]:
    """Order of margins: in units of doubt; an exact one by its sign alone, then by its span."""
    if margin.units is None:
        return (float("-inf") if margin.span_ns < 0 else float("inf"), margin.span_ns)
    return (margin.units, margin.span_ns)


def cover(
    results: Sequence[TestResult],
    catalogue: Mapping[str, Requirement],
    proofs: Mapping[str, Proof],
) -> list[Covered]:
    """Every requirement of the catalogue, and those that only the results name.

    In the order of the catalogue; what was not tested comes last.
    """
    table = {name: Covered(name, each) for name, each in catalogue.items()}
    for number, result in enumerate(results, 1):
        _take_in(number, result, table)
    for name, covered in table.items():
        covered.proof = proofs.get(name, Proof())
    return sorted(table.values(), key=lambda covered: covered.outcome == UNTESTED)


def _take_in(number: int, result: TestResult, table: dict[str, Covered]) -> None:
    judged: set[str] = set()
    for row in result.verdicts:
        covered = _entry(row.requirement, table)
        judged.add(row.requirement)
        covered.count(row.outcome)
        covered.measure(row, number)
        if row.outcome == "characteristic" and row.what not in covered.notes:
            covered.notes.append(row.what)
    for name in result.requirements:
        if name not in judged:
            _entry(name, table).count(_of_a_claim(result.outcome))
    for name in dict.fromkeys((*result.requirements, *judged)):
        _entry(name, table).tests.append(number)


def _entry(name: str, table: dict[str, Covered]) -> Covered:
    if name not in table:
        table[name] = Covered(name, None)
    return table[name]


def _of_a_claim(outcome: str) -> str:
    """What a test without a verdict on a requirement that it claims says of it."""
    return (
        "passed"
        if outcome in {"passed", "observation", "characteristic"}
        else ("not run" if outcome == "failed" else outcome)
    )


def proofs_of(aimed: Mapping[str, Iterable[str]], matrix: Mapping[str, Any]) -> dict[str, Proof]:
    """The faulty models of each requirement.

    Args:
        aimed: requirement -> names of the models that violate it.
        matrix: `matrix.json`, or an empty mapping.
    """
    mutants = matrix.get("mutants", {})
    table: dict[str, list[str]] = {name: list(each) for name, each in aimed.items()}
    for name, mutant in mutants.items():
        for requirement in mutant.get("violates", ()):
            known = table.setdefault(str(requirement), [])
            if name not in known:
                known.append(str(name))
    killed = {str(name) for name, mutant in mutants.items() if mutant.get("killed_by")}
    return {
        name: Proof(tuple(models), tuple(m for m in models if m in killed) if mutants else None)
        for name, models in table.items()
    }
