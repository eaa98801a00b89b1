"""Walks: the same seed and number is the same scenario for everybody."""

from __future__ import annotations

from random import Random

import pytest

from hil_tests.explore.walks import drawn, swept, walk
from hil_tests.scenarios.families import FAMILIES, turns
from hil_tests.scenarios.scenario import scenario
from hil_tests.scenarios.values import VALUES, value


def test_a_walk_is_repeated_by_seed_and_number() -> None:
    """In another process, in another order, next year."""
    assert walk(3, 17) == walk(3, 17)


def test_another_seed_walks_elsewhere() -> None:
    """Neighbouring seeds share no walk, nor do neighbouring numbers."""
    seen = [walk(seed, number) for seed in range(4) for number in range(30)]
    assert len(set(seen)) == len(seen)


@pytest.mark.parametrize("below", [1, 2, 3, 64, 65, 1000])
def test_numbers_are_those_of_randrange(below: int) -> None:
    """So walks stay what they were, and the generator goes on from the same place."""
    one, other = Random(5), Random(5)
    assert drawn(one, below, 50) == [other.randrange(below) for _ in range(50)]
    assert one.random() == other.random()


@pytest.mark.parametrize(("below", "count"), [(1, 1), (2, 3), (42, 1), (1024, 2), (12, 5)])
def test_sweeps_leave_nothing_out(below: int, count: int) -> None:
    """After as many turns as it takes each number was among them, whatever the seed."""
    for seed in (0, 7):
        turns_ = range(-(-below // count))
        found = [number for turn in turns_ for number in swept(seed, turn, below, count)]
        assert set(found) == set(range(below))


def test_walks_sweep_among_others_and_then_draw() -> None:
    """Each special value is commissioned in the first turns of its family, and no turn is lost."""
    order = turns()
    numbers = [
        number for number in range(200 * len(order)) if order[number % len(order)] == "values"
    ]
    walks = [walk(3, number) for number in numbers[: VALUES // FAMILIES["values"].walk]]
    asked = [step.what for story in walks for step in story.steps if step.verb == "request"]
    assert sorted(asked) == sorted(map(value, range(VALUES)))
    assert walk(3, numbers[len(walks)]).steps != walks[0].steps
    assert not FAMILIES["keys"].sweeps


def test_families_take_turns() -> None:
    """Each as often as it weighs; named ones alone."""
    order = list(turns())
    for number, name in enumerate(order):
        assert walk(0, number).begin == FAMILIES[name].begin
    assert {walk(0, number, ("lights", "starts")).begin for number in range(6)} == {
        "operational",
        "off",
    }
    assert {walk(0, number, ("waits",)).begin for number in range(6)} == {"off"}


@pytest.mark.parametrize("family", sorted(FAMILIES))
def test_a_walk_reads_back_from_its_text(family: str) -> None:
    """What is printed is what was played."""
    for number in range(3):
        story = walk(9, number, (family,))
        assert scenario(str(story)) == story


def test_a_walk_has_a_row_of_actions() -> None:
    """Fewer in a family whose steps last long."""
    assert len(walk(0, 0, ("commands",)).steps) == FAMILIES["commands"].walk
    assert len(walk(0, 0, ("long",)).steps) <= FAMILIES["long"].walk
