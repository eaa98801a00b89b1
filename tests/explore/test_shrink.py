"""Making a finding small: it goes on failing, gets smaller, and comes to an end."""

from __future__ import annotations

from hypothesis import given, settings
from hypothesis import strategies as st

from hil_tests.clock import MS
from hil_tests.explore.lab import Lab
from hil_tests.explore.shrink import shrink
from hil_tests.explore.walks import walk
from hil_tests.scenarios.scenario import Scenario, scenario


def verbs(story: Scenario) -> list[str]:
    """What is done, one after the other."""
    return [step.verb for step in story.steps]


def test_what_cannot_be_smaller_stays_as_it_is() -> None:
    """The very scenario, where nothing smaller fails."""
    found = scenario("operational: 20ms keys 1; 30ms keys 0")
    assert shrink(found, lambda _: False) == found


def test_what_always_fails_becomes_nothing() -> None:
    """No step and no parameter is left."""
    found = walk(0, 3, ("everything",))
    assert shrink(found, lambda _: True).steps == ()
    assert shrink(scenario("operational debounce=2:"), lambda _: True) == scenario("operational:")


def test_steps_that_matter_are_kept_in_their_order() -> None:
    """The others go, their time with them."""
    found = scenario(
        "operational debounce=2: 20ms keys 1; 30ms led 01; 400ms nmt stop; 7ms look; 5ms keys 0"
    )

    def fails(story: Scenario) -> bool:
        kept = [verb for verb in verbs(story) if verb in {"led", "look"}]
        return kept == ["led", "look"]

    assert shrink(found, fails) == scenario("operational: 0ms led 01; 0ms look")


def test_time_that_matters_is_kept() -> None:
    """A step that is left out leaves its time where that is what fails; spans get round."""
    found = scenario("operational: 37ms keys 1; 77ms keys 0; 91ms wait")
    small = shrink(found, lambda story: story.span_ns >= 100 * MS)
    assert [step.after_ns for step in small.steps] == [100 * MS]


def test_parameters_that_do_not_matter_go() -> None:
    """Unless the scenario writes: what it is commissioned to before belongs to it."""
    found = scenario("operational debounce=2 node_id=6: 0ms wait")
    small = shrink(found, lambda story: story.parameters.get("node_id") == 6)
    assert str(small) == "operational node_id=6:"
    writes = scenario("off debounce=2: 0ms request 06")
    assert shrink(writes, lambda story: story.writes).parameters == {"debounce": 2}


def test_it_ends() -> None:
    """After so many tries at the latest, with the smallest that was found by then."""
    played: list[Scenario] = []

    def fails(story: Scenario) -> bool:
        played.append(story)
        return len(story.steps) > 3

    found = walk(0, 1, ("keys",))
    small = shrink(found, fails, tries=7)
    assert len(played) == 7
    assert len(small.steps) <= len(found.steps)
    assert shrink(found, fails, tries=0) == found


@settings(max_examples=20, deadline=None)
@given(number=st.integers(0, 200), verb=st.sampled_from(["keys", "nmt", "led", "send", "wait"]))
def test_what_comes_out_fails_and_is_no_larger(number: int, verb: str) -> None:
    """Whatever is looked for: never more steps, never more time."""
    found = walk(1, number)

    def fails(story: Scenario) -> bool:
        return verb in verbs(story)

    if fails(found):
        small = shrink(found, fails)
        assert fails(small)
        assert len(small.steps) <= len(found.steps)
        assert small.span_ns <= found.span_ns
        assert verbs(small) == [verb]


def test_a_real_finding() -> None:
    """On a faulty model, a walk of twenty actions comes down to the few that show it."""
    lab = Lab(model="key-frame-doubled")
    found = next(
        story
        for story in (walk(2, number, ("keys",)) for number in range(20))
        if lab.play(story) is not None
    )

    def fails(story: Scenario) -> bool:
        finding = lab.play(story)
        return finding is not None and "KEY-06" in finding.requirements

    small = shrink(found, fails)
    assert fails(small)
    assert len(small.steps) <= 2
    assert small.span_ns <= 500 * MS
