"""Seeded walks: the scenario with a number is the same for everybody who names the seed."""

from __future__ import annotations

from collections.abc import Sequence
from random import Random

from hil_tests.scenarios.families import FAMILIES, turns
from hil_tests.scenarios.grammar import told
from hil_tests.scenarios.scenario import Scenario

_STRIDE = 1_000_003
"""A prime, so that neighbouring seeds share no walk."""


def walk(seed: int, number: int, families: Sequence[str] = ()) -> Scenario:
    """The scenario of that number.

    Args:
        seed: of the exploration.
        number: 0, 1, 2, ...; the families take turns.
        families: walk these alone; none = all, as often as they weigh.
    """
    order = families or turns()
    random = Random(seed * _STRIDE + number)
    name = order[number % len(order)]
    family = FAMILIES[name]
    given = random.randrange(len(family.givens))
    codes = family.codes(family.givens[given])
    return told(name, given, drawn(random, codes, family.walk))


def drawn(random: Random, below: int, count: int) -> list[int]:
    """What so many calls of `randrange(below)` return, in a third of the time."""
    bits, draw = below.bit_length(), random.getrandbits
    numbers: list[int] = []
    while len(numbers) < count:
        if (number := draw(bits)) < below:
            numbers.append(number)
    return numbers
