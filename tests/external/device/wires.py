"""The wire of the independent keypad: SocketCAN, or an interface of python-can."""

from __future__ import annotations

import contextlib
import socket
import struct
from collections.abc import Iterator
from typing import Any, NamedTuple, Protocol


class Frame(NamedTuple):
    """A classical CAN frame."""

    ident: int
    data: bytes = b""
    extended: bool = False
    remote: bool = False


class Line(Protocol):
    """The wire, as this program uses it."""

    def fileno(self) -> int:
        """What to select on."""
        ...

    def send(self, frame: Frame) -> None:
        """Send, or lose, one frame."""
        ...

    def drain(self) -> Iterator[Frame]:
        """Every frame that waits."""
        ...


class SocketCan:
    """A raw CAN socket of Linux."""

    LAYOUT = struct.Struct("=IB3x8s")

    def __init__(self, channel: str) -> None:
        self._socket = socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
        self._socket.bind((channel,))
        self._socket.setblocking(False)

    def fileno(self) -> int:
        """What to select on."""
        return self._socket.fileno()

    def send(self, frame: Frame) -> None:
        """Send one frame; a full queue loses it, as an overrun controller would."""
        with contextlib.suppress(OSError):
            self._socket.send(self.LAYOUT.pack(frame.ident, len(frame.data), frame.data))

    def drain(self) -> Iterator[Frame]:
        """Every frame that waits."""
        while True:
            try:
                raw = self._socket.recv(self.LAYOUT.size)
            except OSError:
                return
            ident, length, data = self.LAYOUT.unpack(raw)
            extended, remote = bool(ident & 0x8000_0000), bool(ident & 0x4000_0000)
            size = 0 if remote else min(length, 8)
            yield Frame(ident & 0x1FFF_FFFF, data[:size], extended, remote)


class PythonCan:
    """Any interface of python-can that has a file number, e.g. udp_multicast."""

    def __init__(self, interface: str, channel: str) -> None:
        import can  # noqa: PLC0415 - SocketCAN does without

        self._can = can
        group, _, port = channel.partition(":")
        more: dict[str, Any] = {"port": int(port)} if port else {}
        self._bus = can.Bus(interface=interface, channel=group, **more)

    def fileno(self) -> int:
        """What to select on."""
        return self._bus.fileno()

    def send(self, frame: Frame) -> None:
        """Send one frame."""
        with contextlib.suppress(self._can.CanError):
            self._bus.send(
                self._can.Message(
                    arbitration_id=frame.ident, data=frame.data, is_extended_id=False
                )
            )

    def drain(self) -> Iterator[Frame]:
        """Every frame that waits."""
        while (seen := self._bus.recv(0)) is not None:
            if seen.is_error_frame or seen.is_fd:
                continue
            yield Frame(
                seen.arbitration_id, bytes(seen.data), seen.is_extended_id, seen.is_remote_frame
            )
