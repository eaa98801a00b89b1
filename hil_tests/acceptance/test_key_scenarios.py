"""Keys in every order, bouncing near the debounce time, in and out of operational (KEY-06).

Explored in virtual time; elsewhere the written examples alone are played.
"""

from __future__ import annotations

import pytest
from hypothesis import example, given, settings, target

from hil_tests.api import MS, KeypadBench, Keys
from hil_tests.scenarios.play import judge
from hil_tests.scenarios.scenario import Scenario, scenario
from hil_tests.scenarios.strategies import scenarios


def towards_the_limit(story: Scenario) -> None:
    """Tell Hypothesis how near to the debounce time the pulses are."""
    limit_ns = 100 * MS * story.parameters.get("debounce", 1)
    nearest = min((abs(span - limit_ns) for span in story.pulses()), default=1000 * MS)
    target(-float(min(nearest // MS, 1000)), label="ms from the debounce time")


@pytest.mark.requirement("KEY-06", "KEY-04", "KEY-05", "KEY-02", "KEY-23")
@given(story=scenarios("keys"))
@example(
    scenario(
        "operational debounce=1:"
        " 20ms keys 1; 88ms keys 0; 12ms keys 1; 88ms keys 0; 12ms keys 1; 250ms keys 0"
    )
)
@example(
    scenario(
        "operational debounce=1:"
        " 20ms keys 1; 60ms keys 11; 60ms keys 111; 112ms keys 110; 60ms keys 100; 60ms keys 0"
    )
)
@example(
    scenario(
        "operational debounce=2:"
        " 5ms keys 111; 212ms keys 0; 188ms keys 111; 3ms keys 0; 250ms keys 101; 450ms keys 0"
    )
)
@example(
    scenario(
        "operational debounce=0: 30ms keys 1; 12ms keys 0; 12ms keys 11; 30ms keys 10; 60ms keys 0"
    )
)
@settings(max_examples=200)
def test_every_change_is_reported_once_and_in_time(
    bench: KeypadBench, keys: Keys, story: Scenario
) -> None:
    """Whatever the keys do, each change that lasts is shown, in time, once, and no other."""
    bench.begin_example()
    towards_the_limit(story)
    judge(bench, story, "KEY-06", "KEY-04", "KEY-05")


@pytest.mark.requirement("KEY-06", "KEY-01", "KEY-07", "KEY-22", "KEY-04", "KEY-05")
@given(story=scenarios("comings"))
@example(
    scenario(
        "operational debounce=1:"
        " 20ms keys 1; 130ms nmt stop; 60ms keys 11; 250ms keys 10; 60ms nmt start"
    )
)
@example(
    scenario(
        "operational debounce=1:"
        " 20ms keys 1; 60ms nmt pre-operational; 150ms nmt start; 200ms keys 0"
    )
)
@example(
    scenario(
        "operational debounce=2:"
        " 20ms keys 111; 250ms nmt stop; 60ms keys 0; 60ms nmt start; 60ms keys 1"
    )
)
@example(
    scenario(
        "operational debounce=1:"
        " 20ms keys 1; 140ms keys 0; 140ms nmt stop; 3ms nmt start; 60ms nmt stop"
    )
)
@example(
    scenario(
        "operational debounce=1:"
        " 20ms keys 100; 200ms nmt reset-node; 60ms keys 101; 60ms nmt start; 250ms keys 0"
    )
)
@settings(max_examples=200)
def test_leaving_and_entering_operational_loses_nothing(
    bench: KeypadBench, keys: Keys, story: Scenario
) -> None:
    """Whatever the keys do while the node comes and goes, it shows each state in its place."""
    bench.begin_example()
    towards_the_limit(story)
    judge(bench, story, "KEY-06", "KEY-01", "KEY-07", "KEY-22", "KEY-04", "KEY-05")
