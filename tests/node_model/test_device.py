"""A CiA 301 device: power, initialisation, NMT, what is reset by what, its memory."""

from __future__ import annotations

import pytest

from node_model.devices import make_device
from node_model.frame import Frame
from node_model.node import MS
from tests.node_model.rig import Rig

BOOT_UP = Frame(0x705, b"\0")
RESET_NODE, RESET_COMMUNICATION = 0x81, 0x82


def rig(**settings: int) -> Rig:
    """A drive, switched off; without heartbeat if nothing else is said."""
    device = make_device("drive", settings={"node_id": 5, "heartbeat_ms": 0, **settings})
    return Rig(device, settings.get("node_id", 5))


def running(**settings: int) -> Rig:
    """A drive 60 ms after power-on."""
    found = rig(**settings)
    assert found.power_on() == [Frame(0x700 + found.node_id, b"\0")]
    return found


# Start and NMT.


def test_boot_up_is_the_first_word() -> None:
    """Then one heartbeat a period, with the state."""
    drive = rig(heartbeat_ms=20)
    assert drive.device.power_on(0) == ()
    assert drive.send(0, 1, 5) == []
    assert drive(49) == []
    assert drive(91) == [BOOT_UP, *2 * [Frame(0x705, b"\x7f")]]
    assert [at for at, _ in drive.said] == [50 * MS, 70 * MS, 90 * MS]


def test_power_on_twice_is_once() -> None:
    """A powered device does not start again."""
    drive = running()
    assert drive.device.power_on(200 * MS) == ()
    assert drive.device.deadline() is None


def test_power_off_is_silence() -> None:
    """Nothing is due, nothing is heard."""
    drive = running(heartbeat_ms=20)
    drive.power_off()
    assert (drive.device.powered, drive.device.bit_rate) == (False, 0)
    assert drive.nmt(RESET_NODE) == []
    assert drive.device.deadline() is None


@pytest.mark.parametrize(("command", "state"), [(1, 0x05), (2, 0x04), (0x80, 0x7F)])
def test_a_command_leads_to_its_state(command: int, state: int) -> None:
    """The next heartbeat shows it."""
    drive = running(heartbeat_ms=20)
    drive.nmt(command)
    assert drive(71) == [Frame(0x705, bytes((state,)))]


def test_a_command_for_another_is_none() -> None:
    """Node 6 is somebody else."""
    drive = running(heartbeat_ms=20)
    assert drive.send(0, 1, 6) == []
    assert drive(71) == [Frame(0x705, b"\x7f")]


def test_extended_frames_are_none_of_its() -> None:
    """29-bit identifiers mean nothing here."""
    drive = running(heartbeat_ms=20)
    drive.device.receive(Frame(0, b"\x01\x05", extended=True), drive.now)
    assert drive(71) == [Frame(0x705, b"\x7f")]


@pytest.mark.parametrize("command", [RESET_NODE, RESET_COMMUNICATION])
def test_a_reset_ends_with_boot_up(command: int) -> None:
    """After 10 ms without ears; communication objects have their power-on values."""
    drive = running(heartbeat_ms=20)
    drive.write(0x1017, 0, 0, 2)
    assert drive.nmt(command) == []
    assert drive.nmt(0x01) == []
    assert drive(70) == [BOOT_UP]
    assert drive.read(0x1017) == 20


def test_only_reset_node_restores_the_application() -> None:
    """Reset communication leaves 2000h and above as they are."""
    drive = running()
    drive.write(0x2011, 0, 42, 2)
    drive.nmt(RESET_COMMUNICATION)
    drive(80)
    assert drive.read(0x2011) == 42
    drive.nmt(RESET_NODE)
    drive(100)
    assert drive.read(0x2011) == 0


# Services.


def test_a_new_cob_id_is_listened_to_at_once() -> None:
    """SYNC at 81h instead of 80h, from the answer of the SDO on."""
    drive = running()
    drive.write(0x1005, 0, 0x81, 4)
    assert {0x000, 0x605, 0x705, 0x7E5, 0x081} <= (drive.device.listens_to or set())
    assert 0x080 not in (drive.device.listens_to or {0x080})


def test_what_a_write_causes_follows_its_answer() -> None:
    """An event-driven PDO with the new status, at the same instant."""
    drive = running()
    drive.nmt(1)
    drive(100)
    assert drive.write(0x6040, 0, 0x06, 2) == [Frame(0x285, b"\x31\x02\x08")]


def test_lost_life_guarding_changes_the_state() -> None:
    """1029h:01 = 0: from operational to pre-operational, after the EMCY."""
    drive = running()
    drive.write(0x100C, 0, 10, 2)
    drive.write(0x100D, 0, 2, 1)
    drive.nmt(1)
    assert drive.send(0x705, remote=True) == [Frame(0x705, b"\x05")]
    assert [frame.can_id for frame in drive(80)] == [0x085]
    assert drive.send(0x705, remote=True)[0] == Frame(0x705, b"\xff")


def test_a_late_host_gets_the_same_frames() -> None:
    """Boot-up, beats and what an error does, in one call."""
    frames = [Frame(0x705, b"\0"), Frame(0x705, b"\x7f"), Frame(0x705, b"\x7f")]
    drive = rig(heartbeat_ms=20)
    drive.device.power_on(0)
    assert list(drive.device.advance(90 * MS)) == frames


# Memory.


