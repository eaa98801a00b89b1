"""Virtual time is the same everywhere: one trace, whatever the interpreter and its hash seed."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.node_model.golden import golden_trace

ROOT = Path(__file__).parents[2]
GOLDEN = "ab45831cdb088316566e1f4d48db60dc35fd3abe1d38c7aa712165feaa7fef58"
"""The hash of the golden trace (tests/node_model/golden.py)."""


def test_the_golden_trace_is_the_same_as_ever() -> None:
    """A change of this hash is a change of behaviour: explain it, then write the new one."""
    assert golden_trace() == GOLDEN


def golden_of(interpreter: str, hash_seed: str) -> str:
    """The hash as another process computes it."""
    env = {**os.environ, "PYTHONPATH": str(ROOT), "PYTHONHASHSEED": hash_seed}
    command = [interpreter, str(ROOT / "tests" / "node_model" / "golden.py")]
    done = subprocess.run(command, capture_output=True, text=True, check=True, env=env)
    return done.stdout.strip()


@pytest.mark.slow
@pytest.mark.parametrize("hash_seed", ["1", "4711"])
def test_the_golden_trace_does_not_depend_on_the_hash_seed(hash_seed: str) -> None:
    """Sets and dicts of the model are never walked in an order that hashing decides."""
    assert golden_of(sys.executable, hash_seed) == GOLDEN


@pytest.mark.slow
@pytest.mark.parametrize("name", ["python3.11", "python3.12", "python3.13", "python3.14", "pypy3"])
def test_the_golden_trace_does_not_depend_on_the_interpreter(name: str) -> None:
    """Every other Python on this machine that is new enough gives the same frames."""
    path = shutil.which(name)
    if path is None:
        pytest.skip(f"there is no {name} on the PATH")
    asked = [path, "-c", "import sys; print(sys.version_info >= (3, 11))"]
    done = subprocess.run(asked, capture_output=True, text=True, check=False)
    if done.returncode or done.stdout.strip() != "True":
        pytest.skip(
            f"{path} does not run, or is older than 3.11: {done.stderr.partition(chr(10))[0]}"
        )
    assert golden_of(path, "0") == GOLDEN
