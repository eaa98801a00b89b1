"""Reads traces back: our own exactly, captures of others as far as they say enough.

Laws: what is whole is given before anything is said about damage; a file that breaks off
(a killed run, a full disk) ends in a GAP event that says where; damage inside a file is a
`RecordUnreadable` with file and offset. Memory is bounded by the longest block, and every
step goes forward, so a hostile file costs no more than its size.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

from hil_tests.reporting import journal
from hil_tests.reporting import pcapng_layout as layout
from hil_tests.reporting.files import RecordUnreadable
from hil_tests.trace import BusEvent, Entry, EventKind, Mark, Moment, Sighting
from node_model.frame import Frame

_PICO_DIGITS = 12
_SOCKETCAN_HEADER = 8
_ZEROS = 1 << 16
_MOST_CACHED = 1 << 16


class _Damaged(ValueError):
    """A block is not what it should be."""


class _BreaksOff(Exception):
    """The file ends within a block."""


@dataclass(frozen=True, slots=True)
class _Interface:
    """What an interface description says."""

    link_type: int
    journal: bool
    doubt_ns: int
    ticks: int
    """Stamps count 1/ticks of a second..."""
    offset_s: int
    """... from this second on."""

    def instant(self, high: int, low: int) -> int:
        """A stamp in ns; our own may be negative, in two's complement."""
        stamp = high << 32 | low
        if self.ticks == 10**9:
            stamp -= stamp >> 63 << 64
            return stamp + self.offset_s * 10**9
        return stamp * 10**9 // self.ticks + self.offset_s * 10**9


class _Section:
    """Byte order and interfaces from a section header on."""

    def __init__(self, order: str) -> None:
        self.order = order
        self.interfaces: list[_Interface] = []
        self.head = struct.Struct(order + "II")
        self._packet = struct.Struct(order + "IIIII")
        self._direction = struct.Struct(order + "HHI")
        self._frames: dict[bytes, Frame] = {}

    def unpack(self, pattern: str, body: bytes, place: int = 0) -> tuple[int, ...]:
        """Numbers at a place in a block."""
        try:
            return struct.unpack_from(self.order + pattern, body, place)
        except struct.error:
            raise _Damaged("is too short for what it holds") from None

    def options(self, body: bytes, place: int) -> Iterator[tuple[int, bytes]]:
        """Codes and values of options from a place on."""
        while place + 4 <= len(body):
            code, size = self.unpack("HH", body, place)
            if code == layout.END_OF_OPTIONS:
                return
            place += 4
            if place + size > len(body):
                raise _Damaged(f"has an option {code} that reaches past its end")
            yield code, body[place : place + size]
            place += size + -size % 4

    def describe(self, body: bytes) -> None:
        """An interface description."""
        link_type = self.unpack("HHI", body)[0]
        found = dict(self.options(body, 8))
        name = found.get(layout.IF_NAME, b"").decode("utf-8", "replace")
        ours = link_type == layout.UPPER_PDU and name.startswith("nodeproof journal/")
        if ours and name != journal.INTERFACE:
            raise _Damaged(f"is a {name[:60]!r} of a newer nodeproof; this one reads 1")
        doubt = layout.DOUBT.search(
            found.get(layout.IF_DESCRIPTION, b"").decode("ascii", "replace")
        )
        resolution = found.get(layout.IF_TSRESOL, b"\x06")[:1] or b"\x06"
        exponent = resolution[0] & 0x7F
        offset = found.get(layout.IF_TSOFFSET, bytes(8))
        self.interfaces.append(
            _Interface(
                link_type,
                ours,
                int(doubt[1]) if doubt else 0,
                2**exponent if resolution[0] & 0x80 else 10**exponent,
                self.unpack("q", offset)[0],
            )
        )

    def packet(self, body: bytes) -> Entry | Mark | None:
        """An enhanced packet; None where it is nothing of ours."""
        if len(body) < 20:
            raise _Damaged("is too short for a packet")
        place, high, low, captured, _ = self._packet.unpack_from(body)
        if place >= len(self.interfaces):
            raise _Damaged(f"names interface {place}, which was never described")
        if captured > len(body) - 20:
            raise _Damaged(f"claims {captured} bytes and holds {len(body) - 20}")
        interface = self.interfaces[place]
        packet = body[20 : 20 + captured]
        if interface.journal:
            return _note(packet)
        if interface.link_type != layout.CAN_SOCKETCAN:
            return None
        at = interface.instant(high, low)
        doubt_ns, own = self._remarks(body, 20 + captured + -captured % 4, interface.doubt_ns)
        frame = self._frames.get(packet)
        if frame is not None:
            return Sighting(frame, at, doubt_ns, own)
        found = frame_of(packet, at, doubt_ns, own)
        if isinstance(found, Sighting):
            if len(self._frames) >= _MOST_CACHED:
                self._frames.clear()
            self._frames[packet] = found.frame
        return found

    def _remarks(self, body: bytes, place: int, doubt_ns: int) -> tuple[int, bool]:
        """Doubt and direction out of the options of a packet."""
        if len(body) == place + 12:  # nearly all: the direction, then the end
            code, size, flags = self._direction.unpack_from(body, place)
            if code == layout.EPB_FLAGS and size == 4:
                return doubt_ns, flags & layout.DIRECTION_MASK == layout.OUTBOUND
        own = False
        for code, value in self.options(body, place):
            if code == layout.EPB_FLAGS:
                own = self.unpack("I", value)[0] & layout.DIRECTION_MASK == layout.OUTBOUND
            elif code == layout.COMMENT:
                said = layout.DOUBT.fullmatch(value.decode("ascii", "replace"))
                doubt_ns = int(said[1]) if said else doubt_ns
        return doubt_ns, own


