"""Scenes of a device with an object dictionary: operational, written to over SDO."""

from __future__ import annotations

from dataclasses import replace

from hil_tests.clock import MS
from hil_tests.judge.cobs import Nmt
from hil_tests.judge.expected import Expected, Family
from node_model.frame import Frame
from tests.judge.scene import NODE, Scene, device


def tolerances(period_ns: int) -> tuple[tuple[int, int], tuple[int, int]]:
    """Five and two percent."""
    each, mean = period_ns // 20, period_ns // 50
    return (period_ns - each, period_ns + each), (period_ns - mean, period_ns + mean)


def drive(*, exclusive: bool = True, heartbeat_ms: int = 100) -> Expected:
    """A node 5 with an object dictionary."""
    known = device(exclusive=exclusive, heartbeat_ms=None)
    known = replace(known, family=Family.CIA301, tolerances=tolerances)
    return known.beating(heartbeat_ms * MS)


def running(heartbeat_ms: int = 0, *, exclusive: bool = True) -> Scene:
    """A device that is operational since 200 ms."""
    scene = Scene(drive(exclusive=exclusive, heartbeat_ms=heartbeat_ms)).started()
    scene.command(Nmt.START, 60)
    return scene


def write(scene: Scene, request: str, at_ms: float, answer: str | None = None) -> None:
    """An SDO request of the tester, and 1 ms later the answer: written, unless it is another."""
    data = bytes.fromhex(request)
    scene.see(Frame(0x600 + NODE, data), at_ms, own=True)
    said = bytes.fromhex(answer) if answer else b"\x60" + data[1:4] + bytes(4)
    scene.see(Frame(0x580 + NODE, said), at_ms + 1)
