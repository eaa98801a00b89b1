"""Distilling: for each fault a scenario that shows it, and few enough of them."""

from __future__ import annotations

from collections.abc import Callable
from itertools import count

from hil_tests.explore.distil import Distiller, Target, finds, thinned
from hil_tests.explore.lab import Lab
from hil_tests.scenarios.corpus import Stored
from hil_tests.scenarios.scenario import scenario
from node_model.faults import MUTANTS


def target(name: str) -> Target:
    """A fault of the registry."""
    return Target(name, frozenset(MUTANTS[name].violates))


def ticking(step_s: float = 1.0) -> Callable[[], float]:
    """A clock that goes on by so much whenever somebody looks."""
    ticks = count()
    return lambda: next(ticks) * step_s


def distiller(patience_s: float = 30, step_s: float = 1.0) -> Distiller:
    """One that looks for a fault in so many walks."""
    return Distiller("keypad", 0, patience_s, ticking(step_s))


def kept(name: str, play: str, *shows: str) -> Stored:
    """A stored scenario."""
    return Stored(name, scenario(play), ("KEY-01",), shows)


def test_a_fault_is_found_and_made_small() -> None:
    """The scenario bears the name of the fault, and claims what it breaks there."""
    fault = target("entry-frame-missing")
    found = distiller().show(fault, [])
    assert found is not None
    assert found.name == "entry-frame-missing"
    assert found.finds == ("entry-frame-missing",)
    assert found.claims == ("KEY-01",)
    assert len(found.scenario.steps) <= 1
    finding = Lab(model=fault.name).play(found.scenario)
    assert finding is not None
    assert finding.requirements & fault.violates


def test_a_known_scenario_is_as_good() -> None:
    """Nothing is walked where one of those that are there shows the fault."""
    blind = kept("blind", "off: 0ms wait")
    shows = kept("shows", "operational: 60ms wait")
    found = distiller(patience_s=0).show(target("entry-frame-missing"), [blind, shows])
    assert found is shows


def test_a_scenario_that_shows_its_fault_no_longer_keeps_its_name() -> None:
    """The new one gets a number: names are unique in a file."""
    stale = [kept("entry-frame-missing", "off: 0ms wait"), kept("entry-frame-missing-2", "off:")]
    found = distiller().show(target("entry-frame-missing"), stale)
    assert found is not None
    assert found.name == "entry-frame-missing-3"


def test_patience_has_an_end() -> None:
    """A fault that is not shown in time is missed: nothing is made up."""
    unseen = Target("entry-frame-missing", frozenset(("COM-26",)))
    assert distiller(patience_s=2).show(unseen, []) is None


def test_which_scenarios_show_a_fault() -> None:
    """Only where the blame is on what it violates."""
    stories = [
        kept("entry", "operational: 60ms wait"),
        kept("wait", "off: 0ms wait"),
        kept("press", "operational: 60ms keys 1"),
    ]
    assert list(finds("keypad", stories, target("entry-frame-missing"))) == ["entry", "press"]
    assert list(finds("keypad", stories, target("debounce-too-short"))) == ["press"]
    assert list(finds("keypad", stories, target("never-commissions"))) == []


def test_few_scenarios_are_kept() -> None:
    """As few seconds as still show every fault, in the order of the file."""
    dear = kept("dear", "operational: 60s wait")
    one = kept("one", "operational: 1s wait")
    two = kept("two", "operational: 2s wait")
    idle = kept("idle", "operational: 0ms wait")
    shown = {"a": ["dear", "one"], "b": ["dear", "two"], "c": ["two"], "missed": []}
    assert thinned([dear, idle, two, one], shown) == [
        two._replace(finds=("b", "c")),
        one._replace(finds=("a",)),
    ]
    assert thinned([dear, idle], {"a": ["dear"]}) == [dear._replace(finds=("a",))]
    assert thinned([idle], {"missed": []}) == []
    assert thinned([], {}) == []
