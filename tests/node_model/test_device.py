"""A CiA 301 device: power, initialisation, NMT, what is reset by what."""

from __future__ import annotations

import pytest

from node_model.devices import make_device
from node_model.drive import Drive
from node_model.frame import Frame
from node_model.nmt import NmtCommand
from node_model.node import MS
from tests.node_model.driving import Step, frames_of, play

BOOT_UP = Frame(0x705, b"\0")


def drive(**settings: int) -> Drive:
    """A drive, switched off."""
    panel = make_device("drive", settings={"node_id": 5, "heartbeat_ms": 0, **settings})
    assert isinstance(panel, Drive)
    return panel


def booted(**settings: int) -> Drive:
    """A drive 100 ms after power-on."""
    device = drive(**settings)
    play(device, (Step(0, True), Step(100 * MS, None)))
    return device


def order(device: Drive, command: NmtCommand, now: int) -> None:
    """An NMT command; nothing is said at once."""
    assert not device.receive(Frame(0, bytes((command, 5))), now)


def test_boot_up_is_the_first_word() -> None:
    """Then one heartbeat a period, with the state."""
    device = drive(heartbeat_ms=20)
    assert frames_of(play(device, (Step(0, True), Step(49 * MS, None)))) == []
    assert device.deadline() == 50 * MS
    assert list(device.advance(91 * MS)) == [BOOT_UP, *2 * [Frame(0x705, b"\x7f")]]


def test_power_on_twice_is_once() -> None:
    """A powered device does not start again."""
    device = booted()
    assert device.power_on(200 * MS) == ()
    assert device.deadline() is None


def test_power_off_is_silence() -> None:
    """Nothing is due, nothing is heard."""
    device = booted(heartbeat_ms=20)
    device.power_off(100 * MS)
    assert (device.powered, device.bit_rate, device.deadline()) == (False, 0, None)
    assert device.receive(Frame(0, b"\x81\x05"), 110 * MS) == ()
    assert device.deadline() is None


@pytest.mark.parametrize(
    ("command", "state"),
    [
        (NmtCommand.START, 0x05),
        (NmtCommand.STOP, 0x04),
        (NmtCommand.PRE_OPERATIONAL, 0x7F),
    ],
)
def test_a_command_leads_to_its_state(command: NmtCommand, state: int) -> None:
    """The next heartbeat shows it."""
    device = booted(heartbeat_ms=20)
    order(device, command, 101 * MS)
    assert list(device.advance(110 * MS)) == [Frame(0x705, bytes((state,)))]


def test_a_command_for_another_is_none() -> None:
    """Node 6 is somebody else."""
    device = booted(heartbeat_ms=20)
    assert not device.receive(Frame(0, b"\x01\x06"), 101 * MS)
    assert list(device.advance(110 * MS)) == [Frame(0x705, b"\x7f")]


@pytest.mark.parametrize("command", [NmtCommand.RESET_NODE, NmtCommand.RESET_COMMUNICATION])
def test_a_reset_ends_with_boot_up(command: NmtCommand) -> None:
    """And with power-on values of the communication objects."""
    device = booted(heartbeat_ms=20)
    device.od.put_number(0x1017, 0, 0)
    order(device, command, 101 * MS)
    assert device.receive(Frame(0, b"\x01\x05"), 102 * MS) == ()
    assert list(device.advance(111 * MS)) == [BOOT_UP]
    assert device.od.number(0x1017) == 20


def test_what_it_has_not_is_refused() -> None:
    """No keys, no LEDs; errors by name."""
    device = booted()
    assert list(device.hold(frozenset(), 0)) == []
    assert device.lamp_change(0) is None
    assert "overcurrent" in device.faults
    assert list(device.fail(frozenset(("overcurrent",)), 100 * MS)) == []
    with pytest.raises(ValueError, match="no key x; this drive has none"):
        device.hold(frozenset("x"), 0)
    with pytest.raises(ValueError, match="no LED x; this drive has none"):
        device.lit("x", 0)
    with pytest.raises(ValueError, match="no fault x; this drive has overcurrent, under"):
        device.fail(frozenset("x"), 0)
