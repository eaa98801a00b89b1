"""Compiles on the host what is to be imported in the guest, where compiling is slow.

pytest compiles test modules and plugins by itself, with its own form of `assert`, and keeps the
outcome beside Python's. No program does that alone, so a command that is pytest is asked to
collect its tests here first: it runs none of them.
"""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

_PYTEST = ("pytest", "py.test")
# The guest must not write bytecode, which the overlay would forget; here it has to.
_FORBIDS = "PYTHONDONTWRITEBYTECODE"


def compile_all(
    folders: Sequence[Path], command: Sequence[str], environment: Mapping[str, str]
) -> None:
    """Compiles the Python files in the folders, and what pytest will import if it is the command.

    A file that does not compile, or a collection that fails, is the command's affair, which will
    say so better.

    Args:
        folders: With the Python files; where there is none, nothing is done.
        command: What the guest will run.
        environment: In which it will.
    """
    writing = {name: value for name, value in environment.items() if name != _FORBIDS}
    wanted = [[sys.executable, "-m", "compileall", "-q", str(folder)] for folder in folders]
    if folders and is_pytest(command):
        wanted.append([*command, "--collect-only", "--quiet", "-p", "no:cacheprovider"])
    for program in wanted:
        _run(program, writing)


def is_pytest(command: Sequence[str]) -> bool:
    """Whether a command is pytest: by itself, or as a module of some Python."""
    program = Path(command[0]).name
    as_module = program.startswith("python") and "-m" in command[1:-1]
    name = command[command.index("-m", 1) + 1] if as_module else program
    return name in _PYTEST


def _run(program: Sequence[str], environment: Mapping[str, str]) -> None:
    try:
        subprocess.run(
            program, env=environment, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL, check=False,
        )  # fmt: skip
    except OSError:
        # The guest finds the same: no such program.
        return
