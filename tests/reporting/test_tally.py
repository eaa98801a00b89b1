"""What a test says of each requirement, and how requirements stand after several."""

from __future__ import annotations

from typing import Any

import pytest

from hil_tests.reporting.rows import OUTCOMES, TestResult, VerdictRow
from hil_tests.reporting.tally import GRAVITY, Tally, pairs, worst


def told(outcome: str, claims: str, **verdicts: str) -> dict[str, Any]:
    """A result with one verdict a requirement."""
    rows = [VerdictRow(name, said) for name, said in verdicts.items()]
    return TestResult("t", outcome, requirements=claims.split(), verdicts=rows).to_json()


@pytest.mark.parametrize(
    ("result", "says"),
    [
        (told("passed", "A B", A="passed", C="passed"), "A passed, B passed, C passed"),
        (told("passed", "A", A="characteristic"), "A characteristic"),
        (told("failed", "A B", A="failed", C="passed"), "A failed, C passed"),
        (told("failed", "A B", C="failed"), "C failed"),
        (told("failed", "A B"), "A failed"),
        (told("failed", "A B", A="passed"), "A failed"),
        (told("inconclusive", "A B", B="inconclusive", A="passed"), "A passed, B inconclusive"),
        (told("observation", "A", A="observation"), "A observation"),
        (told("error", "A B", A="passed", C="passed"), "A error, B error, C passed"),
        (told("error", "A", A="failed"), "A failed"),
        (told("not run", "A B"), "A not run, B not run"),
        (told("not applicable", "A"), "A not applicable"),
    ],
)
def test_what_a_test_says_of_each_requirement(result: dict[str, Any], says: str) -> None:
    """Its verdicts first; then what its own outcome means for what it claims."""
    found = pairs(result)
    assert ", ".join(f"{name} {found[name]}" for name in sorted(found)) == says


def test_every_outcome_has_its_gravity() -> None:
    """A failure is worse than everything, and a test that passed says more than none."""
    assert sorted(GRAVITY) == sorted(OUTCOMES)
    assert worst(["not run", "passed", "failed"]) == "failed"
    assert worst(["not run", "passed"]) == "passed"


def test_a_standing_gathers_all_tests_and_the_worst_margin() -> None:
    """Outcome, pairs, checks, numbers of the results, margin with its place."""
    tally = Tally()
    for number, measured in enumerate([(98, 100), (102, 104), (99, 101)], 1):
        row = VerdictRow("HB-01", "passed", f"interval {number}", measured, (95, 105))
        tally.add(number, TestResult("t", "passed", verdicts=[row]).to_json())
    tally.add(4, told("not run", "HB-01"))
    assert tally.to_json()["HB-01"] == {
        "outcome": "passed",
        "pairs": {"passed": 3, "not run": 1},
        "checks": {"passed": 3},
        "tests": [1, 2, 3, 4],
        "margin": {"ns": 1, "doubts": 0.5, "share": 0.2, "test": 2, "what": "interval 2"},
        "narrowest": {"ns": 1, "doubts": 0.5, "share": 0.2, "test": 2, "what": "interval 2"},
        "characteristics": [],
    }


def test_a_characteristic_is_told_once() -> None:
    """However many tests come upon it."""
    tally = Tally()
    row = VerdictRow("KEY-09", "characteristic", "two frames")
    for number in (1, 2):
        tally.add(number, TestResult("t", "passed", verdicts=[row]).to_json())
    assert tally.standings["KEY-09"].to_json()["characteristics"] == ["two frames"]
