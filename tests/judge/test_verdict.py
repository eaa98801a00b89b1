"""Verdicts: guard bands from both sides, and the words in which they are told."""

from __future__ import annotations

import pytest

from hil_tests.clock import FOREVER, MS, US, Interval
from hil_tests.judge.verdict import (
    DeviceFailure,
    InconclusiveResult,
    Limits,
    NotApplicable,
    NotRun,
    Outcome,
    Verdict,
    gravest,
)

BAND = Limits(99 * MS, 101 * MS)
LOW, HIGH = 99 * MS, 101 * MS


@pytest.mark.parametrize(
    ("earliest", "latest", "outcome"),
    [
        (LOW, HIGH, Outcome.PASS),
        (LOW, LOW, Outcome.PASS),
        (HIGH, HIGH, Outcome.PASS),
        (LOW - 1, LOW - 1, Outcome.FAIL),
        (HIGH + 1, HIGH + 1, Outcome.FAIL),
        (0, LOW - 1, Outcome.FAIL),
        (HIGH + 1, FOREVER, Outcome.FAIL),
        (LOW - 1, LOW, Outcome.INCONCLUSIVE),
        (HIGH, HIGH + 1, Outcome.INCONCLUSIVE),
        (LOW - 1, HIGH + 1, Outcome.INCONCLUSIVE),
    ],
)
def test_a_limit_is_checked_with_its_doubt(earliest: int, latest: int, outcome: Outcome) -> None:
    """Wholly inside passes, wholly outside fails, astride a limit says nothing; ends count in."""
    assert BAND.check(Interval(earliest, latest)) is outcome


def test_a_missing_end_of_the_limits_is_none() -> None:
    """Limits are open where nothing is said."""
    assert Limits().check(Interval(-FOREVER, FOREVER)) is Outcome.PASS
    assert Limits(at_most_ns=5).check(Interval(-FOREVER, 5)) is Outcome.PASS
    assert Limits(at_least_ns=5).check(Interval(4, 4)) is Outcome.FAIL


def test_limits_are_told_with_the_ends_that_they_have() -> None:
    """A one-sided limit reads as one."""
    assert str(BAND) == "99 ms .. 101 ms"
    assert str(Limits(at_most_ns=HIGH)) == "at most 101 ms"
    assert str(Limits(at_least_ns=LOW)) == "at least 99 ms"


@pytest.mark.parametrize(
    ("outcomes", "gravity"),
    [
        ([], Outcome.PASS),
        ([Outcome.PASS, Outcome.NOT_RUN, Outcome.CHARACTERISTIC], Outcome.PASS),
        ([Outcome.PASS, Outcome.OBSERVATION], Outcome.OBSERVATION),
        ([Outcome.OBSERVATION, Outcome.INCONCLUSIVE], Outcome.INCONCLUSIVE),
        ([Outcome.INCONCLUSIVE, Outcome.FAIL, Outcome.PASS], Outcome.FAIL),
    ],
)
def test_the_gravest_outcome_stands_for_all(outcomes: list[Outcome], gravity: Outcome) -> None:
    """FAIL before INCONCLUSIVE before OBSERVATION before PASS; the rest weighs nothing."""
    assert gravest(outcomes) is gravity


def test_a_verdict_tells_what_was_measured_and_allowed() -> None:
    """The sentence carries requirement, measure and limits, as far as there are any."""
    measured = Interval(101_500 * US, 101_600 * US)

    assert str(Verdict("", Outcome.PASS, "all is well")) == "all is well"
    assert (
        str(Verdict("HB-01", Outcome.FAIL, "too slow", measured, BAND))
        == "HB-01: too slow; measured 101.5 ms .. 101.6 ms; allowed 99 ms .. 101 ms"
    )


@pytest.mark.parametrize("kind", [DeviceFailure, InconclusiveResult])
def test_what_stops_a_test_carries_its_verdict(
    kind: type[DeviceFailure | InconclusiveResult],
) -> None:
    """The exception keeps the verdict, and shows the evidence where there is some."""
    verdict = Verdict("HB-01", Outcome.FAIL, "too slow")

    assert kind(verdict).verdict is verdict
    assert str(kind(verdict)) == "HB-01: too slow"
    assert str(kind(verdict, "frame 7")) == "HB-01: too slow\nframe 7"


def test_not_run_and_not_applicable_are_no_failures() -> None:
    """What the bench lacks and what the profile excludes never reads as a broken device."""
    for kind in (NotRun, NotApplicable):
        assert not issubclass(kind, AssertionError)
