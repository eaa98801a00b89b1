"""The plugin in projects that have nothing to do with CAN: unseen, and almost free."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from tests.run.harness import ROOT, environment

pytestmark = pytest.mark.slow

HEAVY = (
    *("can", "hypothesis", "attrs", "attr", "cattrs", "jinja2", "node_model"),
    *("hil_tests.config", "hil_tests.bench", "hil_tests.judge"),
    *("hil_tests.requirements", "hil_tests.reporting"),
)

FOREIGN = """
import sys

import pytest

def test_something():
    assert True

def test_nothing_of_it_was_imported():
    heavy = [name for name in {heavy!r} if name in sys.modules]
    assert heavy == []
"""


def foreign_project(folder: Path, *options: str, **extra: str) -> subprocess.CompletedProcess[str]:
    """pytest in a project without a test of ours."""
    (folder / "test_foreign.py").write_text(FOREIGN.format(heavy=HEAVY), "utf-8")
    arguments = ["-p", "no:cacheprovider", "-p", "no:hypothesispytest", "-p", "hil_tests.plugin"]
    return subprocess.run(
        [sys.executable, "-m", "pytest", *arguments, *options],
        cwd=folder,
        env=environment(**extra),
        capture_output=True,
        text=True,
        check=False,
    )


def test_the_plugin_is_unseen_in_a_foreign_project(tmp_path: Path) -> None:
    """No header, no closing lines, no folder, no heavy import."""
    done = foreign_project(tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr
    for word in ("device:", "seed:", "nodeproof =", "bus:", "written to"):
        assert word not in done.stdout
    assert {path.name for path in tmp_path.iterdir()} <= {"test_foreign.py", "__pycache__"}


def test_settings_of_ours_that_are_wrong_do_not_stop_a_foreign_project(tmp_path: Path) -> None:
    """Who exports a variable for another project can still run this one."""
    done = foreign_project(tmp_path, NODEPROOF_CAN_SEED="abc", NODEPROOF_CAN_BENCH="./none.toml")
    assert done.returncode == 0, done.stdout + done.stderr


def test_our_options_are_in_the_help(tmp_path: Path) -> None:
    """`pytest --help` lists them, with their environment variables and ini settings."""
    done = foreign_project(tmp_path, "--help")
    assert "--can-iface=NAME" in done.stdout
    assert "NODEPROOF_CAN_IFACE" in " ".join(done.stdout.split())


def test_importing_the_plugin_imports_pytest_and_little_else() -> None:
    """What every pytest run on the machine pays for is a handful of small modules."""
    script = (
        "import sys, pytest; before = set(sys.modules); import hil_tests.plugin;"
        "print(*sorted(set(sys.modules) - before))"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], cwd=ROOT, capture_output=True, text=True, check=True
    )
    ours = {"hil_tests", "hil_tests.plugin", "hil_tests.run"}
    assert set(done.stdout.split()) == ours | {"hil_tests.run.options", "hil_tests.run.stash"}


def test_two_other_plugins_get_along(tmp_path: Path) -> None:
    """Loading it by name and by entry point is loading it once; -p no: leaves it out."""
    done = foreign_project(tmp_path, "-p", "no:hil_tests.plugin")
    assert done.returncode == 0, done.stdout + done.stderr
