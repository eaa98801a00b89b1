"""The last lines of a run: five for each failure, one for each group of requirements."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from hil_tests.reporting.rows import TestResult, VerdictRow
from hil_tests.reporting.tally import Tally
from hil_tests.run.closing import group_lines
from tests.run.harness import Judged, judge

pytest_plugins = ["pytester"]

LATE = """
from hil_tests.clock import exactly

@pytest.mark.requirement("NMT-02")
def test_late(bench):
    '''Boot-up comes in time.'''
    bench.start()
    raise DeviceFailure(bench.record(
        Verdict("HB-01", Outcome.FAIL, "interval", exactly(7_000_000), Limits(1, 5_000_000), 42)
    ))

@pytest.mark.requirement("NMT-02")
def test_wrong(bench):
    '''It says five.'''
    bench.start()
    assert bench.node_id == 5
"""


def five(run: Judged, test: str) -> dict[str, str]:
    """The lines of a failure, by their first word."""
    _, _, rest = run.section("failed").partition(f"::{test}\n")
    pairs = (line.strip().partition(":") for line in rest.splitlines()[:5])
    return {name: text.strip() for name, _, text in pairs}


def test_a_failure_is_told_in_five_lines(pytester: pytest.Pytester) -> None:
    """Requirement, what was expected and measured, where to look, how to repeat."""
    run = judge(pytester, LATE)
    told = five(run, "test_late")
    assert list(told) == ["requirement", "expected", "measured", "trace", "repeat"]
    assert told["requirement"].startswith("HB-01 (timing; ")
    assert told["expected"] == "interval; at least 1 ns, at most 5 ms"
    assert told["measured"] == "7 ms: 2 ms beyond the limit"
    assert told["trace"].endswith(".pcapng, at 0.000000 s")
    assert Path(told["trace"].partition(", at")[0]).is_file()
    assert told["repeat"].startswith("pytest ")
    assert told["repeat"].endswith("::test_late")


def test_an_assertion_of_a_test_is_told_by_what_the_test_states(
    pytester: pytest.Pytester,
) -> None:
    """Where nothing was measured: the fact that it states, and the error."""
    told = five(judge(pytester, LATE), "test_wrong")
    assert told["requirement"].startswith("NMT-02 (must; ")
    assert told["expected"] == "It says five."
    assert told["measured"].startswith("AssertionError: ")
    assert ", at" not in told["trace"]


MANY = """
@pytest.mark.requirement("NMT-02")
@pytest.mark.parametrize("number", range(23))
def test_fails(bench, number):
    assert False
"""


def test_more_failures_than_a_screen_holds_are_counted(pytester: pytest.Pytester) -> None:
    """Twenty are told; the others stand in the report."""
    told = judge(pytester, MANY).section("failed")
    assert told.count("repeat:") == 20
    assert told.rstrip().endswith("and 3 more; the report has them all")


def row(name: str, outcome: str, measured: Any = None, limits: Any = None) -> dict[str, Any]:
    """A result with one verdict."""
    verdict = VerdictRow(name, outcome, "x", measured, limits)
    return TestResult("t", "passed", verdicts=[verdict]).to_json()


def test_each_group_tells_its_outcomes_and_who_came_nearest_to_a_limit() -> None:
    """The worst outcome first; the share of the room that is left, and the doubt it rests on."""
    tally = Tally()
    rows = [
        row("HB-01", "passed", (99, 101), (90, 110)),
        row("HB-02", "passed", (92, 94), (90, 110)),
        row("HB-03", "failed"),
        row("KEY-01", "failed", (11, 12), (None, 10)),
        row("LED-01", "passed"),
    ]
    for number, each in enumerate(rows, 1):
        tally.add(number, each)
    assert group_lines(tally.standings) == [
        "  HB   1 failed, 2 passed  narrowest: HB-02, 20.0% of the room left (1 times its doubt)",
        "  KEY  1 failed            narrowest: KEY-01, beyond its limit (-2 times its doubt)",
        "  LED  1 passed",
    ]
