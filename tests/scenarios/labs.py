"""Short words for playing scenarios on models in virtual time."""

from __future__ import annotations

from hil_tests.explore.lab import Lab
from hil_tests.judge.verdict import NotRun, Outcome
from hil_tests.scenarios.play import play
from hil_tests.scenarios.scenario import scenario


def broken(text: str, model: str | None = None, profile: str = "keypad") -> frozenset[str]:
    """The requirements that a model certainly breaks in a scenario."""
    finding = Lab(profile, model).play(scenario(text))
    return finding.requirements if finding else frozenset()


def first(text: str, model: str) -> str:
    """The requirement that is blamed first; "" = nothing is wrong."""
    finding = Lab(model=model).play(scenario(text))
    return finding.verdicts[0].requirement if finding else ""


def doubted(text: str, model: str | None = None) -> list[str]:
    """The requirements over which doubt decides.

    Raises:
        NotRun: the bench cannot play it.
    """
    lab = Lab(model=model)
    lab.bench.begin_example()
    found = play(lab.bench, scenario(text))
    return [each.requirement for each in found if each.outcome is Outcome.INCONCLUSIVE]


__all__ = ["NotRun", "broken", "doubted", "first"]
