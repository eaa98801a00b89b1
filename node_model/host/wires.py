"""The wires of a host: how it reaches the bus, without waiting.

`SocketCanWire` uses a raw socket with the kernel's ns stamps, because every microsecond
of the model's own computing shows up as latency; other interfaces go through python-can
(`pythoncan`).
"""

from __future__ import annotations

import errno
import socket
import struct
import time
from typing import Protocol

from node_model.frame import Frame


class WireError(Exception):
    """The bus cannot be reached; the text says what to do about it."""


class Wire(Protocol):
    """The host's end of the bus. Frames that the host sends never come back to it."""

    name: str
    """For people: "vcan0"."""

    descriptor: int | None
    """Readable when a frame is there; None where the interface offers none."""

    def receive(self) -> tuple[Frame, int] | None:
        """The next frame with its stamp (CLOCK_REALTIME, ns), or None.

        Raises:
            WireError: the interface is gone.
        """

    def send(self, frame: Frame) -> bool:
        """Send a frame; False = the queue is full, try again.

        Raises:
            WireError: the interface is gone.
        """

    def close(self) -> None:
        """Leave the bus."""


# <linux/can.h>
_EFF_FLAG = 0x8000_0000
_RTR_FLAG = 0x4000_0000
_EFF_MASK = 0x1FFF_FFFF
_SFF_MASK = 0x7FF
_MTU = 16
_CAN_FRAME = struct.Struct("=IBxxB8s")

# <asm-generic/socket.h>
_SO_RCVBUFFORCE = 33
_SO_TIMESTAMPNS = 35
_TIMESPEC = struct.Struct("@ll")
_ROOM = socket.CMSG_SPACE(_TIMESPEC.size)
_RECEIVE_BUFFER = 8 << 20
"""So that a host that is stopped for seconds loses nothing of a busy bus."""
_MOST_CACHED = 4096
_FULL = (errno.EAGAIN, errno.ENOBUFS)


class SocketCanWire:
    """A raw CAN socket.

    Args:
        channel: the interface, e.g. "vcan0".

    Raises:
        WireError: there is none, or this machine has no CAN sockets.
    """

    def __init__(self, channel: str) -> None:
        self.name = channel
        self._cache: dict[bytes, Frame] = {}
        try:
            self._socket = socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
        except (OSError, AttributeError) as error:
            raise WireError(f"no CAN sockets here ({error}); on Linux: modprobe can-raw") from None
        try:
            socket.if_nametoindex(channel)
            self._socket.setsockopt(socket.SOL_SOCKET, _SO_TIMESTAMPNS, 1)
            self._enlarge_buffer()
            self._socket.bind((channel,))
        except OSError as error:
            self._socket.close()
            raise WireError(
                f"no CAN interface {channel!r} ({error}); make one: "
                "ip link add dev vcan0 type vcan; ip link set vcan0 up"
            ) from None
        self._socket.setblocking(False)
        self.descriptor: int | None = self._socket.fileno()

    def _enlarge_buffer(self) -> None:
        try:
            self._socket.setsockopt(socket.SOL_SOCKET, _SO_RCVBUFFORCE, _RECEIVE_BUFFER)
        except OSError:  # needs CAP_NET_ADMIN; without it, as much as the system allows
            self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _RECEIVE_BUFFER)

    def receive(self) -> tuple[Frame, int] | None:
        """The next frame with its stamp, or None."""
        while True:
            try:
                raw, notes, _, _ = self._socket.recvmsg(_MTU, _ROOM)
            except BlockingIOError:
                return None
            except OSError as error:
                if error.errno == errno.ENETDOWN:
                    continue  # told once; a device outlives that its bus is unplugged
                raise WireError(f"interface {self.name!r} went away ({error})") from None
            at = 0
            for _, kind, body in notes:
                if kind == _SO_TIMESTAMPNS:
                    seconds, ns = _TIMESPEC.unpack(body)
                    at = seconds * 1_000_000_000 + ns
            frame = self._cache.get(raw)
            return frame or self._decode(raw), at or time.time_ns()

    def _decode(self, raw: bytes) -> Frame:
        word, size, code, data = _CAN_FRAME.unpack(raw)
        extended, remote = bool(word & _EFF_FLAG), bool(word & _RTR_FLAG)
        dlc = code if size == 8 and 8 < code < 16 else size
        can_id = word & (_EFF_MASK if extended else _SFF_MASK)
        frame = Frame(can_id, b"" if remote else data[:size], remote, extended, dlc)
        if len(self._cache) >= _MOST_CACHED:
            self._cache.clear()
        self._cache[raw] = frame
        return frame

    def send(self, frame: Frame) -> bool:
        """Send a frame; False = the queue is full. While the interface is down it is lost."""
        word = frame.can_id | frame.extended << 31 | frame.remote << 30
        dlc = frame.dlc
        raw = _CAN_FRAME.pack(word, min(dlc, 8), dlc if dlc > 8 else 0, frame.data)
        try:
            self._socket.send(raw)
        except OSError as error:
            if error.errno in _FULL:
                return False
            if error.errno != errno.ENETDOWN:
                raise WireError(f"interface {self.name!r} went away ({error})") from None
        return True

    def close(self) -> None:
        """Leave the bus."""
        self._socket.close()
