"""Walks: the same seed and number is the same scenario for everybody."""

from __future__ import annotations

from random import Random

import pytest

from hil_tests.explore.walks import drawn, walk
from hil_tests.scenarios.families import FAMILIES, turns
from hil_tests.scenarios.scenario import scenario


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
