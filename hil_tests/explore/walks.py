"""Seeded walks: the scenario with a number is the same for everybody who names the seed."""

from __future__ import annotations

from collections.abc import Sequence
from math import gcd
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
    turn = _turn(order, number) if family.sweeps else codes
    if turn * family.walk < codes:
        return told(name, given, swept(seed, turn, codes, family.walk))
    return told(name, given, drawn(random, codes, family.walk))


def _turn(order: Sequence[str], number: int) -> int:
    """How many walks of its family come before the one of that number."""
    rounds, place = divmod(number, len(order))
    return rounds * order.count(order[place]) + order[:place].count(order[place])


def swept(seed: int, turn: int, below: int, count: int) -> list[int]:
    """As `drawn`, but in some turns every number below has been among them once.

    Args:
        seed: where they begin.
        turn: how many rows came before.
        below: how many numbers there are.
        count: how many of them make a row.
    """
    stride = next(each for each in range(below * 5 // 8, 2 * below) if gcd(each, below) == 1)
    first = seed * _STRIDE + turn * count
    return [(first + index) * stride % below for index in range(count)]


def drawn(random: Random, below: int, count: int) -> list[int]:
    """What so many calls of `randrange(below)` return, in a third of the time."""
    bits, draw = below.bit_length(), random.getrandbits
    numbers: list[int] = []
    while len(numbers) < count:
        if (number := draw(bits)) < below:
            numbers.append(number)
    return numbers
