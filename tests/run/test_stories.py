"""Stored scenarios in a run: those of the command line alone, or those that fit its time."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import pytest

from hil_tests.run import stories
from hil_tests.run.options import OPTIONS, Settings
from hil_tests.run.plan import EXTERNAL, Plan, make_plan
from hil_tests.scenarios.corpus import Stored, is_timed, stored
from tests.run.harness import judge

if TYPE_CHECKING:
    from _pytest.mark import ParameterSet

pytest_plugins = ["pytester"]

CONFTEST = "from hil_tests.acceptance.conftest import pytest_generate_tests"
BODY = """
from hil_tests.scenarios.play import judge

def test_stored(bench, stored):
    judge(bench, stored.scenario, *stored.claims)

@pytest.mark.requirement("NMT-02")
def test_other(bench):
    bench.start()
"""
PRESS = "operational: 60ms keys 1; 200ms wait"
STOP = "operational heartbeat_ms=50: 110ms nmt stop"
LOAD = "operational: 0ms load 60% high; 100ms load off"


# A run.


def test_given_scenarios_are_played_and_nothing_else(pytester: pytest.Pytester) -> None:
    """One test for each, in their order, on the requirements that their verbs are about."""
    pytester.makeconftest(CONFTEST)
    run = judge(pytester, BODY, f"--can-scenario={PRESS}", f"--can-scenario={STOP}")
    assert run.status == 0
    assert run.outcomes == {"test_stored[given-1]": "passed", "test_stored[given-2]": "passed"}
    claims = [row["requirements"] for row in run.results["results"]]
    assert claims == [["KEY-06"], ["NMT-07"]]


def test_a_given_scenario_that_fails_says_how_to_see_it_again(pytester: pytest.Pytester) -> None:
    """The command plays it on the model; the line that repeats the test has it, too."""
    pytester.makeconftest(CONFTEST)
    run = judge(pytester, BODY, f"--can-scenario={PRESS}", "--can-mutant=debounce-too-short")
    assert run.status == 1
    assert f"to see it again: nodeproof play {PRESS!r}" in run.text
    assert f"'--can-scenario={PRESS}'" in run.results["results"][0]["reproduce"]


def test_given_scenarios_that_are_none(pytester: pytest.Pytester) -> None:
    """Exit status 4, all of them at once, each with what would be right."""
    pytester.makeconftest(CONFTEST)
    wrong = {
        "operational: 60ms kays 1": "step '60ms kays 1': unknown verb 'kays'; there is keys",
        "opertional: 60ms keys 1": "unknown beginning 'opertional'; there is operational",
        "60ms keys 1": "a scenario is BEGINNING NAME=VALUE...: STEP; STEP...",
        "": "a scenario is BEGINNING",
    }
    run = judge(pytester, BODY, *(f"--can-scenario={text}" for text in [*wrong, PRESS]))
    assert run.status == 4
    assert all(f"--can-scenario: {said}" in run.text for said in wrong.values())
    assert "Traceback" not in run.text
    assert "site-packages" not in run.text
    assert not run.reports.exists()


def test_wrong_options_are_told_as_ever(pytester: pytest.Pytester) -> None:
    """That stored scenarios depend on the plan makes no broken test file of them."""
    pytester.makeconftest(CONFTEST)
    only_stored = BODY.partition("@pytest.mark")[0]
    run = judge(pytester, only_stored, "--can-profile=keypda", "--can-budget=soon")
    assert run.status == 4
    assert "'keypda': no such profile; did you mean keypad?" in run.text
    assert "Traceback" not in run.text
    assert "ERROR collecting" not in run.text


def test_the_environment_has_a_scenario_a_line(
    pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Blanks belong to a scenario, so it is lines that part them."""
    pytester.makeconftest(CONFTEST)
    monkeypatch.setenv("NODEPROOF_CAN_SCENARIO", f"{PRESS}\n{STOP}\n")
    run = judge(pytester, BODY)
    assert list(run.outcomes) == ["test_stored[given-1]", "test_stored[given-2]"]


@pytest.mark.slow
def test_without_a_given_scenario_the_stored_ones_are_played(pytester: pytest.Pytester) -> None:
    """All of them in virtual time, where they cost nothing; other tests as well."""
    pytester.makeconftest(CONFTEST)
    run = judge(pytester, BODY)
    names = {f"test_stored[{each.name}]" for each in stored("keypad")}
    assert set(run.outcomes) == {*names, "test_other"}
    assert set(run.outcomes.values()) == {"passed"}
    assert run.status == 0


