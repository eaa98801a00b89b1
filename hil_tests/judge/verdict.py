"""Verdicts: measured against limits, where both may be intervals.

A check is guard-banded: it passes when the whole measured interval lies inside the limits,
fails when the whole interval lies outside, and is inconclusive when the doubt straddles one.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import NamedTuple

from hil_tests.clock import FOREVER, Interval, show_interval, show_span


class Outcome(Enum):
    """What can be said of a requirement after a check."""

    PASS = "passed"
    FAIL = "failed"
    INCONCLUSIVE = "inconclusive"
    OBSERVATION = "observation"
    CHARACTERISTIC = "characteristic"
    NOT_RUN = "not run"
    NOT_APPLICABLE = "not applicable"

    # Members are singletons; hashing their names, as Enum does, is slow.
    __hash__ = object.__hash__


_GRAVITY = (Outcome.FAIL, Outcome.INCONCLUSIVE, Outcome.OBSERVATION)


def gravest(outcomes: list[Outcome]) -> Outcome:
    """FAIL before INCONCLUSIVE before OBSERVATION before PASS."""
    return next((outcome for outcome in _GRAVITY if outcome in outcomes), Outcome.PASS)


_PASS, _FAIL, _INCONCLUSIVE = Outcome.PASS, Outcome.FAIL, Outcome.INCONCLUSIVE
"""A name of an enumeration is dear to look up; spans are checked once a frame."""


class Limits(NamedTuple):
    """A span must lie in `at_least_ns .. at_most_ns`, both ends allowed."""

    at_least_ns: int = -FOREVER
    at_most_ns: int = FOREVER

    def check(self, measured: Interval) -> Outcome:
        """Guard-banded check of a measured span."""
        if measured.latest < self.at_least_ns or measured.earliest > self.at_most_ns:
            return _FAIL
        if measured.earliest >= self.at_least_ns and measured.latest <= self.at_most_ns:
            return _PASS
        return _INCONCLUSIVE

    @property
    def ends(self) -> tuple[int | None, int | None]:
        """At least and at most, in ns; None = no limit on that side."""
        low = None if self.at_least_ns <= -FOREVER else self.at_least_ns
        high = None if self.at_most_ns >= FOREVER else self.at_most_ns
        return low, high

    def __str__(self) -> str:
        if self.at_least_ns == -FOREVER:
            return f"at most {show_span(self.at_most_ns)}"
        if self.at_most_ns == FOREVER:
            return f"at least {show_span(self.at_least_ns)}"
        return f"{show_span(self.at_least_ns)} .. {show_span(self.at_most_ns)}"


@dataclass(frozen=True, slots=True)
class Verdict:
    """What one check said of one requirement.

    Args:
        requirement: its id; "" = the requirement of the test that runs.
        outcome: see `Outcome`.
        text: one sentence for people: what was expected and what was seen.
        measured: the span that was measured, if any.
        limits: what it was held against, if any.
        at: instant to look at in the trace.
        cause: from when the measured span counts, with its doubt; None = nothing was timed.
        effect: when it ended; None = it never did, or nothing was timed.
    """

    requirement: str
    outcome: Outcome
    text: str
    measured: Interval | None = None
    limits: Limits | None = None
    at: int | None = None
    cause: Interval | None = None
    effect: Interval | None = None

    def __str__(self) -> str:
        parts = [f"{self.requirement}: " if self.requirement else "", self.text]
        if self.measured is not None:
            parts.append(f"; measured {show_interval(self.measured)}")
        if self.limits is not None:
            parts.append(f"; allowed {self.limits}")
        return "".join(parts)


class DeviceFailure(AssertionError):
    """The device broke a requirement."""

    def __init__(self, verdict: Verdict, evidence: str = "") -> None:
        super().__init__(f"{verdict}\n{evidence}" if evidence else str(verdict))
        self.verdict = verdict


class InconclusiveResult(Exception):
    """The doubt of the measurement, or a busy host, allows no verdict."""

    def __init__(self, verdict: Verdict, evidence: str = "") -> None:
        super().__init__(f"{verdict}\n{evidence}" if evidence else str(verdict))
        self.verdict = verdict


class NotRun(Exception):
    """The bench cannot show this; the text says what it lacks and how to add it."""


class NotApplicable(Exception):
    """The device's profile says that this does not concern it."""
