"""The window oracle: which set-points a SYNC may have taken."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hil_tests.clock import MS, Interval, exactly
from hil_tests.judge.window import Received, Window, permitted


def at(ms: float) -> Interval:
    """An instant."""
    return exactly(round(ms * MS))


def after(
    rpdos: list[tuple[float, int]], window_ms: int = 20, margin_ms: float = 1
) -> list[set[int]]:
    """What the object may be after SYNCs at 0, 100 and 200 ms; it was 0."""
    received = [Received(at(ms), value) for ms, value in rpdos]
    window = Window(window_ms * MS, round(margin_ms * MS))
    syncs = [at(0), at(100), at(200)]
    return [set(values) for values in permitted(0, syncs, received, window)]


@pytest.mark.parametrize(
    ("rpdos", "values"),
    [
        ([], [{0}, {0}, {0}]),
        ([(10, 1)], [{0}, {1}, {1}]),
        ([(100, 1)], [{0}, {0}, {0}]),
        ([(10, 1), (12, 2)], [{0}, {2}, {2}]),
        ([(30, 1)], [{0}, {0}, {0}]),
        ([(10, 1), (30, 2)], [{0}, {1}, {1}]),
        ([(110, 1)], [{0}, {0}, {1}]),
        ([(10, 1), (110, 2)], [{0}, {1}, {2}]),
        ([(210, 1)], [{0}, {0}, {0}]),
        ([(19, 1)], [{0}, {1}, {1}]),
        ([(19.1, 1)], [{0}, {0, 1}, {0, 1}]),
        ([(21, 1)], [{0}, {0, 1}, {0, 1}]),
        ([(21.1, 1)], [{0}, {0}, {0}]),
        ([(10, 1), (20, 2)], [{0}, {1, 2}, {1, 2}]),
        ([(-5, 1)], [{0, 1}, {0, 1}, {0, 1}]),
    ],
)
def test_what_a_sync_may_have_taken(
    rpdos: list[tuple[float, int]], values: list[set[int]]
) -> None:
    """The last one that came in time; both, where nobody can say."""
    assert after(rpdos) == values


def test_without_a_window_everything_counts() -> None:
    """Even what comes long after the SYNC, and before the first."""
    assert after([(-5, 1), (99, 2), (199, 3)], window_ms=0) == [{1}, {2}, {3}]


def test_doubt_about_the_instant_is_doubt_about_the_value() -> None:
    """An interval that straddles the end leaves both."""
    received = [Received(Interval(18 * MS, 22 * MS), 1)]
    assert permitted(0, [at(0), at(100)], received, Window(20 * MS, 0))[1] == {0, 1}


@given(st.lists(st.integers(-50, 300), max_size=6), st.integers(0, 120))
def test_something_is_always_permitted(phases: list[int], window_ms: int) -> None:
    """And nothing that was never sent."""
    rpdos = [(float(ms), value) for value, ms in enumerate(sorted(phases), 1)]
    for values in after(rpdos, window_ms):
        assert values
        assert values <= {0, *range(1, len(phases) + 1)}
