"""Strategies: scenarios made up by Hypothesis, near the limits that matter.

A step is one small number, so that drawing is cheap and shrinking is quick; a mapped
strategy prints the scenario that it stands for.
"""

from __future__ import annotations

from functools import cache

from hypothesis import strategies as st

from hil_tests.scenarios.families import FAMILIES
from hil_tests.scenarios.grammar import told
from hil_tests.scenarios.scenario import Scenario

MOST_STEPS = 12


@cache
def scenarios(family: str, most: int = MOST_STEPS) -> st.SearchStrategy[Scenario]:
    """Scenarios of one family.

    Args:
        family: a key of `families.FAMILIES`.
        most: actions at most.
    """
    return st.one_of([_commissioned(family, number, most) for number in _numbers(family)])


def _numbers(family: str) -> range:
    return range(len(FAMILIES[family].givens))


def _commissioned(family: str, number: int, most: int) -> st.SearchStrategy[Scenario]:
    """Scenarios of a device that is commissioned as one of the family's givens says."""
    kind = FAMILIES[family]
    codes = st.integers(0, kind.codes(kind.givens[number]) - 1)
    return st.lists(codes, min_size=1, max_size=most).map(lambda row: told(family, number, row))