def read_pcapng(path: Path) -> Iterator[Entry | Mark]:
    """Everything a recording holds, in the order of the file.

    Frames of other programs' SocketCAN captures are read too; other packets are skipped.

    Args:
        path: a pcapng file; it may still be growing.

    Raises:
        RecordUnreadable: no such file, no pcapng file, or damage inside it.
    """
    at = 0
    try:
        with path.open("rb") as file:
            for entry in _entries(file, path):
                yield entry
                at = entry.ended_at if isinstance(entry, Moment) else entry.at
    except OSError as error:
        raise RecordUnreadable(f"recording {path}: {error.strerror or error}") from error
    except _BreaksOff as broke:
        yield BusEvent(EventKind.GAP, at, str(broke))


def _entries(file: BinaryIO, path: Path) -> Iterator[Entry | Mark]:
    section: _Section | None = None
    offset = 0
    while True:
        try:
            head = file.read(12)
            if not head and section is not None:
                return
            section, entry, size = _block(file, head, section)
        except _Damaged as damage:
            raise RecordUnreadable(
                f"recording {path}, offset {offset}: the block there {damage}; what stands "
                "before it is whole"
            ) from None
        except _BreaksOff:
            raise _BreaksOff(f"the recording breaks off in the block at offset {offset}") from None
        offset += size
        if entry is not None:
            yield entry


def _block(
    file: BinaryIO, head: bytes, section: _Section | None
) -> tuple[_Section, Entry | Mark | None, int]:
    """The block that begins with `head`: section from here on, what it holds, its length."""
    new = _new_section(head)
    section = new or section
    if section is None:
        raise _Damaged("is no section header: this is no pcapng file")
    if len(head) < 12:
        raise _BreaksOff
    kind, size = section.head.unpack_from(head)
    if not size and not any(head) and _only_zeros(file):
        raise _BreaksOff
    if size < 12 or size % 4 or size > layout.LARGEST_BLOCK:
        raise _Damaged(f"cannot be {size} bytes long")
    rest = head[8:] + file.read(size - 12)
    if len(rest) < size - 8:
        raise _BreaksOff
    if rest[-4:] != head[4:8]:
        raise _Damaged(f"is {size} bytes long at its start and not at its end")
    body = rest[:-4]
    if kind == layout.ENHANCED_PACKET:
        return section, section.packet(body), size
    if kind == layout.INTERFACE_DESCRIPTION:
        section.describe(body)
    elif kind == layout.SIMPLE_PACKET:
        raise _Damaged("is a packet without a stamp, of which nothing can be judged")
    return section, None, size


def _new_section(head: bytes) -> _Section | None:
    """A section, where a block begins one: its third word tells the byte order."""
    if head[:4] != layout.SECTION_HEADER.to_bytes(4, "big") or len(head) < 12:
        return None
    for order, name in ((">", "big"), ("<", "little")):
        if head[8:12] == layout.BYTE_ORDER_MAGIC.to_bytes(4, "big" if name == "big" else "little"):
            return _Section(order)
    raise _Damaged("begins a section of unknown byte order")


def _only_zeros(file: BinaryIO) -> bool:
    """The rest of the file holds nothing, as after a power cut on some file systems."""
    while piece := file.read(_ZEROS):
        if any(piece):
            return False
    return True


def _note(packet: bytes) -> Entry | Mark:
    try:
        return journal.unpack(packet)
    except ValueError as error:
        raise _Damaged(f"holds no note of ours: {error}") from None


def frame_of(packet: bytes, at: int, doubt_ns: int, own: bool) -> Entry:
    """A SocketCAN frame, classical or not, or an error frame."""
    if len(packet) < _SOCKETCAN_HEADER:
        raise _Damaged(f"holds {len(packet)} bytes, too few for a CAN frame")
    word = int.from_bytes(packet[:4], "big")
    size, flags, _, long_dlc = packet[4:8]
    can_id = word & 0x1FFF_FFFF
    if word & layout.CAN_ERROR:
        text = f"class {can_id:#x}, data {packet[8:16].hex()}"
        return BusEvent(EventKind.ERROR, at, text)
    if flags & layout.CAN_FD or size > 8:
        return BusEvent(EventKind.FD_FRAME, at, f"identifier {can_id:03X}h, {size} bytes")
    remote, extended = bool(word & layout.CAN_REMOTE), bool(word & layout.CAN_EXTENDED)
    data = b"" if remote else packet[8 : 8 + size]
    dlc = long_dlc if size == 8 and 8 < long_dlc < 16 else size
    try:
        return Sighting(Frame(can_id, data, remote, extended, dlc), at, doubt_ns, own)
    except ValueError as error:
        raise _Damaged(f"holds no CAN frame: {error}") from None
