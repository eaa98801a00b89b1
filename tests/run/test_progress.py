"""Tests in real time that take long say so, on the bench's own calendar."""

from __future__ import annotations

from pathlib import Path

import pytest

from hil_tests.clock import MS, S
from hil_tests.run.progress import Progress
from tests.bench.test_bench import virtual
from tests.host.test_process import free_channel
from tests.run.harness import judge_apart


def test_it_tells_after_two_seconds_and_whenever_it_took_as_long_again() -> None:
    """Nothing for a short test; a long one is told of ever more rarely."""
    bench, said = virtual(), list[str]()
    bench.begin()
    Progress(said.append).begin(bench, "t.py::test_long[x]")
    bench.wait(2 * S - 1 * MS)
    assert said == []
    bench.wait(15 * S)
    spans = [line.partition(" has run for ")[2].partition(":")[0] for line in said]
    assert spans == ["2 s", "4 s", "8 s", "16 s"]
    assert said[0] == "  test_long[x] has run for 2 s: 0 frames so far"
    bench.close()


LONG = """
@pytest.mark.requirement("NMT-02")
def test_long(bench):
    bench.wait(2_200_000_000)

@pytest.mark.requirement("NMT-02")
def test_short(bench):
    bench.wait(1_000_000)
"""


@pytest.mark.slow
def test_a_run_in_real_time_tells_it_on_the_terminal(tmp_path: Path) -> None:
    """Beside pytest's capture, which swallows what a test prints."""
    options = ["--can-interface=udp_multicast", f"--can-iface={free_channel()}"]
    run = judge_apart(tmp_path, LONG, *options)
    assert run.status == 0, run.text
    assert run.text.count("  test_long has run for 2 s: ") == 1
    assert "test_short has run" not in run.text


@pytest.mark.slow
def test_virtual_time_needs_no_patience(tmp_path: Path) -> None:
    """What takes hours on the bus takes seconds, so nothing is told."""
    run = judge_apart(tmp_path, LONG)
    assert run.status == 0, run.text
    assert "has run for" not in run.text
