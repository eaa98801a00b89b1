"""Power by commands of the user's."""

from __future__ import annotations

import sys
import time

import pytest

from hil_tests.bench.drivers.command import CommandPower
from hil_tests.clock import S
from hil_tests.errors import BenchError
from tests.drivers.peers import finish

FAILS = [sys.executable, "-c", "import sys; sys.exit('relay 3 not found')"]


def power(on: list[str], off: list[str]) -> CommandPower:
    """A supply with these commands."""
    return CommandPower(on, off, time.time_ns)


def test_command_that_ends_well_has_switched() -> None:
    """It happened between start and end of the command; on and off differ."""
    began = time.time_ns()
    supply = power(["true"], FAILS)
    when = finish(supply.switch(True), time.time_ns)

    assert began <= when.earliest < when.latest <= time.time_ns()
    with pytest.raises(BenchError, match=r"status 1: 'relay 3 not found'"):
        finish(supply.switch(False), time.time_ns)


@pytest.mark.parametrize("command", [["/nonexistent/relay", "on"], [], ["a\0b"]])
def test_command_that_cannot_start_is_told(command: list[str]) -> None:
    """The message shows the command and where to correct it."""
    with pytest.raises(BenchError, match="bench file"):
        power(command, command).switch(True).start(0)


def test_command_that_does_not_end_is_killed() -> None:
    """Its time over, it is ended and told."""
    supply = CommandPower(["sleep", "3600"], ["true"], lambda: 0, timeout_ns=2 * S)
    action = supply.switch(True)
    action.start(0)

    assert action.wake_at == 2 * S
    assert not action.poll(2 * S - 1)
    with pytest.raises(BenchError, match="did not end within 2 s"):
        action.poll(2 * S)
    assert action.descriptors == ()
