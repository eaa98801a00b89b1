"""Runs that are ended from outside: what was found stays, what was moved is put back."""

from __future__ import annotations

import os
import select
import signal
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from hil_tests.reporting.check import check_run
from hil_tests.reporting.pcapng import read_pcapng
from hil_tests.reporting.results_reader import load_results
from hil_tests.trace import Moment, Sighting
from tests.drivers.peers import answer, scripted
from tests.host.test_process import free_channel
from tests.run.harness import (
    PREAMBLE,
    Judged,
    command,
    environment,
    heeding_interrupts,
    judge_apart,
)
from tests.run.test_broken_bench import desk

pytestmark = pytest.mark.slow

WAITS = """
import os, signal

def come_here():
    with open(os.environ["HERE"], "w") as here:
        here.write("ready")
    signal.pause()

@pytest.mark.requirement("NMT-02")
def test_before(bench, power):
    power.on()
    bench.wait(1000)

@pytest.mark.requirement("NMT-02")
def test_in_the_middle(bench, power):
    power.off()
    come_here()

@pytest.mark.requirement("NMT-02")
def test_never_reached(bench):
    pass
"""


@contextmanager
def waiting(folder: Path, *options: str) -> Iterator[subprocess.Popen[str]]:
    """A run that has come to the middle of its second test."""
    here = folder / "here"
    os.mkfifo(here)
    (folder / "test_device.py").write_text(PREAMBLE + WAITS, "utf-8")
    with (
        heeding_interrupts(),
        subprocess.Popen(
            command(folder, *options),
            cwd=folder,
            env=environment(HERE=str(here)),
            text=True,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
        ) as process,
    ):
        try:
            assert here.read_text() == "ready"
            yield process
        finally:
            process.kill()


def verbs(run: Path, name: str) -> list[str]:
    """What was done in a test, from its record."""
    path = next(path for path in (run / "traces").iterdir() if name in path.name)
    return [entry.what for entry in read_pcapng(path) if isinstance(entry, Moment)]


def test_a_killed_run_leaves_valid_results_and_its_traces(tmp_path: Path) -> None:
    """After SIGKILL the results hold every test that had ended, and its record."""
    with waiting(tmp_path) as process:
        process.kill()
        process.wait()
    run = tmp_path / "reports" / "latest"
    found = load_results(run / "results.json")
    assert not found.torn
    assert (found.finished, found.state) == (False, "interrupted")
    assert found.under_way is not None
    assert found.under_way["test"].endswith("test_in_the_middle")
    assert check_run(run) == []
    assert [result.outcome for result in found.results] == ["passed"]
    assert found.results[0].trace is not None
    assert list(read_pcapng(run / found.results[0].trace.path))
    assert verbs(run, "middle") == ["begin", "power"]


EXAMPLES = """
import os, signal
from hypothesis import given, strategies as st

@pytest.mark.requirement("HB-01")
@given(beats=st.integers(1, 9))
def test_property(bench, beats):
    bench.begin_example()
    bench.start(heartbeat_ms=100)
    bench.wait(beats * 100 * MS)
    if beats > 5:
        with open(os.environ["HERE"], "w") as here:
            here.write(str(beats))
        os.kill(os.getpid(), signal.SIGKILL)
"""


def test_a_run_that_is_killed_in_an_example_keeps_its_record(tmp_path: Path) -> None:
    """Of that example alone, every frame."""
    here = tmp_path / "here"
    run = judge_apart(tmp_path, EXAMPLES, HERE=str(here))
    assert run.status == -signal.SIGKILL
    (trace,) = run.traces()
    found = list(read_pcapng(trace))
    beats = [each for each in found if isinstance(each, Sighting) and each.frame.data == b"\x7f"]
    assert len(beats) == int(here.read_text())
    assert [each.what for each in found if isinstance(each, Moment)] == ["begin", "renew", "power"]
    under_way = load_results(run.folder / "results.json").under_way
    assert under_way is not None
    assert under_way["trace"] == f"traces/{trace.name}"


