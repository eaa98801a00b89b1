"""Bytecode made on the host for the guest: Python's own, and pytest's."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import pytest

from hil_tests.vm import bytecode


@pytest.mark.parametrize(
    ("command", "expected"),
    [
        (("pytest", "-k", "x"), True),
        (("/venv/bin/py.test",), True),
        (("python", "-m", "pytest", "-x"), True),
        (("/usr/bin/python3.11", "-u", "-m", "pytest"), True),
        (("python", "-m", "unittest"), False),
        (("python", "pytest.py", "-m"), False),
        (("env", "-m", "pytest"), False),
        (("candump", "vcan0"), False),
    ],
)
def test_pytest_is_known_by_its_name(command: tuple[str, ...], expected: bool) -> None:
    """As a program or as a module of some Python; an option of another program is neither."""
    assert bytecode.is_pytest(command) is expected


@pytest.mark.slow
def test_pytests_own_bytecode_is_kept_and_no_test_runs(tmp_path: Path) -> None:
    """Even where the environment forbids Python to write bytecode."""
    (tmp_path / "pytest.ini").write_text("[pytest]\n")
    (tmp_path / "test_x.py").write_text(
        "import pathlib\n\n\ndef test_it():\n"
        "    pathlib.Path(__file__).with_name('ran').touch()\n    assert 1\n"
    )
    command = (sys.executable, "-m", "pytest", "-c", f"{tmp_path}/pytest.ini", str(tmp_path))
    environment = {**os.environ, "PYTHONDONTWRITEBYTECODE": "1"}

    bytecode.compile_all([tmp_path], command, environment)

    kept = {path.name.partition("-pytest-")[0] for path in (tmp_path / "__pycache__").iterdir()}
    tag = sys.implementation.cache_tag
    assert kept == {f"test_x.{tag}.pyc", f"test_x.{tag}"}
    assert not (tmp_path / "ran").exists()


def test_a_program_that_is_not_there_is_left_to_the_guest_to_tell(tmp_path: Path) -> None:
    """Nothing is compiled, and nothing is raised."""
    bytecode.compile_all([tmp_path], (f"{tmp_path}/pytest",), {})

    assert not list(tmp_path.iterdir())


def test_without_folders_nothing_is_run(tmp_path: Path) -> None:
    """Who asks for no bytecode has his command left alone on the host."""
    program = tmp_path / "pytest"
    program.write_text(f"#!/bin/sh\ntouch {tmp_path}/ran\n")
    program.chmod(0o755)

    bytecode.compile_all([], (str(program),), {})

    assert not (tmp_path / "ran").exists()
