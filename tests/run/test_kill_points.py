"""SIGKILL at many moments of a run: what lies on the disk is valid, and says "interrupted"."""

from __future__ import annotations

import json
import os
import signal
import subprocess
from collections.abc import Sequence
from pathlib import Path

import pytest

from hil_tests.reporting.check import check_run
from hil_tests.reporting.pcapng import read_pcapng
from hil_tests.reporting.results import ResultsFile, TestResult, VerdictRow
from hil_tests.reporting.results_reader import load_results
from hil_tests.reporting.schema import breaches, results_schema
from hil_tests.run import papers
from tests.host.test_process import free_channel
from tests.reporting.test_results import HEADER
from tests.run.harness import PREAMBLE, command, environment

pytestmark = pytest.mark.slow

MANY = """
@pytest.mark.requirement("NMT-02")
@pytest.mark.parametrize("number", range(1000))
def test_starts(bench, power, number):
    '''It starts.'''
    power.off()
    on = power.on()
    bench.expect(matchers.boot_up(bench.node_id), after=on, within=bench.profile.limits.boot_up_ns)
    bench.wait(10_000_000 * (number % 7))
"""


def valid(path: Path) -> int:
    """How many results it holds; it is JSON of the schema as it stands, and says interrupted."""
    document = json.loads(path.read_bytes())
    assert list(breaches(document, results_schema())) == []
    assert (document["state"], document["finished"]) == ("interrupted", False)
    return len(document["results"])


def killed_after(folder: Path, results: int, options: Sequence[str], tests: str = MANY) -> Path:
    """The folder of a run of `tests` that was killed when so many results were there."""
    (folder / "test_device.py").write_text(PREAMBLE + tests, "utf-8")
    path = folder / "reports" / "latest" / "results.json"
    with subprocess.Popen(
        command(folder, *options),
        cwd=folder,
        env=environment(),
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    ) as process:
        try:
            while not path.exists() or path.read_bytes().count(b'"number":') < results:
                assert process.poll() is None
                os.sched_yield()
        finally:
            process.send_signal(signal.SIGKILL)
    return path.parent


def looked_at(run: Path, results: int) -> None:
    """The run is sound, its recordings can be read, and its report can be made."""
    assert valid(run / "results.json") >= results
    assert check_run(run) == []
    found = load_results(run / "results.json")
    if found.under_way is not None:
        assert found.under_way["test"].endswith("]")
        list(read_pcapng(run / found.under_way["trace"]))
    assert "nterrupted" in papers.make_again(run).read_text("utf-8")


@pytest.mark.parametrize("results", [0, 1, 2, 17, 60])
def test_a_run_in_virtual_time_can_be_killed_at_any_moment(tmp_path: Path, results: int) -> None:
    """Before the first test, and after some or many."""
    looked_at(killed_after(tmp_path, results, []), results)


@pytest.mark.parametrize("results", [0, 1, 4])
def test_a_run_in_real_time_can_be_killed_at_any_moment(tmp_path: Path, results: int) -> None:
    """With a hosted model on a bus of its own."""
    options = ["--can-interface=udp_multicast", f"--can-iface={free_channel()}"]
    looked_at(killed_after(tmp_path, results, options), results)


def write_for_ever(path: Path) -> None:
    """Results of every length, as fast as it goes."""
    with ResultsFile(path, HEADER) as file:
        for number in range(10**9):
            rows = [VerdictRow("HB-01", "passed", "x" * (number * 97 % 9000), (number, number))]
            file.begin(f"t::{number}", None)
            file.add(TestResult(f"t::{number}", "passed", verdicts=rows).to_json())


def test_not_even_the_middle_of_a_write_can_tear_the_results(tmp_path: Path) -> None:
    """A writer that does nothing else is killed fifteen times, wherever it stands."""
    for attempt in range(15):
        path = tmp_path / str(attempt) / "results.json"
        path.parent.mkdir()
        writer = os.fork()
        if not writer:
            write_for_ever(path)
            os._exit(1)
        size = 3000 + attempt * 7919 % 100_000
        while not path.exists() or path.stat().st_size < size:
            os.sched_yield()
        os.kill(writer, signal.SIGKILL)
        os.waitpid(writer, 0)
        assert valid(path) > 0 or size < 20_000
        assert check_run(path) == []
