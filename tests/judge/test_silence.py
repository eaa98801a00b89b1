"""Frames of a device that is being commissioned: what forbids each of them (COM-01, COM-12)."""

from __future__ import annotations

import pytest

from hil_tests.judge.cobs import Nmt
from node_model.frame import Frame
from tests.judge.scene import BEAT, Scene, device

FOREIGN = [
    Frame(0x123, b"\x01"),
    Frame(0x185, b"\x00", extended=True),
    Frame(0x3F8, dlc=6, remote=True),
    Frame(0x3F8, bytes(6), extended=True),
]
MESSAGE = Frame(0x4F8, bytes((5, 2, 0, 100, 0, 1)))


def commissioned() -> Scene:
    """Powered up with the commissioning keys held."""
    scene = Scene()
    scene.power(0, on=True, mode="commissioning")
    return scene


@pytest.mark.parametrize("frame", FOREIGN, ids=str)
def test_a_frame_that_is_none_of_its_own_breaks_the_silence(frame: Frame) -> None:
    """Before the one message that is COM-01, after it COM-12; ROB-02 is for regular lives."""
    scene = commissioned()
    scene.see(frame, 500)
    scene.see(MESSAGE, 600, own=True)
    scene.see(frame, 700)
    assert scene.blamed(800) == ["COM-01", "COM-12"]
    regular = Scene().started()
    regular.see(frame, 60)
    assert regular.blamed(100) == ["ROB-02"]


def test_the_silence_begins_with_the_supply() -> None:
    """While it initialises it sends nothing either, and without power nothing at all."""
    scene = commissioned()
    scene.see(FOREIGN[0], 1)
    scene.power(100, on=False)
    scene.see(FOREIGN[0], 150)
    assert scene.blamed(200) == ["COM-01", "ROB-02"]


def test_a_boot_up_that_must_not_be_is_no_start() -> None:
    """It breaks the silence, and so does every beat that follows: the device still waits."""
    scene = commissioned()
    scene.boot(500)
    assert scene.blamed(550) == ["COM-01"]
    scene.beat(600)
    assert scene.blamed(650)[:2] == ["COM-01", "COM-01"]


def test_a_boot_up_in_the_echo() -> None:
    """Once it echoes it does nothing else."""
    scene = commissioned()
    scene.see(MESSAGE, 500, own=True)
    scene.see(Frame(0x3F8, MESSAGE.data), 510)
    scene.command(Nmt.RESET_NODE, 550)
    scene.boot(600)
    assert "COM-12" in scene.blamed(650)
    assert "COM-01" not in scene.blamed(650)


def test_keys_that_leave_the_mode_open_leave_the_start_open() -> None:
    """Where it may be regular a boot-up makes it so: beats are right from then on."""
    scene = Scene(device())
    scene.power(0, on=True, mode="either")
    scene.boot(50)
    scene.beats([150, 250])
    assert scene.blamed(300) == []
    scene.see(Frame(BEAT, b"\x05"), 350)
    assert scene.blamed(360) == ["NMT-03"]
