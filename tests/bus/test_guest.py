"""The port and the host on a real vcan0: on this kernel, or in the virtual machine."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
UNAVAILABLE = 11


@pytest.mark.slow
def test_everything_holds_on_a_real_vcan() -> None:
    """All of `guest_checks`; what they measured is in the output."""
    done = subprocess.run(
        [sys.executable, "-m", "hil_tests.vm", "--compile", "hil_tests", "--compile", "node_model",
         "--", sys.executable, "-m", "tests.bus.guest_checks"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=600,
        check=False,
    )  # fmt: skip
    if done.returncode == UNAVAILABLE:
        pytest.skip(done.stderr.strip().splitlines()[-1])
    sys.stdout.write(done.stdout)

    assert done.returncode == 0, done.stdout + done.stderr
    assert "FAIL" not in done.stdout
    assert done.stdout.count("ok   check_") == 14
