"""Raw CAN sockets of Linux: constants, the kernel's frame layout, and the set-up.

References: Linux Documentation/networking/can.rst and timestamping.rst, <linux/can.h>,
<linux/can/raw.h>, <asm-generic/socket.h> (the same on x86, Arm, RISC-V and PowerPC).
"""

from __future__ import annotations

import socket
import struct

from hil_tests.errors import BusUnavailable
from node_model.frame import Frame

# <linux/can.h>, <linux/can/raw.h>; written here because `socket` lacks them off Linux.
EFF_FLAG = 0x8000_0000
RTR_FLAG = 0x4000_0000
ERR_FLAG = 0x2000_0000
_EFF_MASK = 0x1FFF_FFFF
_SFF_MASK = 0x7FF
ERR_MASK = 0x1FFF_FFFF
_CAN_RAW_ERR_FILTER = 2
CAN_MTU = 16
CANFD_MTU = 72
CAN_FRAME = struct.Struct("=IBxxB8s")

# <asm-generic/socket.h>; the same on x86, Arm, RISC-V and PowerPC.
_SO_RCVBUFFORCE = 33
SO_TIMESTAMPNS = 35
SO_TIMESTAMPING = 37
SO_RXQ_OVFL = 40
_RX_STAMPS = 1 << 2 | 1 << 3 | 1 << 4 | 1 << 6
"""SOF_TIMESTAMPING_ RX_HARDWARE, RX_SOFTWARE, SOFTWARE, RAW_HARDWARE."""
MSG_CONFIRM = 0x800
MSG_CUT = 0x20 | 0x08 | 0x2000
"""MSG_TRUNC, MSG_CTRUNC, MSG_ERRQUEUE: no whole frame with all its notes."""
TIMESPEC = struct.Struct("@ll")
TIMESPECS = struct.Struct("@6l")
ROOM = socket.CMSG_SPACE(TIMESPECS.size) + socket.CMSG_SPACE(4)

RECEIVE_BUFFER = 8 << 20
"""Bytes; with the default buffer a busy reader lost 19 722 of 20 000 frames, with this none."""


def pack(frame: Frame) -> bytes:
    """A frame as the kernel's struct can_frame; DLC 9..15 goes in len8_dlc."""
    word = frame.can_id | frame.extended << 31 | frame.remote << 30
    dlc = frame.dlc
    return CAN_FRAME.pack(word, min(dlc, 8), dlc if dlc > 8 else 0, frame.data)


def unpack(raw: bytes) -> Frame:
    """The frame in a struct can_frame (no error frame)."""
    word, size, code, data = CAN_FRAME.unpack(raw)
    extended = bool(word & EFF_FLAG)
    remote = bool(word & RTR_FLAG)
    dlc = code if size == 8 and 8 < code < 16 else size
    can_id = word & (_EFF_MASK if extended else _SFF_MASK)
    return Frame(can_id, b"" if remote else data[:size], remote, extended, dlc)


def raw_socket() -> socket.socket:
    """A raw CAN socket, or the reason why this machine has none."""
    try:
        return socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
    except (OSError, AttributeError) as error:
        raise BusUnavailable(
            f"this machine offers no CAN sockets ({error}); on Linux: modprobe can-raw; or "
            "run where they exist: nodeproof vcan -- pytest ..."
        ) from None


def set_options(sock: socket.socket, simulated: bool) -> None:
    """Own frames, error frames, FD frames, drop counter, stamps and a large buffer."""
    raw = socket.SOL_CAN_RAW
    sock.setsockopt(raw, socket.CAN_RAW_RECV_OWN_MSGS, 1)
    sock.setsockopt(raw, _CAN_RAW_ERR_FILTER, ERR_MASK)
    sock.setsockopt(raw, socket.CAN_RAW_FD_FRAMES, 1)
    sock.setsockopt(socket.SOL_SOCKET, SO_RXQ_OVFL, 1)
    if simulated:
        sock.setsockopt(socket.SOL_SOCKET, SO_TIMESTAMPNS, 1)
    else:
        sock.setsockopt(socket.SOL_SOCKET, SO_TIMESTAMPING, _RX_STAMPS)
    try:
        sock.setsockopt(socket.SOL_SOCKET, _SO_RCVBUFFORCE, RECEIVE_BUFFER)
    except OSError:  # needs CAP_NET_ADMIN; without it, as much as the system allows
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, RECEIVE_BUFFER)
