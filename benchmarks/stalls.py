"""The suite on plain real time, on a host that is busy or stops its processes.

Runs a short selection of acceptance tests on a hosted model, the right one, many times:
beside processes that hog every processor, with the suite's own process stopped for 50 to
500 ms again and again, with the model's process stopped so. The bar: no FAIL, and where a
process was stopped the run says that the host was busy. INCONCLUSIVE is an honest answer.

    python -m benchmarks.stalls [--runs 100] [--at-once 2] [--seed 1] [--keep DIR]

Needs python-can's udp_multicast (`pip install -e .[multicast]`); takes some 20 seconds a run.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections import Counter
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path

from benchmarks.tables import show

KINDS = ("hog", "suite", "model")
WHAT = {"hog": "processors hogged", "suite": "suite stopped", "model": "model stopped"}

FOLDER = "hil_tests/acceptance/"
SELECTION = (
    "test_start_and_nmt.py::test_boot_up_comes_first_then_emcy",
    "test_start_and_nmt.py::test_reset_brings_one_boot_up[reset-node]",
    "test_nmt_commands.py::test_command_to_own_id[operational-stop]",
    "test_nmt_commands.py::test_command_to_own_id[stopped-reset-communication]",
    "test_nmt_commands.py::test_command_to_another_then_to_all[operational-pre-operational]",
    "test_nmt_commands.py::test_burst_ends_in_the_state_of_the_last[stop]",
    "test_heartbeat.py::test_period_in_every_state[operational]",
    "test_heartbeat.py::test_first_heartbeat_after_reset[reset-node-operational]",
    "test_keys.py::test_releases_are_reported",
    "test_keys.py::test_keys_that_mature_together[within a scan]",
    "test_commissioning.py::test_literal_example",
)

SHORTEST_S, LONGEST_S = 0.05, 0.5
PAUSE_S = (0.1, 1.5)
"""Between two stops."""
START_S = 1.5
"""Stops begin that long after the start: what is imported before is not judged."""
LIMIT_S = 120.0
"""A run that takes longer hangs."""
BROKEN = "broken run"


@dataclass
class Result:
    """What came of one run."""

    number: int
    kind: str
    outcomes: Counter[str] = field(default_factory=Counter)
    stops: int = 0
    stalls: int = 0
    worst_late_ns: int = 0
    seconds: float = 0.0
    complaints: list[str] = field(default_factory=list)

    @property
    def named(self) -> bool:
        """The run says that its host was busy."""
        return bool(self.stalls or self.worst_late_ns)


class Stopper(threading.Thread):
    """Stops a process for random stretches until it is told to end.

    Args:
        suite: pid of the suite.
        kind: whom to stop: "suite", or "model", its child.
        seed: of the stretches.
    """

    def __init__(self, suite: int, kind: str, seed: str) -> None:
        super().__init__(daemon=True)
        self._suite = suite
        self._model = kind == "model"
        self._random = random.Random(seed)
        self._over = threading.Event()
        self.stops = 0

    def run(self) -> None:
        """Stop and continue it."""
        pause = START_S
        while not self._over.wait(pause):
            pid = child_of(self._suite) if self._model else self._suite
            if pid is not None:
                self._interrupt(pid, self._random.uniform(SHORTEST_S, LONGEST_S))
            pause = self._random.uniform(*PAUSE_S)

    def _interrupt(self, pid: int, span_s: float) -> None:
        try:
            os.kill(pid, signal.SIGSTOP)
            try:
                time.sleep(span_s)
            finally:
                os.kill(pid, signal.SIGCONT)
        except ProcessLookupError:
            return  # it has just ended
        self.stops += 1

    def end(self) -> None:
        """No more stops."""
        self._over.set()
        self.join()


def child_of(pid: int) -> int | None:
    """The hosted model of a suite: its one child."""
    for entry in Path("/proc").iterdir():
        if not entry.name.isdecimal():
            continue
        try:
            stat = (entry / "stat").read_text(encoding="ascii", errors="replace")
            command = (entry / "cmdline").read_bytes()
        except OSError:
            continue
        if int(stat.rpartition(")")[2].split()[1]) == pid and b"node_model" in command:
            return int(entry.name)
    return None


def hogs() -> list[subprocess.Popen[bytes]]:
    """One busy process on each processor."""
    busy = [sys.executable, "-c", "while True: pass"]
    return [
        subprocess.Popen(["taskset", "-c", str(cpu), *busy])
        for cpu in sorted(os.sched_getaffinity(0))
    ]


def one_run(number: int, kind: str, seed: int, folder: Path) -> Result:
    """Run the selection once; its traces stay in the folder."""
    channel = f"239.74.163.{1 + number % 200}:{43200 + number % 200}"
    reports = folder / f"{number:03d}-{kind}"
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider"]
    command += ["--can-iface", channel, "--can-interface", "udp_multicast"]
    command += ["--can-reports", str(reports)]
    command += [FOLDER + name for name in SELECTION]
    busy = hogs() if kind == "hog" else []
    began = time.monotonic()
    result = Result(number, kind)
    reports.mkdir(parents=True)
    try:
        with (reports / "output.txt").open("wb") as output:
            suite = subprocess.Popen(command, stdout=output, stderr=subprocess.STDOUT)
            stopper = Stopper(suite.pid, kind, f"{seed} {number}")
            if not busy:
                stopper.start()
            try:
                suite.wait(LIMIT_S)
            except subprocess.TimeoutExpired:
                result.complaints.append(f"still running after {LIMIT_S:g} s")
                suite.terminate()
                suite.wait()
            finally:
                if not busy:
                    stopper.end()
    finally:
        for each in busy:
            each.kill()
            each.wait()
    result.stops = stopper.stops
    result.seconds = time.monotonic() - began
    read_results(result, reports)
    return result


def read_results(result: Result, reports: Path) -> None:
    """Take over what the run wrote down."""
    found = list(reports.glob("*/results.json"))
    written = [each for each in found if not each.parent.is_symlink()]
    if not written:
        result.outcomes[BROKEN] += 1
        result.complaints.append(f"no results; see {reports / 'output.txt'}")
        return
    content = json.loads(written[0].read_text(encoding="utf-8"))
    summary = content.get("summary", {})
    result.stalls = summary.get("stalls", 0)
    result.worst_late_ns = summary.get("host_late_ns", 0)
    tests = [each for each in content["results"] if each["test"]]
    result.outcomes.update(each["outcome"] for each in tests)
    if missing := len(SELECTION) - len(tests):
        result.outcomes[BROKEN] += 1
        result.complaints.append(f"{missing} tests are missing; see {reports / 'output.txt'}")
    for each in tests:
        if each["outcome"] not in {"passed", "inconclusive"}:
            trace = written[0].parent / (each.get("trace") or "")
            name = each["test"].rpartition("::")[2]
            result.complaints.append(f"{each['outcome']}: {name}: {each['text']}\n  {trace}")


def tables(results: Sequence[Result]) -> bool:
    """Print what came out; whether the bar is kept."""
    heads = ["", "runs", "tests", "passed", "inconclusive", "FAIL", "error", "other"]
    heads += ["stops", "named", "of those stopped"]
    rows = []
    for kind in KINDS:
        chosen = [each for each in results if each.kind == kind]
        if chosen:
            rows.append(row(WHAT[kind], chosen))
    rows.append(row("all", results))
    show("The right model on a host that is busy", heads, rows)
    failed = sum(each.outcomes["failed"] for each in results)
    unnamed = sum(bool(each.stops) and not each.named for each in results)
    print(f"FAIL of the right model: {failed}, bar 0: {'NO' if failed else 'yes'}")
    print(f"stopped and not named: {unnamed} runs, bar 0: {'NO' if unnamed else 'yes'}")
    spans = sorted(each.seconds for each in results)
    print(f"seconds a run: median {spans[len(spans) // 2]:.1f}, longest {spans[-1]:.1f}")
    return not failed and not unnamed


def row(name: str, results: Sequence[Result]) -> list[str]:
    """One line of the table."""
    total: Counter[str] = Counter()
    for each in results:
        total.update(each.outcomes)
    shown = [total[name] for name in ("passed", "inconclusive", "failed", "error")]
    other = sum(total.values()) - sum(shown)
    stopped = [each for each in results if each.stops]
    counts = [len(results), sum(total.values()), *shown, other]
    counts += [sum(each.stops for each in results), sum(each.named for each in stopped)]
    return [name, *map(str, counts), str(len(stopped))]


def main() -> int:
    """Run all; exit status 1 where the bar is not kept."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--runs", type=int, default=100)
    parser.add_argument("--at-once", type=int, default=2)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--kind", choices=KINDS, action="append", help="only these")
    parser.add_argument("--keep", type=Path, help="folder for results and traces")
    options = parser.parse_args()
    folder = options.keep or Path(tempfile.mkdtemp(prefix="stalls-"))
    kinds = options.kind or KINDS
    jobs = [(number, kinds[number % len(kinds)]) for number in range(options.runs)]
    results: list[Result] = []
    with ThreadPoolExecutor(options.at_once) as pool:
        runs = [pool.submit(one_run, *job, options.seed, folder) for job in jobs]
        for each in runs:
            result = each.result()
            results.append(result)
            counts = ", ".join(f"{count} {name}" for name, count in result.outcomes.items())
            print(
                f"{result.number + 1:3d}/{len(jobs)} {result.kind:5} {result.seconds:5.1f} s, "
                f"{result.stops} stops, {result.stalls} stalls, worst lateness "
                f"{result.worst_late_ns / 1e6:.1f} ms: {counts}",
                flush=True,
            )
            for complaint in result.complaints:
                print(f"    {complaint}", flush=True)
    kept = tables(results)
    print(f"results and traces: {folder}")
    return 0 if kept else 1


if __name__ == "__main__":
    sys.exit(main())