# Which ones, by the plan alone.


def plan(**chosen: Any) -> Plan:
    """What is planned in virtual time with some settings."""
    defaults: Mapping[str, Any] = {
        option.key: [] if option.kind in {"list", "lines"} else option.default
        for option in OPTIONS
    }
    return make_plan(Settings({**defaults, **chosen}, dict.fromkeys(defaults, "default")))


def board(**chosen: Any) -> Plan:
    """A board of the user's on a real bench with all facilities."""
    return replace(plan(**chosen), device=EXTERNAL, channel="can0")


def marks(parameter: ParameterSet) -> dict[str, pytest.Mark]:
    """The marks of a parameter by name."""
    found: dict[str, pytest.Mark] = {}
    for each in parameter.marks:
        mark = each.mark if isinstance(each, pytest.MarkDecorator) else each
        found[mark.name] = mark
    return found


def skipped(parameters: list[ParameterSet]) -> dict[str, str]:
    """Why some are left out, by name."""
    return {
        str(each.id): str(marks(each)["skip"].kwargs["reason"])
        for each in parameters
        if "skip" in marks(each)
    }


def test_virtual_time_has_room_for_all() -> None:
    """None is left out, whatever the budget says."""
    found = stories.parameters(plan(can_budget="1ms"))
    assert [each.id for each in found] == [each.name for each in stored("keypad")]
    assert skipped(found) == {}


def test_each_says_what_it_is_about_and_what_it_needs() -> None:
    """Requirements and facilities as marks, so that a bench that lacks one says so."""
    (found,) = stories.parameters(plan(can_scenario=["off: 0ms led 01; 0ms look"]))
    assert marks(found)["requirement"].args == ("LED-01",)
    assert marks(found)["needs"].args == ("leds", "power")


def test_a_load_needs_a_timed_wire() -> None:
    """It is marked so, and is never left out for want of time."""
    untimed = replace(board(can_scenario=[LOAD, PRESS], can_budget="1ms"), timed=False)
    load, press = stories.parameters(untimed)
    assert "timed" in marks(load)
    assert skipped([load, press]).keys() == {"given-2"}


def test_what_does_not_fit_says_why() -> None:
    """Budget, cost and option are named."""
    found = stories.parameters(board(can_scenario=[PRESS, STOP], can_budget="1s"))
    assert skipped(found) == {
        "given-1": "left out of 1 s for stored scenarios (about 2 s); see --can-budget",
        "given-2": "left out of 1 s for stored scenarios (about 6 s); see --can-budget",
    }
    assert skipped(stories.parameters(board(can_scenario=[PRESS, STOP], can_budget="3s"))) == {
        "given-2": "left out of 3 s for stored scenarios (about 6 s); see --can-budget",
    }


def test_ten_minutes_are_the_usual_budget() -> None:
    """Where nobody says, what is played takes no longer."""
    entries = {each.name: each for each in stored("keypad")}
    assert board().budget_ns == 600 * 1_000_000_000
    found = stories.parameters(board())
    played = [entries[str(each.id)] for each in found if str(each.id) not in skipped(found)]
    assert sum(each.cost_ns for each in played if not is_timed(each)) <= board().budget_ns


def test_a_scenario_that_was_asked_for_is_played_whatever_it_takes() -> None:
    """Only a budget that was given keeps it from being played, not the usual one."""
    hour = "operational: 3600s wait"
    assert skipped(stories.parameters(board(can_scenario=[hour]))) == {}
    assert skipped(stories.parameters(board(can_scenario=[hour], can_budget="10min")))


def test_what_a_bench_cannot_play_takes_no_time_from_others() -> None:
    """It is left to its own reason, and has no share in the budget."""
    bare = replace(board(can_scenario=[PRESS, STOP], can_budget="6s"), facilities=())
    assert skipped(stories.parameters(bare)) == {}


def test_a_scenario_is_handed_on_as_it_is() -> None:
    """With name, text and claims."""
    (found,) = stories.parameters(plan(can_scenario=[PRESS]))
    (entry,) = found.values
    assert isinstance(entry, Stored)
    assert str(entry.scenario) == PRESS
    assert (entry.name, entry.claims, entry.finds) == ("given-1", ("KEY-06",), ())
