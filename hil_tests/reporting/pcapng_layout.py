"""Layout of a pcapng file (draft-ietf-opsawg-pcapng) as far as a trace needs it.

We write big-endian sections: SocketCAN headers in a capture are big-endian anyhow
(LINKTYPE_CAN_SOCKETCAN), so one pattern serves a whole block.
"""

from __future__ import annotations

import re
import struct

SECTION_HEADER = 0x0A0D0D0A
INTERFACE_DESCRIPTION = 1
SIMPLE_PACKET = 3
ENHANCED_PACKET = 6
BYTE_ORDER_MAGIC = 0x1A2B3C4D

END_OF_OPTIONS = 0
COMMENT = 1
SHB_USERAPPL = 4
IF_NAME = 2
IF_DESCRIPTION = 3
IF_TSRESOL = 9
IF_TSOFFSET = 14
EPB_FLAGS = 2

INBOUND = 1
OUTBOUND = 2
DIRECTION_MASK = 3

CAN_SOCKETCAN = 227
"""Link type: identifier and flags, length, FD flags, reserved, DLC above 8, then the data."""

UPPER_PDU = 252
"""Link type: tags and an exported payload."""

NANOSECONDS = 9
"""if_tsresol: stamps count units of 10**-9 s."""

CAN_EXTENDED = 1 << 31
CAN_REMOTE = 1 << 30
CAN_ERROR = 1 << 29
CAN_FD = 0x04
"""FD flags: this is a CAN FD frame."""

LARGEST_BLOCK = 1 << 24
"""No block of a trace comes near; a longer one is damage. Wireshark draws the same line."""

DOUBT_TEXT = "stamp late by at most {} ns"
"""How a comment or the description of an interface tells the doubt of a sighting."""

DOUBT = re.compile(r"stamp late by at most ([0-9]{1,19}) ns")

_HEAD = struct.Struct(">II")
_OPTION = struct.Struct(">HH")


def block(kind: int, body: bytes) -> bytes:
    """A block: type, length, body filled up to whole words, length again."""
    body += bytes(-len(body) % 4)
    size = len(body) + 12
    return _HEAD.pack(kind, size) + body + size.to_bytes(4, "big")


def option(code: int, value: bytes) -> bytes:
    """An option; its length does not count the padding."""
    return _OPTION.pack(code, len(value)) + value + bytes(-len(value) % 4)


def options(*pairs: tuple[int, bytes]) -> bytes:
    """Options and their end; values past 65535 bytes are cut."""
    return b"".join(option(code, value[:0xFFFF]) for code, value in pairs) + bytes(4)


def section() -> bytes:
    """Start of a file, of unknown length, version 1.0."""
    body = struct.pack(">IHHq", BYTE_ORDER_MAGIC, 1, 0, -1)
    return block(SECTION_HEADER, body + options((SHB_USERAPPL, b"nodeproof")))


def interface(link_type: int, name: str, description: str) -> bytes:
    """Description of an interface whose stamps count ns since 1970."""
    return block(
        INTERFACE_DESCRIPTION,
        struct.pack(">HHI", link_type, 0, 0)
        + options(
            (IF_NAME, name.encode("utf-8", "replace")),
            (IF_DESCRIPTION, description.encode("utf-8", "replace")),
            (IF_TSRESOL, bytes((NANOSECONDS,))),
        ),
    )


def packet(place: int, at: int, body: bytes, *pairs: tuple[int, bytes]) -> bytes:
    """An enhanced packet of interface `place`, stamped `at` ns (two's complement)."""
    size = len(body)
    head = struct.pack(">IqII", place, at, size, size)
    return block(ENHANCED_PACKET, head + body + bytes(-size % 4) + options(*pairs))
