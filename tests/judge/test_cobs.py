"""The tester's reading of frames, held against literal bytes of the sources."""

from __future__ import annotations

import pytest

from hil_tests.judge.cobs import (
    LEADS_TO,
    SHOWN,
    Nmt,
    State,
    device_ids,
    long_nmt_for,
    nmt_for,
    nmt_frame,
    parameter_bytes,
)
from node_model.frame import Frame


@pytest.mark.parametrize(
    ("command", "text"),
    [
        (Nmt.START, "000#0105"),
        (Nmt.STOP, "000#0205"),
        (Nmt.PRE_OPERATIONAL, "000#8005"),
        (Nmt.RESET_NODE, "000#8105"),
        (Nmt.RESET_COMMUNICATION, "000#8205"),
    ],
)
def test_commands_are_the_bytes_of_cia_301(command: Nmt, text: str) -> None:
    """An NMT frame has identifier 0, the command and the node id."""
    assert str(nmt_frame(command, 5)) == text


@pytest.mark.parametrize("command", Nmt)
@pytest.mark.parametrize("to", [0, 5])
def test_a_command_to_the_node_or_to_all_is_read(command: Nmt, to: int) -> None:
    """Address 0 means all nodes."""
    assert nmt_for(nmt_frame(command, to), 5) is command


@pytest.mark.parametrize(
    "frame",
    [
        nmt_frame(Nmt.START, 6),
        nmt_frame(0x03, 5),
        Frame(0x001, b"\x01\x05"),
        Frame(0, b"\x01\x05", extended=True),
        Frame(0, remote=True, dlc=2),
        Frame(0, b"\x01"),
        Frame(0, b"\x01\x05\x00"),
    ],
    ids=str,
)
def test_everything_else_is_no_command(frame: Frame) -> None:
    """Other nodes, unknown commands, other identifiers, formats and lengths."""
    assert nmt_for(frame, 5) is None


def test_longer_frames_may_be_commands() -> None:
    """Their first two bytes count."""
    assert long_nmt_for(Frame(0, b"\x02\x05\x00"), 5) is Nmt.STOP
    assert long_nmt_for(Frame(0, b"\x02\x06\x00"), 5) is None


@pytest.mark.parametrize(
    "frame",
    [
        nmt_frame(Nmt.STOP, 5),
        Frame(0, b"\x02\x05\x00", extended=True),
        Frame(0, remote=True, dlc=3),
        Frame(1, b"\x02\x05\x00"),
    ],
    ids=str,
)
def test_only_longer_plain_frames_may_be(frame: Frame) -> None:
    """A regular frame is certain; the others are none."""
    assert long_nmt_for(frame, 5) is None


def test_identifiers_of_a_keypad() -> None:
    """EMCY, keys, SDO answer, error control, and the echo that depends on no id."""
    assert device_ids(5) == {0x085, 0x185, 0x585, 0x705, 0x3F8}
    assert device_ids(None) == {0x3F8}


def test_parameters_are_big_endian() -> None:
    """Byte 3 high, byte 4 low (keypad source)."""
    assert parameter_bytes(15, 3, 0x0102, 7, 9) == bytes.fromhex("0f 03 01 02 07 09")


def test_states_are_shown_as_cia_301_says() -> None:
    """04h stopped, 05h operational, 7Fh pre-operational; 00h is no state."""
    assert SHOWN == {
        0x04: State.STOPPED,
        0x05: State.OPERATIONAL,
        0x7F: State.PRE_OPERATIONAL,
    }
    assert str(State.PRE_OPERATIONAL) == "pre-operational"


def test_commands_lead_where_cia_301_says() -> None:
    """Both resets lead through initialisation."""
    assert [LEADS_TO[command] for command in Nmt] == [
        State.OPERATIONAL,
        State.STOPPED,
        State.PRE_OPERATIONAL,
        State.STARTING,
        State.STARTING,
    ]
