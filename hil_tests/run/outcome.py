"""From what a test raised to the outcome that is reported, in the words of every report."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace

import pytest

from hil_tests.errors import BenchError, OperatorAbsent
from hil_tests.judge.verdict import (
    DeviceFailure,
    InconclusiveResult,
    NotApplicable,
    NotRun,
    Outcome,
    Verdict,
)
from hil_tests.requirements import LENIENT, Requirement

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

    An assertion of the test's own is a failure of the device as well; every other error is
    one of the bench or of the test.

    Args:
        error: what the body, or a monitor after it, raised.
        kinds: the catalogue; a derived requirement gives an observation.
        strict: observations count as failures.
    """
    if error is None:
        return PASSED
    if isinstance(error, DeviceFailure):
        known = kinds.get(error.verdict.requirement)
        lenient = known is not None and known.kind in LENIENT
        return OBSERVATION if lenient and not strict else FAILED
    for kind, found in _PLAIN:
        if isinstance(error, kind):
            return found
    return ERROR


_PLAIN: tuple[tuple[type[BaseException], str], ...] = (
    (InconclusiveResult, INCONCLUSIVE),
    (NotRun, NOT_RUN),
    (OperatorAbsent, NOT_RUN),
    (pytest.skip.Exception, NOT_RUN),
    (NotApplicable, NOT_APPLICABLE),
    (AssertionError, FAILED),
    (pytest.fail.Exception, FAILED),
)
"""Kind of error -> outcome, where the catalogue need not be asked."""


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


def prevails(
    body: BaseException | None, monitors: Exception | None, came_of_body: str
) -> BaseException | None:
    """Which of the two the test ends with: a FAIL before everything but a broken bench.

    Args:
        body: what the test raised.
        monitors: what they found, see `gravest_error`.
        came_of_body: the outcome of the body alone, see `classify`.
    """
    if body is None:
        return monitors
    if isinstance(monitors, DeviceFailure) and came_of_body not in {FAILED, ERROR}:
        return monitors
    return body


def ends_with(
    body: BaseException | None,
    found: Sequence[Verdict],
    claimed: str,
    kinds: Mapping[str, Requirement],
    strict: bool,
) -> BaseException | None:
    """What a test ends with, its body and the monitors taken together; None = all is well.

    Args:
        body: what the test raised.
        found: what monitors found in it.
        claimed: the requirement that a failure is held against where it names none.
        kinds: the catalogue.
        strict: observations count as failures.
    """
    body = claim(body, claimed)
    came_of_body = classify(body, kinds, strict)
    return claim(prevails(body, gravest_error(found), came_of_body), claimed)


def exit_status(outcomes: Collection[str], own: int, *, require_all: bool, broken: bool) -> int:
    """Exit status of a run; see the table in the design.

    Args:
        outcomes: of the tests.
        own: what pytest would say.
        require_all: not run and not applicable count as failures.
        broken: the bench could not be opened, or not be left as it was found.
    """
    missing = {NOT_RUN, NOT_APPLICABLE} & set(outcomes)
    # A failure that none of our tests accounts for is one of somebody else's test.
    foreign = own == 1 and ERROR not in outcomes
    if FAILED in outcomes or (require_all and missing) or foreign:
        return 1
    if ERROR in outcomes or broken:
        return 11
    if own not in {0, 1, 5}:
        return own
    if INCONCLUSIVE in outcomes:
        return 10
    judged = {PASSED, OBSERVATION} & set(outcomes)
    return own if judged else 12


def is_bench_error(error: BaseException | None) -> bool:
    """Whether the bench, not the device or the test, is to blame."""
    return isinstance(error, BenchError) and not isinstance(error, OperatorAbsent)
