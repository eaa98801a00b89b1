"""The launcher passes output on, asks before it ends a machine, and says how the command did."""

from __future__ import annotations

import io
import signal
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pytest

from hil_tests.vm.errors import Unavailable
from hil_tests.vm.launcher import Launcher
from hil_tests.vm.machine import Machine
from hil_tests.vm.tail import Tail
from tests.vm.fakes import FakeClock, FakeProcess


@dataclass
class Rig:
    """A launcher with a folder for its machine, a fake clock and what it said."""

    launcher: Launcher
    clock: FakeClock
    said: list[str]
    out: io.BytesIO
    folder: Path

    def guest(self, port: str, text: str) -> Callable[[], None]:
        """Returns an action: the guest writes to a port."""

        def act() -> None:
            with (self.folder / port).open("a") as file:
                file.write(text)

        return act

    def follow(self, *script: Callable[[], None]) -> FakeProcess:
        """Runs the launcher over a scripted process."""
        process = FakeProcess(list(script))
        self.launcher.follow(process)
        return process


@pytest.fixture
def rig(tmp_path: Path) -> Rig:
    """A launcher with a minute of time and one results folder."""
    machine = Machine("qemu", Path("/k"), 0, "1G", (tmp_path / "results",), tmp_path)
    said: list[str] = []
    out, clock = io.BytesIO(), FakeClock()
    tails = (Tail(tmp_path / "stdout", out),)
    launcher = Launcher(machine, tails, said.append, 60.0, clock)
    return Rig(launcher, clock, said, out, tmp_path)


def test_output_is_passed_on_while_the_guest_runs(rig: Rig) -> None:
    """What the guest prints in two portions arrives in two portions, once each."""
    seen: list[bytes] = []

    rig.follow(
        rig.guest("stdout", "one\n"),
        lambda: seen.append(rig.out.getvalue()),
        rig.guest("stdout", "two\n"),
    )

    assert seen == [b"one\n"]
    assert rig.out.getvalue() == b"one\ntwo\n"


@pytest.mark.parametrize("code", [0, 1, 7, 143])
def test_exit_status_is_the_commands(rig: Rig, code: int) -> None:
    """The number after `exit` on the status port is handed on."""
    rig.follow(rig.guest("status", "ready\n"), rig.guest("status", f"exit {code}\n"))

    assert rig.launcher.exit_status() == code
    assert rig.said == ["the guest is ready after 0.0 s"]


def test_a_machine_that_dies_is_an_error_that_quotes_the_kernel(rig: Rig) -> None:
    """Without an exit status there is no verdict; the panic is shown, the noise is not."""
    rig.guest("console", "usb noise\nKernel panic - not syncing: oh\nmore noise\n")()
    rig.follow(rig.guest("status", "ready\n"))

    with pytest.raises(Unavailable, match="while the command ran") as caught:
        rig.launcher.exit_status()

    assert "Kernel panic - not syncing: oh" in str(caught.value)
    assert "noise" not in str(caught.value)


def test_a_guest_that_cannot_be_set_up_says_why(rig: Rig) -> None:
    """The guest's own reason comes first."""
    rig.follow(rig.guest("status", "failed the interface vcan0 could not be made\n"))

    with pytest.raises(Unavailable, match="could not be set up: the interface vcan0"):
        rig.launcher.exit_status()


def test_time_over_asks_the_command_to_stop_and_returns_124(rig: Rig) -> None:
    """After the limit the guest gets SIGTERM and may finish; the status tells of the time-out."""
    process = rig.follow(
        rig.guest("status", "ready\n"),
        rig.clock.later(60.1),
        rig.guest("status", "exit 143\n"),
    )

    assert process.stdin.getvalue().endswith(b"TERM\n")
    assert rig.launcher.exit_status() == 124


def test_time_not_yet_over_stops_nothing(rig: Rig) -> None:
    """Just before the limit the command goes on."""
    process = rig.follow(rig.guest("status", "ready\n"), rig.clock.later(59.9))

    assert b"TERM" not in process.stdin.getvalue()


def test_a_guest_that_does_not_answer_is_left_after_the_grace(rig: Rig) -> None:
    """The loop ends although the process goes on, and the user is told what may be missing."""
    rig.follow(rig.guest("status", "ready\n"), *[rig.clock.later(31.0)] * 10)

    assert rig.launcher.exit_status() == 124
    assert "results of its last seconds may be missing" in rig.said[-1]


def test_ctrl_c_reaches_the_command_as_sigint(rig: Rig) -> None:
    """pytest in the guest can then write its report; the status is the one that it gives."""
    process = rig.follow(
        rig.guest("status", "ready\n"),
        lambda: rig.launcher.signals.note(signal.SIGINT, None),
        rig.guest("status", "exit 2\n"),
    )

    assert process.stdin.getvalue().endswith(b"INT\n")
    assert rig.launcher.exit_status() == 2


def test_second_ctrl_c_ends_the_machine_at_once(rig: Rig) -> None:
    """Nobody has to wait for the grace."""
    process = rig.follow(
        rig.guest("status", "ready\n"),
        lambda: rig.launcher.signals.note(signal.SIGINT, None),
        lambda: rig.launcher.signals.note(signal.SIGINT, None),
        rig.clock.later(1.0),
    )

    assert len(process.script) == 1, "the loop should have ended before the last step"
    assert rig.launcher.exit_status() == 128 + signal.SIGINT


def test_ctrl_c_while_booting_ends_the_machine_at_once(rig: Rig) -> None:
    """There is no command yet that could be asked."""
    process = rig.follow(
        lambda: rig.launcher.signals.note(signal.SIGTERM, None), rig.clock.later(1.0)
    )

    assert len(process.script) == 1
    assert rig.launcher.exit_status() == 128 + signal.SIGTERM


def test_results_are_asked_for_every_few_seconds(rig: Rig) -> None:
    """Once when the guest is ready, then each time that five seconds have passed."""
    process = rig.follow(
        rig.guest("status", "ready\n"),
        rig.clock.later(5.1),
        rig.clock.later(1),
        rig.clock.later(5),
    )

    assert process.stdin.getvalue() == b"COPY\n" * 3


def test_a_word_to_a_machine_that_listens_no_more_is_lost_and_no_error(tmp_path: Path) -> None:
    """It ends while the launcher asks for results: the status of the command counts."""
    qemu, over = tmp_path / "qemu-that-ends", tmp_path / "over"
    qemu.write_text(
        f"#!/bin/sh\ncd {tmp_path}\nexec 0<&-\nprintf 'ready\\nexit 7\\n' >status\n"
        f"until [ -e {over} ]; do :; done\n"
    )
    qemu.chmod(0o755)
    machine = Machine(str(qemu), Path("/k"), 0, "1G", (tmp_path / "results",), tmp_path)
    clock = FakeClock()

    def ask_and_end(said: str) -> None:
        assert said.startswith("the guest is ready")
        clock.later(6)()  # so the results are asked for in this very round
        over.touch()

    assert Launcher(machine, (), ask_and_end, None, clock).run() == 7


def test_results_are_asked_for_before_the_command_is_stopped(rig: Rig) -> None:
    """And while it finishes: the guest may not come to bringing them out by itself."""
    process = rig.follow(
        rig.guest("status", "ready\n"),
        rig.clock.later(5.1),
        rig.clock.later(55),
        rig.clock.later(5.1),
    )

    assert process.stdin.getvalue() == b"COPY\n" * 3 + b"TERM\n" + b"COPY\n"
