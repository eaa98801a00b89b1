"""From what a test raised to the outcome that is reported, in the words of every report."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from hil_tests.errors import BenchError
from hil_tests.judge.verdict import (
    DeviceFailure,
    InconclusiveResult,
    NotApplicable,
    NotRun,
    Outcome,
    Verdict,
)
from hil_tests.requirements import Kind, Requirement

ERROR = "error"
PASSED = "passed"
FAILED = "failed"
OBSERVATION = "observation"
INCONCLUSIVE = "inconclusive"
NOT_RUN = "not run"
NOT_APPLICABLE = "not applicable"

REPORTED = {
    PASSED: ("passed", ".", "PASSED"),
    FAILED: ("failed", "F", "FAILED"),
    OBSERVATION: ("observed", "o", "OBSERVATION"),
    INCONCLUSIVE: ("inconclusive", "?", "INCONCLUSIVE"),
    NOT_RUN: ("not run", "-", "NOT RUN"),
    NOT_APPLICABLE: ("not applicable", "n", "NOT APPLICABLE"),
    ERROR: ("error", "E", "ERROR"),
}
"""Outcome -> category, letter and word of pytest's terminal."""


def classify(error: BaseException | None, kinds: Mapping[str, Requirement], strict: bool) -> str:
    """The outcome of a test that raised `error`, None = nothing.

    Args:
        error: what the body, or a monitor after it, raised.
        kinds: the catalogue; a derived requirement gives an observation.
        strict: observations count as failures.
    """
    if error is None:
        return PASSED
    if isinstance(error, DeviceFailure):
        known = kinds.get(error.verdict.requirement)
        lenient = known is not None and known.kind in {Kind.DERIVED, Kind.CHOICE}
        return OBSERVATION if lenient and not strict else FAILED
    if isinstance(error, InconclusiveResult):
        return INCONCLUSIVE
    if isinstance(error, NotRun):
        return NOT_RUN
    if isinstance(error, NotApplicable):
        return NOT_APPLICABLE
    return ERROR


def claim(error: BaseException | None, claimed: str) -> BaseException | None:
    """The same error, its verdict on the test's own requirement where it named none."""
    if isinstance(error, DeviceFailure | InconclusiveResult) and not error.verdict.requirement:
        error.verdict = replace(error.verdict, requirement=claimed)
    return error


def gravest_error(found: Sequence[Verdict]) -> Exception | None:
    """What monitors found, as the error that the test should end with."""
    for kind, error in ((Outcome.FAIL, DeviceFailure), (Outcome.INCONCLUSIVE, InconclusiveResult)):
        for verdict in found:
            if verdict.outcome is kind:
                return error(verdict)
    return None


def prevails(body: BaseException | None, monitors: Exception | None) -> BaseException | None:
    """Which of the two the test ends with: a FAIL before everything but a broken bench."""
    if body is None:
        return monitors
    if isinstance(monitors, DeviceFailure) and isinstance(
        body, InconclusiveResult | NotRun | NotApplicable
    ):
        return monitors
    return body


def exit_status(outcomes: Sequence[str], own: int, *, require_all: bool) -> int:
    """Exit status of a run; see the table in the design.

    Args:
        outcomes: one a test.
        own: what pytest would say.
        require_all: not run and not applicable count as failures.
    """
    missing = {NOT_RUN, NOT_APPLICABLE} & set(outcomes)
    if FAILED in outcomes or (require_all and missing):
        return 1
    if ERROR in outcomes:
        return 11
    if own not in {0, 1, 5}:
        return own
    if INCONCLUSIVE in outcomes:
        return 10
    judged = {PASSED, OBSERVATION} & set(outcomes)
    return own if judged else 12


def is_bench_error(error: BaseException | None) -> bool:
    """Whether the bench, not the device or the test, is to blame."""
    return isinstance(error, BenchError)
