"""From all known faults to a small set of scenarios that shows each of them.

For each fault: one of the scenarios that are there already, or else the first walk that shows
it, made small. What shows nothing that others do not show goes again.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain, count

from hil_tests.explore.lab import Lab
from hil_tests.explore.shrink import shrink
from hil_tests.explore.walks import walk
from hil_tests.scenarios.corpus import Stored, claims_of
from hil_tests.scenarios.scenario import Scenario

Clock = Callable[[], float]


@dataclass(frozen=True, slots=True)
class Target:
    """A fault to be shown.

    Args:
        name: of the model.
        violates: requirements that it breaks.
    """

    name: str
    violates: frozenset[str]


class Distiller:
    """Finds a scenario for each of some faults.

    Args:
        profile: name or file.
        seed: of the walks.
        patience_s: how long one fault is looked for.
        clock: seconds, of the processor or of the wall.
    """

    def __init__(self, profile: str, seed: int, patience_s: float, clock: Clock) -> None:
        self._profile = profile
        self._seed = seed
        self._patience_s = patience_s
        self._clock = clock

    def show(self, target: Target, known: Sequence[Stored]) -> Stored | None:
        """A scenario that shows a fault: a known one, or a new one; None = none was found."""
        lab = Lab(self._profile, target.name)
        for each in known:
            if self._shows(lab, target, each.scenario):
                return each
        found = self._hunt(lab, target)
        if found is None:
            return None
        small = shrink(found, lambda story: self._shows(lab, target, story))
        finding = lab.play(small)
        broken = finding.requirements & target.violates if finding else frozenset()
        claims = tuple(sorted(broken)) or claims_of(small)
        return Stored(_free_name(target.name, known), small, claims, (target.name,))

    def _shows(self, lab: Lab, target: Target, story: Scenario) -> bool:
        """Whether the fault is blamed on a requirement that it violates."""
        finding = lab.play(story)
        return finding is not None and bool(finding.requirements & target.violates)

    def _hunt(self, lab: Lab, target: Target) -> Scenario | None:
        ends_at = self._clock() + self._patience_s
        for number in count():
            story = walk(self._seed, number)
            if self._shows(lab, target, story):
                return story
            if self._clock() > ends_at:
                return None
        raise AssertionError  # pragma: no cover - there is always another number


def _free_name(name: str, known: Sequence[Stored]) -> str:
    """The name, or with a number where an older scenario bears it."""
    taken = {each.name for each in known}
    numbered = (f"{name}-{number}" for number in count(2))
    return next(each for each in chain((name,), numbered) if each not in taken)


def finds(profile: str, stories: Sequence[Stored], target: Target) -> Iterator[str]:
    """The names of the stored scenarios that show a fault."""
    lab = Lab(profile, target.name)
    for each in stories:
        finding = lab.play(each.scenario)
        if finding is not None and finding.requirements & target.violates:
            yield each.name


def thinned(stories: Sequence[Stored], shown: Mapping[str, Sequence[str]]) -> list[Stored]:
    """The fewest seconds that still show every fault, greedily.

    Args:
        stories: to choose from.
        shown: names of the scenarios that show it, by fault.
    """
    by_story = {
        each.name: {fault for fault, names in shown.items() if each.name in names}
        for each in stories
    }
    open_faults = {fault for fault, names in shown.items() if names}
    chosen: list[Stored] = []
    while open_faults:
        best = max(stories, key=lambda each: len(by_story[each.name] & open_faults) / each.cost_ns)
        chosen.append(best)
        open_faults -= by_story[best.name]
    return [
        each._replace(finds=tuple(sorted(by_story[each.name])))
        for each in stories
        if each in chosen
    ]
