"""What an NMT slave takes from a frame with COB-ID 0."""

from __future__ import annotations

import pytest

from node_model.frame import Frame
from node_model.nmt import TARGETS, NmtCommand, NmtState, command_for


@pytest.mark.parametrize(
    ("specifier", "command", "state"),
    [
        (0x01, NmtCommand.START, NmtState.OPERATIONAL),
        (0x02, NmtCommand.STOP, NmtState.STOPPED),
        (0x80, NmtCommand.PRE_OPERATIONAL, NmtState.PRE_OPERATIONAL),
        (0x81, NmtCommand.RESET_NODE, NmtState.INITIALISING),
        (0x82, NmtCommand.RESET_COMMUNICATION, NmtState.INITIALISING),
    ],
)
def test_five_commands_lead_to_their_states(
    specifier: int, command: NmtCommand, state: NmtState
) -> None:
    """The command specifiers of CiA 301, 7.2.8.2.1, and where each leads."""
    assert command_for(Frame(0, bytes((specifier, 5))), 5) is command
    assert TARGETS[command] is state


@pytest.mark.parametrize("address", [0, 5])
def test_own_id_and_all_are_addressed(address: int) -> None:
    """A command for this node or for node 0, which is all, is taken."""
    assert command_for(Frame(0, bytes((1, address))), 5) is NmtCommand.START


def test_bytes_past_the_second_mean_nothing() -> None:
    """A longer frame is the same command."""
    assert command_for(Frame(0, b"\1\5\xff\xff\xff\xff\xff\xff"), 5) is NmtCommand.START


@pytest.mark.parametrize(
    "frame",
    [
        Frame(0, b"\1\4"),
        Frame(0, b"\1\6"),
        Frame(0, b"\1\x85"),
        Frame(0, b"\3\5"),
        Frame(0, b"\0\5"),
        Frame(0, b"\x83\5"),
        Frame(0, b"\1"),
        Frame(0),
        Frame(0, remote=True, dlc=2),
        Frame(0, b"\1\5", extended=True),
        Frame(1, b"\1\5"),
    ],
    ids=str,
)
def test_everything_else_is_no_command(frame: Frame) -> None:
    """Other nodes, unknown commands, too few bytes, remote and extended frames are not taken."""
    assert command_for(frame, 5) is None


def test_states_have_the_values_of_error_control() -> None:
    """The bytes that a heartbeat shows: 00h boot-up, 04h, 05h, 7Fh."""
    assert {state.name: state.value for state in NmtState} == {
        "INITIALISING": 0x00,
        "STOPPED": 0x04,
        "OPERATIONAL": 0x05,
        "PRE_OPERATIONAL": 0x7F,
    }
