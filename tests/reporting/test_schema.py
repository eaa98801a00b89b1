"""Our few words of JSON Schema, beside a validator that knows them all."""

from __future__ import annotations

import importlib
from typing import Any

import pytest

from hil_tests.reporting.rows import OUTCOMES
from hil_tests.reporting.schema import breaches, results_schema

BAD = [
    {},
    {"schema": "other", "run": [], "results": [{"test": 1, "outcome": "green"}], "x": 1},
    {"results": [{"test": "a", "outcome": "passed", "frames": -1, "number": 0}]},
    {"results": [{"test": "a", "outcome": "passed", "frames": True}]},
    {"results": [{"test": "a", "outcome": "passed", "verdicts": [{"measured_ns": [1]}]}]},
    {"totals": {"verdicts": {"green": 1}}, "finished": 1, "summary": None},
    {"requirements": {"A-01": {"outcome": "passed", "margin": {"ns": 1.5}}}},
]


def test_the_schema_notices_what_is_wrong() -> None:
    """Each breach is told with its place, its value and what is allowed."""
    found = list(breaches(BAD[1], results_schema()))
    assert found == [
        "requirements is missing",
        "totals is missing",
        "under_way is missing",
        "finished is missing",
        "state is missing",
        "summary is missing",
        "schema: 'other' is not 'nodeproof-results/1'",
        "run: [] is no object",
        "results[0].test: 1 is no string",
        f"results[0].outcome: 'green' is none of {', '.join(OUTCOMES)}",
        "x is unknown",
    ]


@pytest.mark.parametrize("document", BAD)
def test_a_validator_of_others_agrees(document: dict[str, Any]) -> None:
    """What jsonschema refuses is refused here, as often."""
    validator = importlib.import_module("jsonschema").Draft202012Validator(results_schema())
    theirs = [error.message for error in validator.iter_errors(document)]
    assert len(list(breaches(document, results_schema()))) == len(theirs)


def test_the_schema_is_one() -> None:
    """By the rules of JSON Schema itself."""
    importlib.import_module("jsonschema").Draft202012Validator.check_schema(results_schema())


def test_a_word_that_is_not_known_is_an_error_of_the_schema() -> None:
    """It is never passed over."""
    with pytest.raises(ValueError, match="unknown words in the schema: pattern"):
        list(breaches("a", {"pattern": "b"}))
