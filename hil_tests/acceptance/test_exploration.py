"""Everything that can be done to a keypad, in any order: explored in virtual time only.

On a real bench the stored scenarios take its place (test_stored_scenarios.py).
"""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis.stateful import run_state_machine_as_test

from hil_tests.api import KeypadBench
from hil_tests.scenarios.machine import KeypadMachine
from hil_tests.scenarios.play import judge
from hil_tests.scenarios.scenario import Scenario
from hil_tests.scenarios.strategies import scenarios

VIRTUAL = pytest.mark.virtual("exploration takes thousands of power cycles; see stored scenarios")


@VIRTUAL
@pytest.mark.requirement("ROB-01", "ROB-02", "NMT-07", "KEY-06", "HB-04")
@given(story=scenarios("everything"))
@settings(max_examples=60)
def test_nothing_that_is_done_to_it_leads_it_astray(bench: KeypadBench, story: Scenario) -> None:
    """Keys, commands, LED frames, garbage, power, commissioning: all is as it must be."""
    bench.begin_example()
    judge(bench, story, "ROB-01", "ROB-02")


@VIRTUAL
@pytest.mark.requirement("COM-03", "COM-20", "COM-21", "COM-22", "COM-24", "COM-05")
@given(story=scenarios("echoes"))
@settings(max_examples=40)
def test_commissioning_is_not_disturbed(bench: KeypadBench, story: Scenario) -> None:
    """Whatever else is sent in commissioning: one request counts, is echoed, and is kept."""
    bench.begin_example()
    judge(bench, story, "COM-05")


@VIRTUAL
@pytest.mark.requirement("COM-06", "COM-26", "COM-29", "COM-09", "COM-10")
@given(story=scenarios("memories", most=4))
@settings(max_examples=30)
def test_parameters_are_kept_or_replaced_as_a_whole(bench: KeypadBench, story: Scenario) -> None:
    """Commissioned again and again, cut off at any instant: it works with one whole set."""
    bench.begin_example()
    judge(bench, story, "COM-06", "COM-26")


@VIRTUAL
@pytest.mark.requirement("LED-01", "LED-02", "LED-03", "LED-04")
@given(story=scenarios("lights"))
@settings(max_examples=30)
def test_lights_follow_the_frames(bench: KeypadBench, story: Scenario) -> None:
    """Whatever LED frames and commands came, the LEDs show what they led to."""
    bench.begin_example()
    judge(bench, story, "LED-01", "LED-02")


@VIRTUAL
@pytest.mark.explores
@pytest.mark.requirement("ROB-01", "NMT-04", "NMT-06", "KEY-06")
def test_state_machine(bench: KeypadBench) -> None:
    """A machine that chooses what to do next finds nothing either."""

    class Machine(KeypadMachine):
        """On this bench."""

    Machine.bench = bench
    Machine.claims = ("ROB-01",)
    run_state_machine_as_test(Machine, settings=settings(max_examples=15, stateful_step_count=20))
