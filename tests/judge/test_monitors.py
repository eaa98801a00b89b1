"""The monitors: what each one blames, what it lets pass, and both sides of each limit."""

from __future__ import annotations

import pytest

from hil_tests.clock import MS
from hil_tests.judge.cobs import Nmt
from hil_tests.judge.verdict import Outcome
from node_model.frame import Frame
from tests.judge.scene import BEAT, NODE, Scene, device

EMCY = bytes.fromhex("0050010000000000")

# Allowed frames (ROB-02, KEY-07, COM-01, COM-12).


def test_without_a_node_id_a_strange_frame_is_nobodys() -> None:
    """It may well be one of the node's."""
    scene = Scene(device(node_id=None, heartbeat_ms=None))
    scene.see(Frame(0x705, b"\x05"), 10)
    assert scene.verdicts(100) == []


def test_a_regular_life_is_blamed_for_nothing() -> None:
    """Start, EMCY, beats, operational, key frame, SDO answer."""
    scene = Scene().started()
    scene.see(Frame(0x085, EMCY), 51)
    scene.beats([150, 250])
    scene.command(Nmt.START, 260)
    scene.see(Frame(0x185, b"\x00"), 261)
    scene.see(Frame(0x585, bytes(8)), 262)
    scene.beats([350, 450], 0x05)
    assert scene.verdicts(500) == []


@pytest.mark.parametrize(
    "frame",
    [
        Frame(0x123, b"\x01"),
        Frame(BEAT, dlc=1, remote=True),
        Frame(BEAT, b"\x7f", extended=True),
    ],
    ids=["identifier", "remote", "extended"],
)
def test_a_frame_that_is_none_of_its_own(frame: Frame) -> None:
    """Other identifiers, and its own ones in another format."""
    scene = Scene().started()
    scene.see(frame, 60)
    (verdict,) = scene.verdicts(100)
    assert verdict.requirement == "ROB-02"
    assert verdict.outcome is Outcome.FAIL
    assert "none of its frames" in verdict.text


def test_an_emcy_of_another_class_is_not_listed() -> None:
    """The one EMCY of a keypad tells of its hardware, 50xxh."""
    for data, blamed in (("0050", []), ("ff50", []), ("004f", ["ROB-02"]), ("0000", ["ROB-02"])):
        scene = Scene().started()
        scene.beats([150, 250])
        scene.see(Frame(0x085, bytes.fromhex(data + "01") + bytes(5)), 260)
        assert scene.blamed(300) == blamed


def test_the_emcy_of_a_start_is_judged_elsewhere() -> None:
    """Right after a boot-up the monitor leaves the code to the test of NMT-02."""
    scene = Scene().started()
    scene.see(Frame(0x085, bytes(8)), 60)
    assert scene.blamed(100) == []


@pytest.mark.parametrize(
    ("can_id", "size"), [(0x085, 7), (0x185, 0), (0x185, 2), (0x585, 7), (BEAT, 2), (BEAT, 0)]
)
def test_a_frame_of_wrong_length(can_id: int, size: int) -> None:
    """Each of its frames has one length; here in operational, where all are allowed."""
    scene = Scene().started()
    scene.command(Nmt.START, 51)
    scene.see(Frame(can_id, bytes([5] * size)), 140)
    (verdict,) = scene.verdicts(145)
    assert verdict.requirement == "ROB-02"
    assert f"with {size} bytes" in verdict.text


def test_a_key_frame_before_operational() -> None:
    """Pre-operational allows none."""
    scene = Scene().started()
    scene.see(Frame(0x185, b"\x00"), 60)
    (verdict,) = scene.verdicts(100)
    assert verdict.requirement == "KEY-07"
    assert "while it was pre-operational" in verdict.text


@pytest.mark.parametrize(("at_ms", "blamed"), [(310, []), (311, ["KEY-07"])])
def test_a_key_frame_after_operational(at_ms: int, blamed: list[str]) -> None:
    """Until a command must have acted one may still come."""
    scene = Scene().started()
    scene.command(Nmt.START, 110)
    scene.beats([150, 250], 0x05)
    scene.command(Nmt.STOP, 260)
    scene.see(Frame(0x185, b"\x00"), at_ms - 0.5)
    assert scene.blamed(320) == blamed


