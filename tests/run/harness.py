"""Runs of pytest as a user starts them, on small test files, judged by what the user sees."""

from __future__ import annotations

import importlib
import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[2]

for _module in (
    "hil_tests.api",
    "hil_tests.bench.drivers.model",
    "hil_tests.bench.real",
    "hil_tests.bench.virtual",
    "hil_tests.bus.pythoncan",
    "hil_tests.decode",
    "hil_tests.reporting.html",
    "hil_tests.run.catalogue",
    "hil_tests.run.opening",
    "hil_tests.run.papers",
    "hil_tests.run.properties",
    "hil_tests.run.reports",
    "hil_tests.run.selection",
    "hypothesis.internal.conjecture.engine",
    "node_model.faults",
):
    # pytester forgets what a run imports; halves of the project must not be imported twice.
    importlib.import_module(_module)

PREAMBLE = """
import pytest
from hil_tests.api import *
from hil_tests.errors import BenchError, OperatorAbsent
"""


@dataclass(frozen=True)
class Judged:
    """What came of a run.

    Args:
        status: exit status.
        text: everything on standard output and standard error.
        reports: the folder given with --can-reports; this run is the latest in it.
    """

    status: int
    text: str
    reports: Path
    folder: Path = field(init=False)
    """The folder of the run; others may come to lie beside it."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "folder", (self.reports / "latest").resolve())

    @property
    def results(self) -> Mapping[str, Any]:
        """Its results.json."""
        return dict(json.loads((self.folder / "results.json").read_text("utf-8")))

    @property
    def outcomes(self) -> dict[str, str]:
        """Name of each test -> its outcome."""
        return {row["test"].rpartition("::")[2]: row["outcome"] for row in self.results["results"]}

    def traces(self) -> list[Path]:
        """The recordings."""
        return sorted((self.folder / "traces").iterdir())

    def section(self, title: str) -> str:
        """The lines of a closing section."""
        _, _, rest = self.text.partition(f"= {title} =")
        return rest.partition("\n")[2].partition("\n==")[0]


@contextmanager
def same_hypothesis() -> Iterator[None]:
    """A run in this process leaves Hypothesis as it was."""
    import hypothesis  # noqa: PLC0415
    from hypothesis import core  # noqa: PLC0415

    seed, before = core.global_force_seed, hypothesis.settings.default
    core.global_force_seed = None
    try:
        yield
    finally:
        core.global_force_seed = seed
        hypothesis.settings.register_profile("as-before", before)
        hypothesis.settings.load_profile("as-before")


def judge(pytester: pytest.Pytester, body: str, *options: str) -> Judged:
    """Run pytest in this process on a file of tests.

    Args:
        pytester: gives the folder; other files can be put there before.
        body: the tests; the names of the api are there.
        options: of the command line.
    """
    pytester.makepyfile(test_device=PREAMBLE + body)
    reports = pytester.path / "reports"
    with same_hypothesis():
        done = pytester.runpytest_inprocess(
            "-p", "no:cacheprovider", f"--can-reports={reports}", *options
        )
    return Judged(int(done.ret), done.stdout.str() + done.stderr.str(), reports)


def command(folder: Path, *options: str) -> list[str]:
    """The command line of a run in a process of its own."""
    plain = ["-p", "no:cacheprovider", "-p", "hil_tests.plugin", f"--can-reports={folder}/reports"]
    return [sys.executable, "-m", "pytest", *plain, *options]


def environment(**extra: str) -> dict[str, str]:
    """The surroundings of a run in a process of its own: this checkout, no settings of ours."""
    inherited = {key: text for key, text in os.environ.items() if "NODEPROOF" not in key}
    return {**inherited, "PYTHONPATH": str(ROOT), **extra}


def judge_apart(folder: Path, body: str, *options: str, **extra: str) -> Judged:
    """Run pytest in a process of its own on a file of tests; `extra` goes to its environment."""
    (folder / "test_device.py").write_text(PREAMBLE + body, "utf-8")
    done = subprocess.run(
        command(folder, *options),
        cwd=folder,
        env=environment(**extra),
        capture_output=True,
        text=True,
        check=False,
        timeout=120,
    )
    return Judged(done.returncode, done.stdout + done.stderr, folder / "reports")


@contextmanager
def heeding_interrupts() -> Iterator[None]:
    """Programs started meanwhile take SIGINT, even where we run in the background of a shell."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