def test_saved_parameters_survive() -> None:
    """1010h, and then power goes."""
    drive = running()
    drive.write(0x1017, 0, 30, 2)
    drive.write(0x1010, 1, 0x65766173, 4)
    drive(200)
    drive.power_off()
    assert drive.power_on(80)[1:] == [Frame(0x705, b"\x7f")]
    reborn = Rig(make_device("drive", image=drive.device.image()))
    assert reborn.power_on(80)[1:] == [Frame(0x705, b"\x7f")]


def test_a_reset_completes_what_is_being_stored() -> None:
    """Only a power cut interrupts it."""
    drive = running()
    drive.write(0x1017, 0, 30, 2)
    drive.write(0x1010, 1, 0x65766173, 4)
    drive.nmt(RESET_NODE)
    drive(80)
    assert drive.read(0x1017) == 30


# LSS.


def configure(drive: Rig, node_id: int) -> None:
    """LSS configuration and a node id."""
    assert drive.send(0x7E5, 4, 1, 0, 0, 0, 0, 0, 0) == []
    (answer,) = drive.send(0x7E5, 0x11, node_id, 0, 0, 0, 0, 0, 0)
    assert answer == Frame(0x7E4, b"\x11" + bytes(7))


def test_a_node_id_over_lss_acts_at_the_next_reset() -> None:
    """COB-IDs follow it, the application's objects stay; a power cut forgets it."""
    drive = running()
    drive.write(0x2011, 0, 42, 2)
    configure(drive, 9)
    assert drive.read(0x1014) == 0x85
    drive.nmt(RESET_COMMUNICATION)
    assert drive(80) == [Frame(0x709, b"\0")]
    drive.node_id = 9
    assert drive.read(0x1014) == 0x89
    assert drive.read(0x2011) == 42
    drive.power_off()
    assert drive.power_on() == [BOOT_UP]


def test_a_stored_node_id_survives() -> None:
    """17h, and the bit rate with it."""
    drive = running()
    configure(drive, 9)
    drive.send(0x7E5, 0x13, 0, 4, 0, 0, 0, 0, 0)
    assert drive.send(0x7E5, 0x17, 0, 0, 0, 0, 0, 0, 0) == [Frame(0x7E4, b"\x17" + bytes(7))]
    drive(100)
    drive.power_off()
    assert drive.power_on() == [Frame(0x709, b"\0")]
    assert drive.device.bit_rate == 125_000
    reborn = Rig(make_device("drive", image=drive.device.image()))
    assert reborn.power_on() == [Frame(0x709, b"\0")]


def test_a_power_cut_while_storing_leaves_the_old_one() -> None:
    """Nothing is half stored."""
    drive = running()
    configure(drive, 9)
    drive.send(0x7E5, 0x17, 0, 0, 0, 0, 0, 0, 0)
    drive(60.2)
    drive.power_off()
    assert drive.power_on() == [BOOT_UP]


def test_without_node_id_there_is_lss_alone() -> None:
    """No boot-up, no heartbeat, no SDO, no NMT; the first node id starts it at once."""
    drive = rig(node_id=255, heartbeat_ms=20)
    assert drive.power_on(100) == []
    assert drive.device.listens_to == frozenset((0x000, 0x7E5))
    assert drive.nmt(RESET_NODE) == []
    assert drive.request(0x40, 0, 0x10, 0) == []
    assert drive.fail("encoder") == []
    configure(drive, 9)
    assert drive.send(0x7E5, 4, 0, 0, 0, 0, 0, 0, 0) == []
    assert [frame.can_id for frame in drive(130)] == [0x709, 0x089, 0x709]


def test_a_configured_node_can_lose_its_node_id() -> None:
    """255 over LSS, then a reset: silence."""
    drive = running(heartbeat_ms=20)
    configure(drive, 255)
    drive.nmt(RESET_COMMUNICATION)
    assert drive(200) == []
    assert drive.send(0x7E5, 0x4C, 0, 0, 0, 0, 0, 0, 0) == [Frame(0x7E4, b"\x50" + bytes(7))]


def test_a_bit_rate_over_lss_comes_after_two_delays_of_silence() -> None:
    """15h: deaf and mute, then at the new rate; the beats keep their grid."""
    drive = running(heartbeat_ms=20)
    configure(drive, 5)
    drive.send(0x7E5, 0x13, 0, 4, 0, 0, 0, 0, 0)
    assert drive.send(0x7E5, 0x15, 25, 0, 0, 0, 0, 0, 0) == []
    assert (drive.device.bit_rate, drive.device.listens_to) == (0, frozenset())
    assert drive.nmt(RESET_NODE) == []
    assert drive(109.9) == []
    drive(110)
    assert drive.device.bit_rate == 125_000
    assert drive.said[-1] == (110 * MS, Frame(0x705, b"\x7f"))
    assert 0x605 in (drive.device.listens_to or set())


# What it has not.


def test_what_it_has_not_is_refused() -> None:
    """No keys, no LEDs; errors by name."""
    device = running().device
    assert list(device.hold(frozenset(), 0)) == []
    assert device.lamp_change(0) is None
    with pytest.raises(ValueError, match="no key x; this drive has none"):
        device.hold(frozenset("x"), 0)
    with pytest.raises(ValueError, match="no LED x; this drive has none"):
        device.lit("x", 0)
    with pytest.raises(ValueError, match="no fault x; this drive has overcurrent, under"):
        device.fail(frozenset("x"), 0)
