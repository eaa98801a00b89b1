"""Making a finding small: fewer steps, shorter and rounder spans, as long as it still fails."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

from hil_tests.clock import MS
from hil_tests.scenarios.scenario import Scenario, Step

Test = Callable[[Scenario], bool]

_ROUND_MS = (0, 1, 2, 5, 10, 20, 50, 60, 100, 200, 300, 500, 1000, 2000)


def shrink(found: Scenario, fails: Test, tries: int = 400) -> Scenario:
    """A smaller scenario that still fails; the same one where there is none.

    Args:
        found: fails.
        fails: whether a scenario does; False also for one that cannot be played.
        tries: how many scenarios are played at most.
    """
    best, left = found, tries
    improved = True
    while improved and left > 0:
        improved = False
        for smaller in _smaller(best):
            left -= 1
            if fails(smaller):
                best, improved = smaller, True
                break
            if left <= 0:
                break
    return best


def _smaller(scenario: Scenario) -> Iterator[Scenario]:
    """Candidates, those that save most first."""
    steps = scenario.steps
    size = (len(steps) + 1) // 2
    while size:
        for start in range(0, len(steps), size):
            yield replace(scenario, steps=_without(steps, start, start + size, keep_time=False))
        for start in range(0, len(steps), size):
            yield replace(scenario, steps=_without(steps, start, start + size, keep_time=True))
        size //= 2
    for index, step in enumerate(steps):
        for span_ms in _ROUND_MS:
            if span_ms * MS < step.after_ns:
                shorter = step._replace(after_ns=span_ms * MS)
                yield replace(scenario, steps=(*steps[:index], shorter, *steps[index + 1 :]))
    if scenario.writes:
        return  # what it is commissioned to before is part of the story
    for index in range(len(scenario.given)):
        yield replace(scenario, given=scenario.given[:index] + scenario.given[index + 1 :])


def _without(
    steps: tuple[Step, ...], start: int, stop: int, *, keep_time: bool
) -> tuple[Step, ...]:
    """Without some steps; what follows comes earlier, or when it came before."""
    after = list(steps[stop:])
    if keep_time and after:
        gone_ns = sum(step.after_ns for step in steps[start:stop])
        after[0] = after[0]._replace(after_ns=after[0].after_ns + gone_ns)
    return (*steps[:start], *after)