@pytest.mark.parametrize(("at_ms", "blamed"), [(150, []), (151, ["ROB-02"])])
def test_the_emcy_of_a_start_in_stopped(at_ms: int, blamed: list[str]) -> None:
    """A stopped node sends none, but that of its start may have been queued before."""
    scene = Scene().started()
    scene.command(Nmt.STOP, 60)
    scene.see(Frame(0x085, EMCY), at_ms)
    assert scene.blamed(151) == blamed


def test_no_other_frame_is_excused_by_a_start() -> None:
    """Key frames are none of it."""
    scene = Scene().started()
    scene.command(Nmt.STOP, 60)
    scene.see(Frame(0x185, bytes(1)), 149)
    assert scene.blamed(150) == ["KEY-07"]


def test_a_key_frame_of_a_late_host_is_inconclusive() -> None:
    """It may have been due while the node was operational."""
    scene = Scene().started()
    scene.command(Nmt.START, 110)
    scene.beats([150, 250], 0x05)
    scene.command(Nmt.STOP, 260)
    scene.see(Frame(0x185, b"\x00"), 340)
    scene.lateness.add(290 * MS, 341 * MS)
    (verdict,) = scene.verdicts(345)
    assert verdict.requirement == "KEY-07"
    assert verdict.outcome is Outcome.INCONCLUSIVE


def test_nothing_but_echo_in_commissioning() -> None:
    """Before the one message COM-01 is broken, after it COM-12."""
    scene = Scene()
    scene.power(0, on=True, mode="commissioning")
    scene.see(Frame(0x185, b"\x00"), 100)
    scene.see(Frame(0x4F8, bytes(6)), 200, own=True)
    scene.see(Frame(0x3F8, bytes(6)), 210)
    scene.see(Frame(0x185, b"\x00"), 300)
    assert scene.blamed(400) == ["COM-01", "COM-12"]


def test_a_regular_life_in_commissioning_is_no_start() -> None:
    """Boot-up, beats and strange frames are held against the wait alone, not against a start."""
    scene = Scene()
    scene.power(0, on=True, mode="commissioning")
    scene.see(Frame(BEAT, b"\x00"), 50)
    scene.see(Frame(0x589, bytes(8)), 60)
    scene.beats([150, 400])
    assert scene.blamed(3000) == ["COM-01"] * 4


def test_an_echo_without_a_message() -> None:
    """A new power-up needs a new message."""
    scene = Scene()
    scene.power(0, on=True, mode="commissioning")
    scene.see(Frame(0x4F8, bytes(6)), 200, own=True)
    scene.power(300, on=False)
    scene.power(500, on=True, mode="commissioning")
    scene.see(Frame(0x3F8, bytes(6)), 600)
    assert scene.blamed(700) == ["COM-01"]


def test_a_reset_by_command_forgets_no_message() -> None:
    """Only power does; NMT is not obeyed in commissioning."""
    scene = Scene()
    scene.power(0, on=True, mode="either")
    scene.see(Frame(0x4F8, bytes(6)), 200, own=True)
    scene.command(Nmt.RESET_NODE, 250)
    scene.see(Frame(0x3F8, bytes(6)), 300)
    assert scene.blamed(400) == []


def test_an_extended_4f8h_is_no_message() -> None:
    """It must not be taken for one (COM-24)."""
    scene = Scene()
    scene.power(0, on=True, mode="commissioning")
    scene.see(Frame(0x4F8, bytes(6), extended=True), 200, own=True)
    scene.see(Frame(0x3F8, bytes(6)), 300)
    assert scene.blamed(400) == ["COM-01"]


# Boot-up (NMT-02).


def test_a_second_boot_up() -> None:
    """One power-on, one boot-up."""
    scene = Scene().started()
    scene.boot(60)
    (verdict,) = scene.verdicts(100)
    assert verdict.requirement == "NMT-02"
    assert "without a reset" in verdict.text


