"""Lists for people: the mutants and variants that can be put under test."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping

NAME, IDS = 44, 70
"""Widths of the columns; the longest entries just fit."""


def mutant_table() -> str:
    """Every faulty and every different model, a line each."""
    from node_model.faults import MODELS, mutants_of, variants_of  # noqa: PLC0415 - on demand

    lines = []
    for kind in dict.fromkeys(each.kind for each in MODELS.values()):
        lines.append(f"faulty models of a {kind} (--can-mutant NAME):")
        for name, mutant in mutants_of(kind).items():
            lines.append(f"  {name:{NAME}s} {', '.join(mutant.violates):{IDS}s} {mutant.text}")
        lines.append(f"conforming models of a {kind} that are different:")
        for name, variant in variants_of(kind).items():
            lines.append(f"  {name:{NAME}s} {'':{IDS}s} {variant.text}")
    return "\n".join(lines)


def mutants_by_requirement() -> Mapping[str, list[str]]:
    """Requirement -> names of the faulty models that violate it."""
    from node_model.faults import MODELS, Mutant  # noqa: PLC0415 - on demand

    aimed: defaultdict[str, list[str]] = defaultdict(list)
    for name, model in MODELS.items():
        for requirement in model.violates if isinstance(model, Mutant) else ():
            aimed[requirement].append(name)
    return aimed
