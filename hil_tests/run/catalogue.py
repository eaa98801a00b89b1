"""Lists for people: the mutants and variants that can be put under test."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping

NAME, IDS = 44, 70
"""Widths of the columns; the longest entries just fit."""


def mutant_table() -> str:
    """Every faulty and every different model, a line each."""
    from node_model.faults import MUTANTS, VARIANTS  # noqa: PLC0415 - on demand

    lines = ["faulty models (--can-mutant NAME):"]
    for name, mutant in MUTANTS.items():
        lines.append(f"  {name:{NAME}s} {', '.join(mutant.violates):{IDS}s} {mutant.text}")
    lines.append("conforming models that are different:")
    for name, variant in VARIANTS.items():
        lines.append(f"  {name:{NAME}s} {'':{IDS}s} {variant.text}")
    return "\n".join(lines)


def mutants_by_requirement() -> Mapping[str, list[str]]:
    """Requirement -> names of the faulty models that violate it."""
    from node_model.faults import MUTANTS  # noqa: PLC0415 - on demand

    aimed: defaultdict[str, list[str]] = defaultdict(list)
    for name, mutant in MUTANTS.items():
        for requirement in mutant.violates:
            aimed[requirement].append(name)
    return aimed
