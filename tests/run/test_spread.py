"""A run that pytest-xdist spreads over processes: one folder, one results.json, one verdict."""

from __future__ import annotations

from pathlib import Path

import pytest

from hil_tests.reporting.check import check_run
from hil_tests.reporting.results_reader import load_results
from tests.run.harness import judge_apart
from tests.run.test_kill_points import MANY, killed_after

pytestmark = pytest.mark.slow

SPREAD = ["-n", "2"]

TESTS = """
@pytest.mark.requirement("NMT-02")
@pytest.mark.parametrize("number", range(6))
def test_starts(bench, number):
    '''It starts.'''
    bench.start()

@pytest.mark.requirement("NMT-02")
def test_fails(bench):
    bench.start()
    assert False, "it does not"

@pytest.mark.requirement("NMT-02")
def test_lacks(bench):
    raise NotRun("no such thing here")
"""


def test_one_folder_holds_what_all_workers_found(tmp_path: Path) -> None:
    """Rows, traces, counts, sections and exit status are those of an unspread run."""
    run = judge_apart(tmp_path, TESTS, *SPREAD)
    assert run.status == 1, run.text
    assert len([path for path in run.reports.iterdir() if path.is_dir()]) == 2  # and latest
    assert check_run(run.folder) == []
    assert sorted(run.outcomes.values()) == ["failed", "not run", *["passed"] * 6]
    assert len(run.traces()) == 8
    assert run.results["state"] == "complete"
    assert run.results["run"]["command"][-2:] == SPREAD
    assert run.results["summary"]["frames"] >= run.results["totals"]["frames"] > 0
    assert "no such thing here" in run.section("not run")
    assert "6 passed, 1 failed, 1 not run" in run.section("nodeproof")
    assert run.text.count("seed: 0   bench: virtual") == 1
    assert run.text.count(f"written to: {run.folder.resolve()}") == 1


def test_a_run_without_tests_of_ours_leaves_no_folder(tmp_path: Path) -> None:
    """The plugin is inert in other people's projects, spread or not."""
    run = judge_apart(tmp_path, "def test_mine(): pass", *SPREAD)
    assert run.status == 0, run.text
    assert not run.reports.exists()


@pytest.mark.parametrize("option", ["--can-iface=vcan7", "--can-bench=desk.toml"])
def test_a_real_bus_has_one_tester(tmp_path: Path, option: str) -> None:
    """Two workers on it are refused before anything is touched, with the remedy."""
    run = judge_apart(tmp_path, TESTS, *SPREAD, option)
    assert run.status == 4
    name, _, value = option.partition("=")
    assert f"{name} {value} (command line): a bus has one tester at a time" in run.text
    assert "leave out -n" in run.text
    assert not run.reports.exists()


DIES = """
import os, signal

@pytest.mark.requirement("NMT-02")
@pytest.mark.parametrize("number", range(4))
def test_starts(bench, number):
    bench.start()

@pytest.mark.requirement("NMT-02")
def test_dies(bench):
    bench.start()
    os.kill(os.getpid(), signal.SIGKILL)
"""


def test_a_worker_that_dies_costs_its_test_alone(tmp_path: Path) -> None:
    """Its test is an error of ours; the others are judged, and the results are valid."""
    run = judge_apart(tmp_path, DIES, *SPREAD)
    assert run.status in {1, 11}, run.text
    assert run.outcomes["test_dies"] == "error"
    assert sorted(run.outcomes.values()) == ["error", *["passed"] * 4]
    assert check_run(run.folder) == []


NEVER_ENDS = """
import signal

@pytest.mark.requirement("NMT-02")
def test_waits(bench):
    bench.start()
    signal.pause()
"""


@pytest.mark.parametrize(("tests", "results"), [(NEVER_ENDS, 0), (MANY, 1), (MANY, 17)])
def test_a_spread_run_can_be_killed_at_any_moment(
    tmp_path: Path, tests: str, results: int
) -> None:
    """SIGKILL of the controller leaves what it was handed, from the first test on."""
    run = killed_after(tmp_path, results, SPREAD, tests)
    found = load_results(run / "results.json")
    assert (found.state, found.finished) == ("interrupted", False)
    assert len(found.results) >= results
    assert {result.outcome for result in found.results} <= {"passed"}
    assert check_run(run) == []
