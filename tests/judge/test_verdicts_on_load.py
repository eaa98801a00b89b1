"""The bar for timing verdicts on a loaded bus, in small: `benchmarks/verdicts_on_load.py`."""

from __future__ import annotations

import pytest

from benchmarks.verdicts_on_load import MOST_INCONCLUSIVE, Case, judge, undecided
from hil_tests.judge.verdict import Outcome
from node_model.node import S

SLOW = pytest.mark.slow


@pytest.mark.parametrize("right", [True, False], ids=["right", "wrong"])
@pytest.mark.parametrize(
    "load",
    [0, pytest.param(30, marks=SLOW), pytest.param(60, marks=SLOW), pytest.param(90, marks=SLOW)],
)
def test_no_load_makes_a_verdict_false(load: int, right: bool) -> None:
    """One minute at 125 kbit/s: the truth is inside, and no interval is judged wrongly."""
    result = judge(Case(125_000, load, right, 60 * S))

    assert not result.misses
    assert result.intervals > 580


@pytest.mark.slow
def test_at_a_usual_load_most_intervals_are_decided() -> None:
    """At 125 kbit/s and 30 % load the share of open intervals keeps to the bar."""
    results = [judge(Case(125_000, 30, right, 60 * S)) for right in (True, False)]

    assert 0 < undecided(results) <= MOST_INCONCLUSIVE


@pytest.mark.slow
def test_differences_of_stamps_blame_a_right_device() -> None:
    """What causal intervals are for: under load the plain difference fails a sound heartbeat."""
    result = judge(Case(125_000, 60, right=True, span_ns=60 * S))

    assert result.plain_false > 0
    assert result.plain_verdict is Outcome.FAIL
    assert result.verdict is Outcome.PASS
