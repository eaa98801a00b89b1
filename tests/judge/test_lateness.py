"""Lateness: what a busy host kept back is never held against the device."""

from __future__ import annotations

import pytest

from hil_tests.clock import Interval
from hil_tests.judge.causal import Lateness, Seen
from tests.judge.wire import BEAT


def test_lateness_knows_its_worst_and_its_number() -> None:
    """What the report says of the host."""
    lateness = Lateness()
    assert (len(lateness), lateness.worst_ns) == (0, 0)
    lateness.add(10, 15)
    lateness.add(20, 22)
    assert (len(lateness), lateness.worst_ns) == (2, 5)


@pytest.mark.parametrize(
    ("due", "sent", "earliest"),
    [
        (90, 130, 90),
        (100, 130, 100),
        (101, 130, 100),
        (90, 109, 100),
        (90, 110, 90),
        (121, 130, 100),
    ],
    ids=["in between", "due then", "due later", "sent before", "sent at the slack", "due after"],
)
def test_a_late_host_is_held_against_the_host(due: int, sent: int, earliest: int) -> None:
    """A frame seen between due and sent (plus slack) may have been due that early."""
    lateness = Lateness(slack_ns=10)
    lateness.add(due, sent)
    seen = Seen(BEAT, 120, Interval(100, 110), own=False, index=0)

    assert lateness.widen(seen) == Interval(earliest, 110)


@pytest.mark.parametrize(
    ("due", "sent", "held"),
    [(50, 100, True), (51, 100, False), (50, 99, False)],
    ids=["due at the limit", "due later", "sent before"],
)
def test_what_the_host_kept_back_is_not_missing(due: int, sent: int, held: bool) -> None:
    """Silence until 100 over a limit at 50 is the host's, if it sat on what was due by then."""
    lateness = Lateness()
    lateness.add(due, sent)

    assert lateness.held_back(limit_at=50, until=100) is held


def test_of_many_late_frames_only_those_around_it_count() -> None:
    """In whatever order they were told; a long lateness reaches over short ones."""
    lateness = Lateness(slack_ns=0)
    for due, sent in [(500, 510), (10, 700), (90, 115), (300, 310), (95, 120)]:
        lateness.add(due, sent)
    seen = Seen(BEAT, 116, Interval(100, 110), own=False, index=0)
    assert lateness.widen(seen) == Interval(10, 110)
    late = Seen(BEAT, 701, Interval(690, 700), own=False, index=1)
    assert lateness.widen(late) == late.wanted
    assert lateness.held_back(limit_at=10, until=700)
    assert not lateness.held_back(limit_at=9, until=700)