def test_a_killed_run_in_real_time_keeps_the_record_of_its_last_test(tmp_path: Path) -> None:
    """Off virtual time each entry is on the disk as soon as it was seen."""
    with scripted(tmp_path, [answer(), answer(), answer()], can=["power"]) as address:
        options = desk(tmp_path, "killed", address)
        with waiting(tmp_path, options) as process:
            process.kill()
            process.wait()
    assert verbs(tmp_path / "reports" / "latest", "middle")[:2] == ["begin", "power"]


@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupted_run_puts_everything_back(tmp_path: Path, how: signal.Signals) -> None:
    """Ctrl-C, or a CI system that cancels: bench closed, supply given back, results ended."""
    asked: list[str] = []

    def power(request: dict[str, object]) -> bytes:
        asked.append(f"{request['do']} {request.get('on', '')}".strip())
        return answer()(request)

    replies = [answer(power=True), power, power, power, power]
    with scripted(tmp_path, replies, can=["power"]) as address:
        options = desk(tmp_path, "interrupted", address)
        with waiting(tmp_path, options) as process:
            process.send_signal(how)
            text, _ = process.communicate(timeout=60)
    assert process.returncode == 2, text
    assert asked == ["power True", "power False", "power True", "bye"]
    run = Judged(2, text, tmp_path / "reports")
    assert run.outcomes == {"test_before": "passed"}
    assert (run.results["finished"], run.results["state"]) == (True, "interrupted")
    assert run.results["summary"]["exit_status"] == 2
    assert len(run.traces()) == 2
    assert "KeyboardInterrupt" in text
    assert "INTERNALERROR" not in text
    assert "= nodeproof =" in text


def test_no_model_outlives_a_killed_run(tmp_path: Path) -> None:
    """After SIGKILL the hosted model ends by itself: its standard input has ended."""
    options = ["--can-interface=udp_multicast", f"--can-iface={free_channel()}"]
    with waiting(tmp_path, *options) as process:
        children = Path(f"/proc/{process.pid}/task/{process.pid}/children")
        model = os.pidfd_open(int(children.read_text().split()[-1]))
        process.kill()
        process.wait()
    try:
        ended, _, _ = select.select([model], [], [], 30)
        assert ended
    finally:
        os.close(model)


MODEL_DIES = """
import os, signal
from pathlib import Path

def model():
    task = Path(f"/proc/self/task/{os.getpid()}/children")
    return int(task.read_text().split()[-1])

@pytest.mark.requirement("NMT-02")
def test_alive(bench, power):
    bench.start()

@pytest.mark.requirement("NMT-02")
def test_dies(bench, power):
    os.kill(model(), signal.SIGKILL)
    power.off()

@pytest.mark.requirement("NMT-02")
def test_after(bench):
    bench.start()
"""


def test_a_hosted_model_that_dies_in_mid_run(tmp_path: Path) -> None:
    """Its end is told as the first cause, exit status 11; what was judged before stays."""
    options = ["--can-interface=udp_multicast", f"--can-iface={free_channel()}"]
    run = judge_apart(tmp_path, MODEL_DIES, *options)
    assert run.status == 11, run.text
    assert run.outcomes == {"test_alive": "passed", "test_dies": "error", "test_after": "error"}
    assert "the model's process ended with status -9" in run.section("bench broken")
    assert run.text.count("Traceback") == 0
    assert len(run.traces()) == 2


def test_a_model_that_does_not_start_is_told_with_its_last_words(tmp_path: Path) -> None:
    """A multicast address that is none breaks the bench before the first test."""
    options = ["--can-interface=udp_multicast", "--can-iface=nonsense"]
    run = judge_apart(tmp_path, MODEL_DIES, *options)
    assert run.status == 11
    assert run.text.count("BENCH BROKEN: ") == 1
    assert "nonsense" in run.section("bench broken")
    assert "Traceback" not in run.text
