"""Scenarios are one line of text: what it says is what it means, and wrong text is explained."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hil_tests.clock import MS, US, S
from hil_tests.scenarios.families import FAMILIES
from hil_tests.scenarios.scenario import LONGEST_NS, Scenario, Step, scenario
from hil_tests.scenarios.strategies import scenarios

EXAMPLE = "operational debounce=2 heartbeat_ms=50: 20ms keys 1; 188ms keys 0; 5ms nmt stop all"


@settings(max_examples=40, deadline=None)
@given(story=st.sampled_from(sorted(FAMILIES)).flatmap(scenarios))
def test_every_scenario_is_its_own_text(story: Scenario) -> None:
    """Made up in any family, it reads back from its line, and its repr makes it again."""
    text = str(story)
    assert scenario(text) == story
    assert "\n" not in text
    assert text.isascii()
    assert '"' not in text
    assert eval(repr(story), {"scenario": scenario}) == story  # noqa: S307


def test_what_a_line_says() -> None:
    """Beginning, parameters in their order, steps with span, verb and what it acts on."""
    assert scenario(EXAMPLE) == Scenario(
        "operational",
        (("debounce", 2), ("heartbeat_ms", 50)),
        (
            Step(20 * MS, "keys", "1"),
            Step(188 * MS, "keys", "0"),
            Step(5 * MS, "nmt", "stop all"),
        ),
    )
    assert str(scenario(EXAMPLE)) == EXAMPLE


def test_blanks_and_empty_steps_mean_nothing() -> None:
    """What is pasted with other blanks, or with a semicolon at its end, is the same."""
    loose = "  operational   debounce=2 heartbeat_ms=50 :20ms  keys   1;188ms keys 0;;"
    loose += " 5ms nmt  stop \t all ; "
    assert scenario(loose) == scenario(EXAMPLE)
    assert scenario("off:").steps == ()
    assert str(scenario("off:")) == "off:"


@pytest.mark.parametrize(
    ("span_ns", "text"),
    [
        (0, "0ms"),
        (1, "1ns"),
        (1500, "1500ns"),
        (500 * US, "500us"),
        (20 * MS, "20ms"),
        (1500 * MS, "1500ms"),
        (70 * S, "70s"),
        (LONGEST_NS, "3600s"),
    ],
)
def test_spans_are_short_and_exact(span_ns: int, text: str) -> None:
    """The largest unit in which a span is a whole number."""
    assert str(Step(span_ns, "wait")) == f"{text} wait"
    assert scenario(f"off: {text} wait").steps == (Step(span_ns, "wait"),)


def test_spans_may_be_written_in_any_unit() -> None:
    """A fraction and minutes are as good."""
    for text in ("90s", "1.5min", "90000ms"):
        assert scenario(f"off: {text} wait").span_ns == 90 * S


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "a scenario is BEGINNING NAME=VALUE...: STEP; STEP..., not ''"),
        ("operational 20ms keys 1", "a scenario is BEGINNING"),
        (": 20ms keys 1", "unknown beginning ''; there is off, pre-operational, operational"),
        ("opertional: 20ms keys 1", "unknown beginning 'opertional'; there is operational"),
        ("off debonce=1: 0ms wait", "unknown parameter 'debonce'; there is debounce"),
        ("off debounce: 0ms wait", "'debounce': debounce is a number from 0 to 255"),
        ("off debounce=: 0ms wait", "debounce is a number from 0 to 255"),
        ("off debounce=256: 0ms wait", "'debounce=256': debounce is a number from 0 to 255"),
        ("off debounce=-1: 0ms wait", "debounce is a number from 0 to 255"),
        ("off node_id=0: 0ms wait", "'node_id=0': node_id is a number from 1 to 15"),
        ("off node_id=16: 0ms wait", "node_id is a number from 1 to 15"),
        ("off heartbeat_ms=65536: 0ms wait", "heartbeat_ms is a number from 0 to 65535"),
        ("off: keys", "step 'keys': write when and what, e.g. 20ms keys 1"),
        ("off: 20ms", "step '20ms': write when and what"),
        ("off: 20 keys 1", "step '20 keys 1': '20' is no time"),
        ("off: soon keys 1", "step 'soon keys 1': 'soon' is no time"),
        ("off: 3601s wait", "step '3601s wait': a step waits an hour at most"),
        ("off: 0ms kays 1", "unknown verb 'kays'; there is keys"),
        ("off: 0ms sleep", "unknown verb 'sleep'; there is"),
        ("off: 0ms keys", "step '0ms keys': write keys BITS"),
        ("off: 0ms keys 12", "step '0ms keys 12': write keys BITS"),
        ("off: 0ms keys " + 65 * "1", "a keypad has 64 keys at most"),
        ("off: 0ms wait; 0ms nmt halt", "step '0ms nmt halt': write nmt COMMAND"),
        ("off: 0ms wait for it", "step '0ms wait for it': write wait: nothing is done"),
    ],
)
def test_wrong_text_is_explained(text: str, said: str) -> None:
    """The error names the step or the word, and what was meant."""
    with pytest.raises(ValueError, match=r"\w") as caught:
        scenario(text)
    assert said in str(caught.value)


@settings(max_examples=30, deadline=None)
@given(text=st.text("off: 01keyspwrndm;#=+%RlA\0é٣", max_size=20))
def test_any_text_is_a_scenario_or_explained(text: str) -> None:
    """Nothing but ValueError, whatever is pasted."""
    for line in (text, f"off: 0ms {text}", f"off {text}: 0ms wait"):
        try:
            story = scenario(line)
        except ValueError as error:
            assert str(error)
        else:
            assert scenario(str(story)) == story


def test_what_it_tells_of_itself() -> None:
    """Span, parameters, what it needs and whether it writes can be seen before it is played."""
    story = scenario(EXAMPLE)
    assert story.span_ns == 213 * MS
    assert story.parameters == {"debounce": 2, "heartbeat_ms": 50}
    assert story.needs == {"keys"}
    assert not story.writes
    assert scenario("off: 0ms wait").needs == {"power"}
    whole = scenario("off: 0ms request 06; 0ms look; 0ms rate own")
    assert whole.needs == {"power", "keys", "leds", "bitrate"}
    assert whole.writes
    assert scenario("operational: 0ms send 4F8#060200320001").writes
    assert not scenario("operational: 0ms send 4F9#060200320001").writes


def test_pulses_of_a_scenario() -> None:
    """Each key's stays between two of its edges."""
    text = "operational: 20ms keys 1; 30ms keys 11; 40ms nmt stop; 50ms keys 10; 60ms keys 0"
    assert list(scenario(text).pulses()) == [120 * MS, 150 * MS]
    assert list(scenario("operational: 0ms keys 1; 5ms keys 1").pulses()) == []
