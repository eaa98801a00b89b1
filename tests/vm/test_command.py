"""`nodeproof vcan` from outside: options, choice, and one machine that really boots."""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

from hil_tests.vm import command, equipment, native
from hil_tests.vm.errors import Unavailable
from hil_tests.vm.shell import HostShell, cache_folder
from tests.vm.fakes import FakeShell


def options(*words: str) -> argparse.Namespace:
    """Returns the options that a command line stands for."""
    parser = argparse.ArgumentParser()
    command.add_arguments(parser)
    return parser.parse_args(words)


def test_the_commands_own_options_stay_its_own() -> None:
    """Everything after the dashes belongs to the command."""
    parsed = options("--vm", "--results", "a", "--", "pytest", "--vm", "-k", "x")

    assert command.command_of(parsed) == ["pytest", "--vm", "-k", "x"]
    assert parsed.vm
    assert parsed.results == [Path("a")]


def test_without_a_command_the_message_shows_one(capsys: pytest.CaptureFixture[str]) -> None:
    """The status is 11, as for everything that keeps a run from starting."""
    assert command.run(options("--vm")) == 11
    assert "nodeproof vcan -- pytest --can-iface vcan0" in capsys.readouterr().err


def host(cache: Path, shell: FakeShell, *, has_can: bool, up: bool) -> command.Host:
    """Returns a machine of which all is known."""
    return command.Host(shell, native.Probe(lambda: has_can, lambda _: up), cache)


def test_native_alone_does_not_fall_back(tmp_path: Path) -> None:
    """--native says why not, instead of starting a machine."""
    here = host(tmp_path, FakeShell(), has_can=False, up=False)

    with pytest.raises(Unavailable, match="--native was asked for, but this kernel has no"):
        command.is_native(options("--native", "--", "true"), here)


@pytest.mark.parametrize(
    ("words", "has_can", "up", "native_used"),
    [
        ((), True, True, True),
        ((), False, False, False),
        ((), True, False, False),
        (("--vm",), True, True, False),
        (("--native",), True, True, True),
    ],
)
def test_this_kernel_is_preferred_where_it_can(
    tmp_path: Path, words: tuple[str, ...], has_can: bool, up: bool, native_used: bool
) -> None:
    """A kernel that refuses to make the interface leads to the machine as well."""
    here = host(tmp_path, FakeShell({"ip": "/ip"}, root=True), has_can=has_can, up=up)

    assert command.is_native(options("--quiet", *words, "--", "true"), here) is native_used


def test_availability_is_one_line(tmp_path: Path) -> None:
    """It says what would be used, or what is missing and how to get it."""
    good = host(tmp_path, FakeShell(), has_can=True, up=True)
    bad = host(tmp_path, FakeShell(), has_can=False, up=False)

    assert command.availability(good, ["vcan0"]) == "native: vcan0 on this kernel"
    said = command.availability(bad, ["vcan0"])
    assert said.startswith("nothing: this kernel has no SocketCAN. The virtual machine lacks")
    assert "\n" not in said


@pytest.mark.slow
def test_a_machine_boots_with_vcan_and_skips_idle_time(tmp_path: Path) -> None:
    """The interface is up, half a minute of sleep is nearly free, results and status come out."""
    try:
        equipment.gather(HostShell(), cache_folder(os.environ), None)
    except Unavailable as unavailable:
        pytest.skip(str(unavailable))
    script = (
        f"cat /sys/class/net/vcan0/operstate; cut -d. -f1 /proc/uptime; sleep 300;"
        f"cut -d. -f1 /proc/uptime; mkdir {tmp_path}/new; echo kept >{tmp_path}/new/file; exit 7"
    )
    vcan = [sys.executable, "-m", "hil_tests.vm", "--vm", "--timeout", "240"]
    began = time.monotonic()

    done = subprocess.run(
        [*vcan, "--results", str(tmp_path), "--", "sh", "-c", script],
        capture_output=True, text=True, check=False,
    )  # fmt: skip

    assert done.returncode == 7, done.stderr
    state, before, after = done.stdout.split()
    assert state == "unknown", "a virtual interface that is up has no carrier to report"
    assert 300 <= int(after) - int(before) <= 310
    assert time.monotonic() - began < 240
    assert (tmp_path / "new/file").read_text() == "kept\n"
