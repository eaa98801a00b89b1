"""Which stored scenarios a run plays: those of the command line, or those that fit its time."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import pytest

from hil_tests.clock import S, show_span
from hil_tests.errors import ConfigError
from hil_tests.scenarios.corpus import Stored, choose, claims_of, is_timed, stored
from hil_tests.scenarios.scenario import scenario

if TYPE_CHECKING:
    from _pytest.mark import ParameterSet

    from hil_tests.run.plan import Plan


def parameters(plan: Plan) -> list[ParameterSet]:
    """One parameter for each scenario; those that are left out say why.

    Raises:
        pytest.UsageError: a file of stored scenarios that cannot be read.
    """
    try:
        entries = list(_given(plan)) or list(stored(plan.profile.kind))
    except ConfigError as error:
        raise pytest.UsageError(str(error)) from None
    able = [each for each in entries if each.scenario.needs <= set(plan.facilities)]
    chosen = choose([each for each in able if plan.timed or not is_timed(each)], plan.budget_ns)
    return [
        _parameter(each, plan, left_out=each in able and each not in chosen) for each in entries
    ]


def _given(plan: Plan) -> Iterator[Stored]:
    """The scenarios of the command line; the plan has read each of them before."""
    for number, text in enumerate(plan.settings["can_scenario"], 1):
        story = scenario(text)
        yield Stored(f"given-{number}", story, claims_of(story), ())


def _parameter(each: Stored, plan: Plan, *, left_out: bool) -> ParameterSet:
    marks = [
        pytest.mark.requirement(*each.claims),
        pytest.mark.needs(*sorted(each.scenario.needs)),
    ]
    if is_timed(each):
        marks.append(pytest.mark.timed("it takes a bus load"))
    elif left_out:
        budget, cost = show_span(plan.budget_ns), show_span(-(-each.cost_ns // S) * S)
        why = f"left out of {budget} for stored scenarios (about {cost}); see --can-budget"
        marks.append(pytest.mark.skip(reason=why))
    return pytest.param(each, id=each.name, marks=marks)
