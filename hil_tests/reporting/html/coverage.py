"""What a run says of each requirement, with the faulty models that are aimed at it.

How a requirement stands is worked out in `results.json`; here it meets its text, and those
of the catalogue that no test came to.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

from hil_tests.clock import show_span
from hil_tests.reporting.html.facts import fact, table_of, words
from hil_tests.reporting.results_reader import Results

UNTESTED = "untested"


@dataclass(frozen=True, slots=True)
class Proof:
    """Faulty models that are aimed at a requirement.

    Args:
        aimed: names of those that violate it.
        killed: names of those among them that some test found; None = never tried here.
    """

    aimed: tuple[str, ...] = ()
    killed: tuple[str, ...] | None = None


@dataclass(frozen=True, slots=True)
class Covered:
    """One requirement and what was found of it.

    Args:
        id: of the requirement.
        entry: of the catalogue: text, class, source, clause; empty = it is not in it.
        standing: as `results.json` has it; empty = untested.
        proof: the faulty models.
    """

    id: str
    entry: Mapping[str, Any]
    standing: Mapping[str, Any] = field(default_factory=dict)
    proof: Proof = field(default_factory=Proof)

    @property
    def outcome(self) -> str:
        """The gravest outcome; "untested" where there is none."""
        return str(self.standing.get("outcome") or UNTESTED)

    @property
    def pairs(self) -> list[tuple[str, Any]]:
        """Outcome and how many tests said so."""
        return list(table_of(self.standing, "pairs").items())

    @property
    def tests(self) -> list[int]:
        """Numbers of the tests that say something of it."""
        found = self.standing.get("tests")
        return [each for each in found if isinstance(each, int)] if isinstance(found, list) else []

    @property
    def notes(self) -> list[str]:
        """What the device does where the source leaves it open."""
        return words(self.standing, "characteristics")

    @property
    def worst_test(self) -> int | None:
        """The test with the worst margin."""
        found = fact(self.standing, "margin", "test")
        return found if isinstance(found, int) else None

    @property
    def margin(self) -> str:
        """The worst margin in time and in units of doubt; "" = nothing was measured."""
        span_ns = fact(self.standing, "margin", "ns")
        doubts = fact(self.standing, "margin", "doubts")
        if not isinstance(span_ns, int) or not isinstance(doubts, int | float):
            return ""
        return show_margin(span_ns, doubts)


def show_margin(span_ns: int, doubts: float) -> str:
    """A margin for people; an exact measurement has no doubt to be compared with."""
    if doubts == span_ns:
        return f"{show_span(span_ns)} (exact)"
    shown = f"{doubts:.1f}" if abs(doubts) < 100 else f"{doubts:,.0f}".replace(",", "\u202f")
    return f"{show_span(span_ns)} = {shown} × doubt"


def cover(results: Results, proofs: Mapping[str, Proof]) -> list[Covered]:
    """Every requirement of the run's catalogue, and those that only its results name.

    In the order of the catalogue; what was not tested comes last.
    """
    catalogue = table_of(results.run, "requirements")
    names = dict.fromkeys((*catalogue, *results.requirements))
    found = [
        Covered(
            name,
            table_of(catalogue, name),
            table_of(results.requirements, name),
            proofs.get(name, Proof()),
        )
        for name in names
        if name
    ]
    return sorted(found, key=lambda covered: covered.outcome == UNTESTED)


def proofs_of(aimed: Mapping[str, Iterable[str]], matrix: Mapping[str, Any]) -> dict[str, Proof]:
    """The faulty models of each requirement.

    Args:
        aimed: requirement -> names of the models that violate it.
        matrix: `matrix.json`, or an empty mapping.
    """
    mutants = table_of(matrix, "mutants")
    table: dict[str, list[str]] = {name: list(each) for name, each in aimed.items()}
    for name, mutant in mutants.items():
        for requirement in words(mutant, "violates"):
            known = table.setdefault(requirement, [])
            if name not in known:
                known.append(str(name))
    killed = {name for name, mutant in mutants.items() if fact(mutant, "killed_by")}
    return {
        name: Proof(tuple(models), tuple(m for m in models if m in killed) if mutants else None)
        for name, models in table.items()
    }