@pytest.mark.parametrize(("until_ms", "blamed"), [(1000, []), (1001, ["NMT-02"])])
def test_a_missing_boot_up(until_ms: int, blamed: list[str]) -> None:
    """It may come until its limit."""
    scene = Scene()
    scene.power(0, on=True)
    assert scene.blamed(until_ms) == blamed


@pytest.mark.parametrize("end", ["off", "reset"])
def test_a_boot_up_missing_when_the_next_start_comes(end: str) -> None:
    """What is overdue then is told, once."""
    scene = Scene()
    scene.power(0, on=True)
    if end == "off":
        scene.power(1500, on=False)
    else:
        scene.command(Nmt.RESET_NODE, 1500)
        scene.boot(1600)
    assert scene.blamed(1601) == ["NMT-02"]


def test_nothing_is_owed_without_power() -> None:
    """A start that was cut short is none."""
    scene = Scene()
    scene.power(0, on=True)
    scene.power(500, on=False)
    assert scene.blamed(5000) == []


@pytest.mark.parametrize("command", [Nmt.RESET_NODE, Nmt.RESET_COMMUNICATION])
def test_each_reset_is_answered_by_one(command: Nmt) -> None:
    """Two commands, the second while the node starts: one boot-up or two."""
    for boots in ([120], [120, 130]):
        scene = Scene().started()
        scene.command(command, 100)
        scene.command(command, 110)
        for instant in boots:
            scene.boot(instant)
        assert scene.blamed(150) == []


def test_a_frame_before_boot_up_after_power_on() -> None:
    """Boot-up comes first of all."""
    scene = Scene()
    scene.power(0, on=True)
    scene.see(Frame(0x085, EMCY), 40)
    scene.boot(50)
    (verdict,) = scene.verdicts(100)
    assert verdict.requirement == "NMT-02"
    assert "before the boot-up" in verdict.text


@pytest.mark.parametrize(("at_ms", "blamed"), [(150, []), (151, ["NMT-06"])])
def test_a_frame_before_boot_up_after_a_command(at_ms: int, blamed: list[str]) -> None:
    """Until the command must have acted the node still lives its old life."""
    scene = Scene().started()
    scene.command(Nmt.RESET_NODE, 100)
    scene.see(Frame(0x085, EMCY), at_ms)
    scene.boot(160)
    assert scene.blamed(200) == blamed


def test_a_frame_of_a_late_host_before_boot_up() -> None:
    """It was due before the reset had acted: no blame at all."""
    scene = Scene().started()
    scene.command(Nmt.RESET_NODE, 100)
    scene.see(Frame(0x085, EMCY), 155)
    scene.boot(160)
    scene.lateness.add(120 * MS, 156 * MS)
    assert scene.blamed(200) == []


@pytest.mark.parametrize("length", [3, 8])
@pytest.mark.parametrize("obeyed", [True, False])
def test_a_longer_reset_may_be_obeyed_or_not(length: int, obeyed: bool) -> None:
    """NMT-21 leaves it open: one boot-up may follow, not two."""
    scene = Scene().started()
    scene.beats([150, 250])
    scene.see(Frame(0, bytes((0x81, NODE)).ljust(length, b"\0")), 260, own=True)
    if obeyed:
        scene.boot(270)
        scene.beats([370, 470])
        assert scene.blamed(500) == []
        scene.boot(480)
        assert scene.blamed(500) == ["NMT-02"]
    else:
        scene.beats([350, 450])
        assert scene.blamed(500) == []


def test_a_boot_up_across_a_loss() -> None:
    """What is owed may have been lost, or may come; the next start is strict again."""
    scene = Scene()
    scene.power(0, on=True)
    scene.event(40)
    assert scene.blamed(3000) == []

    scene = Scene()
    scene.power(0, on=True)
    scene.event(40)
    scene.boot(50)
    scene.power(100, on=False)
    scene.started(1000)
    scene.boot(1060)
    assert scene.blamed(1100) == ["NMT-02"]


def test_keys_that_leave_the_mode_open() -> None:
    """The node may boot, once, or may not."""
    for boots, blamed in (([], []), ([50], []), ([50, 60], ["NMT-02"])):
        scene = Scene()
        scene.power(0, on=True, mode="either")
        for instant in boots:
            scene.boot(instant)
        assert scene.blamed(100) == blamed
