"""A suspicion: something that looks like a fault, to be confirmed when all is known.

Whether a hosted device was late because its host was busy is known only afterwards; so a
monitor notes what looks wrong, and the verdict is made at the end, with widened intervals.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

from hil_tests.clock import Interval
from hil_tests.judge.causal import Lateness, Seen
from hil_tests.judge.verdict import Limits, Outcome, Verdict

Check = Callable[[Interval], Outcome]


@dataclass(frozen=True, slots=True)
class Suspicion:
    """A frame that seems to break a requirement.

    Args:
        requirement: id.
        text: one sentence.
        seen: the frame.
        check: outcome for the interval in which the frame was asked for.
        since: the earlier frame from which a span is measured, if any.
        limits: what the span is held against.
    """

    requirement: str
    text: str
    seen: Seen
    check: Check
    since: Seen | None = None
    limits: Limits | None = None

    def confirm(self, lateness: Lateness) -> Verdict | None:
        """The verdict with all that is known of the host; None = nothing is wrong.

        A span that straddles its limit, now that the host's lateness is in it, is none of
        the conclusive ones: no verdict, as if that had been known when it was seen.
        """
        when = lateness.widen(self.seen)
        cause = lateness.widen(self.since) if self.since else None
        measured = when.since(cause) if cause else None
        outcome = self.check(when)
        if self.limits is not None and measured is not None:
            conclusive = self.limits.check(measured) is Outcome.FAIL
            outcome = Outcome.FAIL if conclusive else Outcome.PASS
        if outcome is Outcome.PASS:
            return None
        at, limits = self.seen.at, self.limits
        return Verdict(self.requirement, outcome, self.text, measured, limits, at, cause, when)


@dataclass(frozen=True, slots=True)
class Silence:
    """A frame that did not come, though it was due.

    Args:
        verdict: what that means for the device.
        limit_at: by then it had to be asked for.
        until: it was not seen by then.
    """

    verdict: Verdict
    limit_at: int
    until: int

    def confirm(self, lateness: Lateness) -> Verdict | None:
        """The verdict; None = the host kept back what was due, the frame perhaps among it."""
        return None if lateness.held_back(self.limit_at, self.until) else self.verdict


def always_wrong(_: Interval) -> Outcome:
    """A frame that is wrong whenever it was asked for."""
    return Outcome.FAIL


def confirmed(suspicions: Sequence[Suspicion | Silence], lateness: Lateness) -> Iterator[Verdict]:
    """The suspicions that stand when all is known."""
    for suspicion in suspicions:
        verdict = suspicion.confirm(lateness)
        if verdict is not None:
            yield verdict
