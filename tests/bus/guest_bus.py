"""What the checks on a real vcan0 share: the tester's port, a stranger, and the interface."""

from __future__ import annotations

import contextlib
import socket
import struct
import subprocess
from collections.abc import Iterator
from typing import Any

from hil_tests.bench.action import Action
from hil_tests.bus.choose import open_port
from hil_tests.bus.socketcan import SocketCanPort
from hil_tests.clock import S
from hil_tests.trace import Sighting

CHANNEL = "vcan0"


@contextlib.contextmanager
def port() -> Iterator[SocketCanPort]:
    """The tester's port."""
    with contextlib.closing(open_port("socketcan", CHANNEL)) as opened:
        assert isinstance(opened, SocketCanPort)
        yield opened


@contextlib.contextmanager
def stranger(fd_frames: bool = False) -> Iterator[socket.socket]:
    """Another socket on the same interface."""
    with socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW) as other:
        if fd_frames:
            other.setsockopt(socket.SOL_CAN_RAW, socket.CAN_RAW_FD_FRAMES, 1)
        other.bind((CHANNEL,))
        yield other


def classical(can_id: int, data: bytes) -> bytes:
    """struct can_frame, written independently of the code under test."""
    return struct.pack("=IB3x8s", can_id, len(data), data)


def next_frame(opened: SocketCanPort, span_ns: int = S) -> Sighting:
    """The next frame; nothing else may come."""
    found = opened.next(opened.now() + span_ns)
    assert isinstance(found, Sighting), found
    return found


def finish(opened: SocketCanPort, action: Action[Any]) -> Any:
    """Start an action and wait for it in the port's loop."""
    action.start(opened.now())
    while not action.poll(opened.now()):
        opened.next(action.wake_at, action.descriptors)
    return action.result()


def run_ip(*arguments: str) -> None:
    """Change the interface."""
    subprocess.run(["ip", *arguments], check=True)
