"""The state machine: Hypothesis drives it, finds a fault, and tells it as a scenario."""

from __future__ import annotations

import pytest
from hypothesis import HealthCheck, Phase, settings
from hypothesis.stateful import run_state_machine_as_test

from hil_tests.bench.keypad import KeypadBench
from hil_tests.explore.lab import Lab
from hil_tests.judge.verdict import DeviceFailure, Outcome
from hil_tests.scenarios.machine import KeypadMachine
from hil_tests.scenarios.scenario import scenario

QUICK = settings(
    max_examples=20,
    stateful_step_count=8,
    deadline=None,
    database=None,
    derandomize=True,
    phases=[Phase.generate],
    suppress_health_check=list(HealthCheck),
)


def machine(bench_: KeypadBench, *claims_: str) -> type[KeypadMachine]:
    """One on a bench of its own."""

    class Machine(KeypadMachine):
        """On this bench."""

        bench = bench_
        claims = claims_

    return Machine


@pytest.mark.slow
def test_a_right_keypad_stands_it() -> None:
    """Whatever it does nothing is wrong, and each claim is recorded."""
    lab = Lab()
    run_state_machine_as_test(machine(lab.bench, "ROB-01"), settings=QUICK)
    assert [verdict.outcome for verdict in lab.bench.verdicts] == [Outcome.PASS] * len(
        lab.bench.verdicts
    )
    assert lab.bench.verdicts


@pytest.mark.slow
def test_a_faulty_keypad_does_not() -> None:
    """The failure has a note with the scenario, and that scenario shows the fault again."""
    lab = Lab(model="boot-up-twice")
    with pytest.raises(DeviceFailure) as caught:
        run_state_machine_as_test(machine(lab.bench), settings=QUICK)
    assert caught.value.verdict.requirement == "NMT-02"
    note = next(each for each in caught.value.__notes__ if "nodeproof play" in each)
    text = note.partition("nodeproof play ")[2].strip("'")
    finding = Lab(model="boot-up-twice").play(scenario(text))
    assert finding is not None
    assert "NMT-02" in finding.requirements


def test_it_is_told_as_a_scenario() -> None:
    """Beginning, parameters and what was done."""
    told = machine(Lab().bench)()
    told.commissioned(debounce=0, heartbeat_ms=20)
    told.keys_move(1_000_000, "flip 1")
    assert str(told.scenario) == (
        "off node_id=6 heartbeat_ms=20 debounce=0: 200ms power on; 1ms keys 1"
    )
