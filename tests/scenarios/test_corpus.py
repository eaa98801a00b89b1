"""Stored scenarios: the file, its errors, and which of them fit a time."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hil_tests.clock import S
from hil_tests.errors import ConfigError
from hil_tests.explore.distil import Target, finds
from hil_tests.requirements import load
from hil_tests.scenarios.corpus import (
    Stored,
    choose,
    claims_of,
    is_timed,
    parsed,
    stored,
    written,
)
from hil_tests.scenarios.families import FAMILIES
from hil_tests.scenarios.scenario import scenario
from hil_tests.scenarios.strategies import scenarios
from node_model.faults import MUTANTS

KEYS = "operational: 60ms keys 1"


def entry(name: str, *finds: str, play: str = KEYS, seconds: int = 1) -> Stored:
    """A stored scenario that waits some seconds at its end."""
    return Stored(name, scenario(f"{play}; {seconds}s wait"), ("KEY-06",), finds)


names = st.text("abcdefghijklmnopqrstuvwxyz-0123456789", min_size=1, max_size=12)


@settings(max_examples=15, deadline=None)
@given(
    stories=st.lists(st.sampled_from(sorted(FAMILIES)).flatmap(scenarios), max_size=3),
    shows=st.lists(names, max_size=2),
)
def test_what_is_written_is_what_is_read(stories: list[object], shows: list[str]) -> None:
    """Every scenario of every family, with its claims and finds."""
    entries = tuple(
        Stored(f"n{index}", scenario(str(story)), ("HB-01", "KEY-06"), tuple(shows))
        for index, story in enumerate(stories)
    )
    assert parsed(written(entries), "file") == entries


def test_an_empty_file_has_no_scenarios() -> None:
    """So has one that was just begun."""
    assert parsed("", "file") == ()
    assert parsed(written([]), "file") == ()
    assert stored("no-such-kind") == ()


def test_claims_follow_from_the_verbs() -> None:
    """Where nobody says what a scenario is about."""
    (read,) = parsed(f'[[scenario]]\nname = "a"\nplay = "{KEYS}; 0ms led 01"\n', "file")
    assert read.claims == ("KEY-06", "LED-01")
    assert read.finds == ()
    assert claims_of(scenario("off: 0ms wait")) == ("HB-01",)
    assert claims_of(scenario("off: 0ms load 60% high; 0ms nmt stop")) == ("NMT-07", "ROB-03")
    assert set(claims_of(scenario("off: 0ms request 06; 0ms send 1FF#"))) == {"COM-05", "ROB-01"}


def test_every_error_is_told_at_once() -> None:
    """Each with the file and the number of its entry."""
    text = """
    [[scenario]]
    name = "one"
    play = "operational: 60ms kays 1"
    [[scenario]]
    play = "off:"
    [[scenario]]
    name = "three"
    [[scenario]]
    name = 4
    play = "off:"
    [[scenario]]
    name = "five"
    play = 5
    [[scenario]]
    name = "six"
    play = "off:"
    claims = "KEY-06"
    [[scenario]]
    name = "seven"
    play = "off:"
    finds = [7]
    [[scenario]]
    name = "eight"
    play = "off:"
    findz = []
    [[scenario]]
    name = "nine"
    play = "off:"
    [[scenario]]
    name = "nine"
    play = "off:"
    """
    with pytest.raises(ConfigError) as caught:
        parsed(text, "some.toml")
    lines = str(caught.value).splitlines()
    assert all(line.startswith("some.toml: ") for line in lines)
    for said in (
        "unknown verb 'kays'; there is keys",
        "scenario 2: 'name' is missing",
        "scenario 3: 'play' is missing",
        "scenario 4: 4 is no text",
        "scenario 5: 5 is no text",
        "scenario 6: 'KEY-06' is no list of names",
        "scenario 7: 7 is no text",
        "scenario 8: unknown key findz",
        "two scenarios are called 'nine'",
    ):
        assert any(said in line for line in lines), said
    assert len(lines) == 9


@pytest.mark.parametrize(
    "text",
    [
        "[[scenario",
        "scenario = 5",
        "scenario = [5]",
        "[scenario]\nname = 'a'\nplay = 'off:'",
        "scenarios = []",
    ],
)
def test_a_file_of_another_shape_is_refused(text: str) -> None:
    """It is named, and what is wrong with it."""
    with pytest.raises(ConfigError, match=r"^some\.toml: (.*\(at |write tables|.* is no table)"):
        parsed(text, "some.toml")


# Cost, and what fits.


def test_cost_is_about_what_a_real_bench_takes() -> None:
    """Its steps, each start, each look, and commissioning there and back."""
    plain = entry("a").cost_ns
    assert plain > scenario(f"{KEYS}; 1s wait").span_ns
    assert entry("a", seconds=11).cost_ns == plain + 10 * S
    assert entry("a", play=f"{KEYS}; 0ms power off; 0ms power on").cost_ns > plain
    assert entry("a", play=f"{KEYS}; 0ms look").cost_ns > plain
    assert entry("a", play=f"{KEYS}; 0ms watch 7s").cost_ns == plain + 7 * S
    assert entry("a", play="operational debounce=2: 60ms keys 1").cost_ns > plain
    assert entry("a", play=f"{KEYS}; 0ms request 06").cost_ns > plain


sets = st.frozensets(st.sampled_from("abcdef"), max_size=3)


@settings(max_examples=50, deadline=None)
@given(rows=st.lists(st.tuples(sets, st.integers(0, 20)), max_size=8), budget_s=st.integers(0, 80))
def test_what_is_chosen_fits(rows: list[tuple[frozenset[str], int]], budget_s: int) -> None:
    """Never more than the time, never one more that would fit, in the order of the file."""
    entries = [
        entry(f"n{index}", *sorted(finds), seconds=seconds)
        for index, (finds, seconds) in enumerate(rows)
    ]
    chosen = choose(entries, budget_s * S)
    left_ns = budget_s * S - sum(each.cost_ns for each in chosen)
    assert left_ns >= 0
    assert all(each.cost_ns > left_ns for each in entries if each not in chosen)
    assert chosen == [each for each in entries if each in chosen]


def test_telling_ones_come_first() -> None:
    """Most new faults a second; what shows nothing new is taken last, the cheapest first."""
    both, one, other = entry("both", "x", "y"), entry("one", "x"), entry("other", "z")
    dear, cheap = entry("dear", seconds=9), entry("cheap", seconds=2)
    entries = [dear, cheap, one, other, both]
    costs = [each.cost_ns for each in (both, other, one, cheap, dear)]
    picked = [{each.name for each in choose(entries, sum(costs[:count]))} for count in range(6)]
    assert picked == [
        set(),
        {"both"},
        {"both", "other"},
        {"both", "other", "one"},
        {"both", "other", "one", "cheap"},
        {"both", "other", "one", "cheap", "dear"},
    ]


def test_what_an_entry_needs() -> None:
    """Facilities by its verbs, and a wire with bit times for a load."""
    assert not is_timed(entry("a"))
    assert is_timed(entry("a", play="operational: 0ms load 60% high"))


# The file that is shipped.


def test_the_shipped_file_is_in_order() -> None:
    """Names are unique, each find is a mutant's name, each claim a requirement."""
    entries = stored("keypad")
    assert entries
    assert len({each.name for each in entries}) == len(entries)
    for each in entries:
        assert set(each.finds) <= set(MUTANTS), each.name
        assert each.claims, each.name
        assert set(each.claims) <= set(load("keypad")), each.name
        assert each.scenario == scenario(str(each.scenario))


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", sorted({name for each in stored("keypad") for name in each.finds})
)
def test_the_shipped_file_finds_what_it_says(name: str) -> None:
    """At least one of the scenarios that name a fault blames it on what it violates."""
    said = [each for each in stored("keypad") if name in each.finds]
    said.sort(key=lambda each: (each.name != name, each.cost_ns))
    target = Target(name, frozenset(MUTANTS[name].violates))
    assert next(finds("keypad", said, target), "")
