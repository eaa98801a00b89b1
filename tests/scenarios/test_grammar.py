"""Any row of numbers is a scenario that can be played, and leaves nothing to the maker."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hil_tests.clock import MS
from hil_tests.explore.lab import Lab
from hil_tests.scenarios.families import FAMILIES, REQUESTS, near_limits, turns
from hil_tests.scenarios.grammar import BOTH, CYCLE_MS, OFF_MS, Teller, told
from hil_tests.scenarios.noise import NOISE
from hil_tests.scenarios.scenario import BEGINNINGS, GIVEN, Scenario, Step, scenario
from hil_tests.scenarios.strategies import scenarios
from hil_tests.scenarios.values import MANY, TALLIES, value
from hil_tests.scenarios.words import WORDS, sent

ANY = st.lists(st.integers(-10, 10_000), max_size=20)
LAB = Lab()


def situations(story: Scenario) -> Iterator[tuple[Step, int, bool, bool]]:
    """Each step with the keys held before it, whether there was power, and whether it waits."""
    held, powered, waiting = 0, story.begin != "off", False
    for step in story.steps:
        yield step, held, powered, waiting
        if step.verb == "keys":
            held = int(step.what, 2)
        elif step.verb == "power":
            powered = step.what == "on"
            waiting = powered and held == BOTH


@settings(max_examples=10, deadline=None)
@given(family=st.sampled_from(sorted(FAMILIES)), number=st.integers(0, 50), codes=ANY)
def test_any_row_of_numbers_can_be_played(family: str, number: int, codes: list[int]) -> None:
    """On the right model nothing is wrong with it."""
    assert LAB.play(told(family, number, codes)) is None


@settings(max_examples=30, deadline=None)
@given(family=st.sampled_from(sorted(FAMILIES)), number=st.integers(0, 50), codes=ANY)
def test_what_the_source_leaves_open_is_avoided(
    family: str, number: int, codes: list[int]
) -> None:
    """Both commissioning keys are held at no reset and with no others at a power-on (COM-28)."""
    for step, held, powered, waiting in situations(told(family, number, codes)):
        if step.verb == "nmt" and step.what.startswith("reset") and not waiting:
            assert held & BOTH != BOTH
        if step.verb == "power":
            assert (step.what == "on") is not powered
            assert step.what == "off" or held & BOTH != BOTH or held == BOTH
        if step.verb == "keys":
            assert int(step.what, 2) != held
        if step.verb == "request":
            assert waiting


@settings(max_examples=30, deadline=None)
@given(family=st.sampled_from(sorted(FAMILIES)), codes=st.lists(st.integers(0, 999), max_size=9))
def test_the_same_numbers_are_the_same_scenario(family: str, codes: list[int]) -> None:
    """Nothing but the numbers decides."""
    assert told(family, 1, codes) == told(family, 1, list(codes))


@pytest.mark.parametrize("family", sorted(FAMILIES))
def test_a_family_is_made_of_known_words(family: str) -> None:
    """Beginning, parameters and actions are ones that a scenario can have."""
    kind = FAMILIES[family]
    assert kind.begin in BEGINNINGS
    assert kind.weight >= 1
    for number, given_ in enumerate(kind.givens):
        assert {name for name, _ in given_} <= set(GIVEN)
        assert all(value in GIVEN[name] for name, value in given_)
        assert all(span_ns >= 0 for span_ns in kind.spans(dict(given_)))
        assert kind.codes(given_) == len(kind.actions) * len(kind.spans(dict(given_)))
        every = range(0, kind.codes(given_), len(kind.spans(dict(given_))))
        story = told(family, number, list(every))
        assert scenario(str(story)) == story
        assert {step.verb for step in story.steps} <= set(WORDS)


@pytest.mark.parametrize("family", sorted(FAMILIES))
@settings(max_examples=5, deadline=None)
@given(data=st.data())
def test_a_strategy_draws_scenarios_of_its_family(family: str, data: st.DataObject) -> None:
    """With its beginning and one of its givens, and never another."""
    kind = FAMILIES[family]
    story = data.draw(scenarios(family))
    assert story.begin == kind.begin
    assert story.given in kind.givens
    assert story == scenario(str(story))


def test_turns_go_round_by_weight() -> None:
    """Every family is walked, each as often as it weighs."""
    order = list(turns())
    assert {name: order.count(name) for name in FAMILIES} == {
        name: family.weight for name, family in FAMILIES.items()
    }
    assert order[: len(FAMILIES)] == list(FAMILIES)


@pytest.mark.parametrize("debounce", [0, 1, 2, 5])
def test_spans_stand_on_both_sides_of_the_limits(debounce: int) -> None:
    """There are spans just below and just above each limit of the keys."""
    spans = near_limits({"debounce": debounce})
    assert list(spans) == sorted(set(spans))
    for limit_ms in (100 * debounce - 10, 100 * debounce, 100 * debounce + 10):
        if limit_ms > 0:
            assert {(limit_ms - 2) * MS, (limit_ms + 2) * MS} <= set(spans)


def test_noise_is_never_a_service_of_the_device() -> None:
    """No NMT, no 4F8h that is valid, no LED frame: what must change nothing changes nothing."""
    for text in NOISE:
        frame, relative = sent(text.partition(" ")[2])
        plain = not frame.extended and not frame.remote
        assert frame.can_id != 0
        assert not (plain and not relative and frame.can_id & ~0xF in {0x200, 0x300})
        assert not (plain and frame.can_id == 0x4F8 and len(frame.data) >= 6)
        assert not (plain and relative and frame.can_id in {0x200, 0x300})


# How actions become steps.


def steps_of(*actions: str, powered: bool = True) -> list[str]:
    """The steps that some actions come to, 1 ms apart."""
    teller = Teller(0, powered=powered)
    for action in actions:
        teller.tell(1 * MS, action)
    return [str(step) for step in teller.steps]


def test_keys_are_flipped() -> None:
    """What is held is turned over; nothing moves where nothing changes."""
    assert steps_of("flip 1", "flip 11", "flip 10") == ["1ms keys 1", "1ms keys 10", "1ms keys 0"]
    assert steps_of("flip 0") == []


def test_a_cycle_is_a_regular_start() -> None:
    """The commissioning keys are let go of, others stay held."""
    assert steps_of("cycle") == ["1ms power off", "200ms power on"]
    assert steps_of("cycle", powered=False) == ["200ms power on"]
    assert steps_of("flip 100", "cycle")[1:] == ["1ms power off", "200ms power on"]
    assert steps_of("flip 11", "cycle")[1:] == ["1ms power off", "0ms keys 0", "200ms power on"]


def test_pauses_stand_at_the_least_and_above() -> None:
    """The supply is off for as short as is allowed, and for longer."""
    least_ms = LAB.bench.profile.limits.power_off_ns // MS
    assert least_ms == CYCLE_MS < OFF_MS


def test_the_way_to_be_commissioned() -> None:
    """Power off, both keys, power on; then a request, time to store, and a regular start."""
    waits = ["1ms power off", "0ms keys 11", "300ms power on"]
    assert steps_of("wait-mode") == waits
    data = REQUESTS[0].partition(" ")[2]
    assert steps_of("commission 0") == [
        *waits,
        f"1ms request {data}",
        "502ms power off",
        "0ms keys 0",
        "200ms power on",
    ]
    assert steps_of("cut 1")[-3:] == ["1ms power off", "0ms keys 0", "200ms power on"]


def test_a_reset_with_both_keys_held_is_left_out() -> None:
    """Unless the device was powered up with them and waits, where it ignores it."""
    assert steps_of("flip 11", "nmt reset-node") == ["1ms keys 11"]
    assert steps_of("wait-mode", "nmt reset-node")[-1] == "1ms nmt reset-node"
    assert steps_of("flip 11", "nmt stop")[-1] == "1ms nmt stop"


def test_special_values_are_commissioned_and_shown() -> None:
    """The whole procedure, beats enough, and a press and a release, each as long as it needs."""
    number = 2 + 4 * 5  # debounce time 5
    request = value(number)
    assert steps_of(f"value {number}")[-8:] == [
        "0ms keys 0",
        "200ms power on",
        "1ms nmt start",
        "4s wait",
        "1ms keys 100",
        "650ms wait",
        "1ms keys 0",
        "650ms wait",
    ]
    assert f"1ms request {request}" in steps_of(f"value {number}")


def test_lights_are_looked_at_around_frames_that_must_light_none() -> None:
    """For the old node id, and for the new one where a valid request has named it."""
    waits = steps_of("wait-mode")
    dark = ["1ms look", "0ms look", "0ms led FF"]
    assert steps_of("wait-mode", "shine")[len(waits) :] == [*dark, "0ms look"]
    asked = ["request 00", "request 100200640001", "request 0A0200640001", "request 010200640001"]
    told_ = steps_of("wait-mode", *asked, "shine")
    assert told_[len(waits) + len(asked) :] == [*dark, "0ms send 20A#FF", "0ms look"]
    assert steps_of("wait-mode", *asked, "wait-mode", "shine")[-2:] == ["0ms led FF", "0ms look"]


def test_a_tally_is_one_thing_many_times() -> None:
    """More often than a byte counts, in turn where there are two."""
    for number, acts in enumerate(TALLIES):
        told_ = steps_of(f"again {number}")
        assert len(told_) == MANY > 256
        assert len(set(told_)) <= len(acts) * 2
    assert steps_of("again 0")[:3] == ["1ms keys 1", "1ms keys 0", "1ms keys 1"]


def test_a_request_where_nobody_waits_is_noise() -> None:
    """It is sent as any frame is, and claims nothing."""
    assert steps_of("request 06", "request -") == ["1ms send 4F8#06", "1ms send 4F8#"]
    assert steps_of("wait-mode", "any-request")[-1].startswith("1ms request ")


def test_lingering_is_longer_than_the_longest_heartbeat() -> None:
    """Nothing that a device can be commissioned to takes as long."""
    (step,) = steps_of("linger")
    assert scenario(f"off: {step}").span_ns > 65_536 * MS
