"""Seeded walks: the scenario with a number is the same for everybody who names the seed."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from random import Random

from hil_tests.scenarios.families import FAMILIES, turns
from hil_tests.scenarios.grammar import told
from hil_tests.scenarios.scenario import Scenario

STEPS = 20
"""Actions of a walk."""

LONG_STEPS = 6
"""Of a family whose steps last long."""

_STRIDE = 1_000_003
"""A prime, so that neighbouring seeds share no walk."""


def walk(seed: int, number: int, families: Sequence[str] = ()) -> Scenario:
    """The scenario of that number.

    Args:
        seed: of the exploration.
        number: 0, 1, 2, ...; the families take turns.
        families: walk these alone; none = all, as often as they weigh.
    """
    order = tuple(families) or tuple(turns())
    random = Random(seed * _STRIDE + number)
    name = order[number % len(order)]
    family = FAMILIES[name]
    given = random.randrange(len(family.givens))
    codes = family.codes(family.givens[given])
    count = LONG_STEPS if name == "long" else STEPS
    return told(name, given, [random.randrange(codes) for _ in range(count)])


def walks(
    seed: int, families: Sequence[str] = (), start: int = 0, stride: int = 1
) -> Iterator[Scenario]:
    """Scenario after scenario, for ever.

    Args:
        seed: of the exploration.
        families: as of `walk`.
        start: number of the first one.
        stride: from number to number; as many workers share an exploration.
    """
    number = start
    while True:
        yield walk(seed, number, families)
        number += stride
