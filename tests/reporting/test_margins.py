"""Margins: the room that is certain, in three measures, from both sides of each limit."""

from __future__ import annotations

import pytest

from hil_tests.reporting.margins import Ends, Margin, margin_of


@pytest.mark.parametrize(
    ("measured", "limits", "margin"),
    [
        ((99, 101), (90, 110), Margin(9, 4.5, 0.9)),
        ((100, 100), (90, 110), Margin(10, 10, 1)),
        ((90, 92), (90, 110), Margin(0, 0, 0)),
        ((108, 110), (90, 110), Margin(0, 0, 0)),
        ((109, 111), (90, 110), Margin(-1, -0.5, -0.1)),
        ((111, 113), (90, 110), Margin(-3, -1.5, -0.3)),
        ((87, 89), (90, 110), Margin(-3, -1.5, -0.3)),
        ((20, 25), (None, 100), Margin(75, 15, 0.75)),
        ((150, 160), (100, None), Margin(50, 5, 0.5)),
        ((5, 5), (0, None), Margin(5, 5, None)),
        ((5, 5), (5, 5), Margin(0, 0, None)),
    ],
)
def test_the_room_to_the_nearest_limit(
    measured: tuple[int, int], limits: Ends, margin: Margin
) -> None:
    """From the worst end of what was measured; an exact measurement has a doubt of 1 ns."""
    assert margin_of(measured, limits) == margin


@pytest.mark.parametrize(
    ("measured", "limits"), [(None, (1, 2)), ((1, 2), None), ((1, 2), (None, None))]
)
def test_without_measurement_or_limits_there_is_no_margin(
    measured: tuple[int, int] | None, limits: Ends | None
) -> None:
    """A check of something else than a span has none."""
    assert margin_of(measured, limits) is None
