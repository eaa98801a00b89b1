"""Keys in every order, bouncing near the debounce time, in and out of operational (KEY-06).

Explored in virtual time; elsewhere the written examples alone are played.
"""

from __future__ import annotations

import pytest
from hypothesis import example, given, settings, target
from hypothesis import strategies as st

from hil_tests.api import Bench, Keys
from hil_tests.scenarios.scenario import Scenario
from hil_tests.scenarios.story import play
from hil_tests.scenarios.strategies import key_scenarios

DEBOUNCES = (0, 1, 2, 5)

QUIET = st.one_of([key_scenarios(debounce, commands=False) for debounce in DEBOUNCES])
LIVELY = st.one_of([key_scenarios(debounce) for debounce in DEBOUNCES])


def towards_the_limit(scenario: Scenario) -> None:
    """Tell Hypothesis how near to the debounce time the pulses are."""
    limit_ms = 100 * scenario.debounce
    nearest = min((abs(span - limit_ms) for span in scenario.pulses()), default=1000)
    target(-float(min(nearest, 1000)), label="ms from the debounce time")


@pytest.mark.requirement("KEY-06", "KEY-04", "KEY-05", "KEY-02", "KEY-23")
@given(scenario=QUIET)
@example(Scenario(1, ((20, 0b1), (88, 0b0), (12, 0b1), (88, 0b0), (12, 0b1), (250, 0b0))))
@example(Scenario(1, ((20, 0b1), (60, 0b11), (60, 0b111), (112, 0b110), (60, 0b100), (60, 0))))
@example(Scenario(2, ((5, 0b111), (212, 0b0), (188, 0b111), (3, 0b0), (250, 0b101), (450, 0))))
@example(Scenario(0, ((30, 0b1), (12, 0b0), (12, 0b11), (30, 0b10), (60, 0b0))))
@settings(max_examples=200)
def test_every_change_is_reported_once_and_in_time(
    bench: Bench, keys: Keys, scenario: Scenario
) -> None:
    """Whatever the keys do, each change that lasts is shown, in time, once, and no other."""
    bench.begin_example()
    towards_the_limit(scenario)
    story = play(bench, scenario)
    story.judge("KEY-06", "KEY-04", "KEY-05")
    bench.check_monitors()


@pytest.mark.requirement("KEY-06", "KEY-01", "KEY-07", "KEY-22", "KEY-04", "KEY-05")
@given(scenario=LIVELY)
@example(Scenario(1, ((20, 0b1), (130, "stop"), (60, 0b11), (250, 0b10), (60, "start"))))
@example(Scenario(1, ((20, 0b1), (60, "pre-operational"), (150, "start"), (200, 0b0))))
@example(Scenario(2, ((20, 0b111), (250, "stop"), (60, 0), (60, "start"), (60, 0b1))))
@example(Scenario(1, ((20, 0b1), (140, 0b0), (140, "stop"), (3, "start"), (60, "stop"))))
@example(Scenario(1, ((20, 0b100), (200, "reset"), (60, 0b101), (60, "start"), (250, 0))))
@settings(max_examples=200)
def test_leaving_and_entering_operational_loses_nothing(
    bench: Bench, keys: Keys, scenario: Scenario
) -> None:
    """Whatever the keys do while the node comes and goes, it shows each state in its place."""
    bench.begin_example()
    towards_the_limit(scenario)
    story = play(bench, scenario)
    story.judge("KEY-06", "KEY-01", "KEY-07", "KEY-22", "KEY-04", "KEY-05")
    bench.check_monitors()
