"""The bars of replay: a record gives the verdict that the bus gave, on every kind of fault.

Here a sample; `python -m tests.replay.every` does the same with all of them.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from hil_tests.run.opening import open_bench
from node_model.faults import MUTANTS
from tests.meta.proving import Suite, collect
from tests.replay.twice import concerned, record, replay

pytestmark = pytest.mark.slow

SAMPLE = (
    "boot-up-late",
    "boot-up-missing",
    "heartbeat-too-slow",
    "heartbeat-lost-every-seventh",
    "ignores-stop",
    "starts-stopped",
    "nmt-stops-echo",
    "echo-stops",
    "boot-up-while-waiting",
    "heartbeat-little-endian",
)


@pytest.fixture(scope="module")
def suite() -> Suite:
    """Every acceptance test."""
    return collect()


@pytest.mark.parametrize("name", SAMPLE)
def test_a_mutants_record_shows_its_fault(name: str, suite: Suite, tmp_path: Path) -> None:
    """Outcome, text and findings of each test are the same on its record."""
    plan = replace(suite.plan, mutant=name)
    bench = open_bench(plan)
    shown = set()
    for case in concerned(suite, MUTANTS[name].violates, 30):
        on_the_bus = record(case, bench, plan, tmp_path / "t.pcapng")
        assert replay(case, plan, tmp_path / "t.pcapng") == on_the_bus
        shown |= {finding.requirement for finding in on_the_bus.findings}
    assert shown & set(MUTANTS[name].violates)


def test_a_right_keypads_record_shows_none(suite: Suite, tmp_path: Path) -> None:
    """A test of each module."""
    plan = suite.plan
    bench = open_bench(plan)
    modules: set[str] = set()
    for case in concerned(suite, tuple(plan.requirements), len(suite.cases)):
        module = case.test.partition("::")[0]
        if module in modules:
            continue
        modules.add(module)
        on_the_bus = record(case, bench, plan, tmp_path / "t.pcapng")
        assert replay(case, plan, tmp_path / "t.pcapng") == on_the_bus
        assert on_the_bus.outcome == "passed"
    assert len(modules) > 10
