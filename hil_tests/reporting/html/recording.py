"""A recording in columns: what a report draws, read at a fraction of the reader's cost.

Frames repeat. Each kind of frame (identifier, data, direction, doubt) is unpacked once; a
frame is then an instant and the number of its kind. Files of our own writer are walked
block by block; whatever looks different is left to `read_pcapng`, which knows more.
"""

from __future__ import annotations

import struct
from array import array
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

from hil_tests.reporting import journal
from hil_tests.reporting import pcapng_layout as layout
from hil_tests.reporting.files import RecordUnreadable
from hil_tests.reporting.pcapng_reader import frame_of, read_pcapng
from hil_tests.trace import BusEvent, Mark, Moment, Sighting
from node_model.frame import Frame

_BLOCK = struct.Struct(">IIIqI")
"""Of an enhanced packet: type, length, interface, stamp, captured length."""
_PACKET_AT = 28
_SECTION = layout.section()
_PREFIX = journal.pack(Mark(0, "")).partition(b"{")[0]
_MARK = b'{"kind":"mark"'
_DIRECTION_AT = 8
"""Where the direction stands from the end of a block: before end of options and length."""


class Kind(NamedTuple):
    """A kind of frame: all that two sightings can have in common."""

    frame: Frame
    doubt_ns: int
    own: bool


class _Foreign(Exception):
    """Not written by us, or broken off: the other reader is asked."""


class Kinds:
    """Every kind of frame that some recordings hold, numbered.

    Args:
        decode: puts a frame into words.
    """

    def __init__(self, decode: Callable[[Frame], str]) -> None:
        self.all: list[Kind] = []
        self._decode = decode
        self._words: dict[int, str] = {}
        self._known: dict[Kind, int] = {}
        self.by_block: dict[int, dict[bytes, int]] = {}
        """Doubt -> the bytes behind the stamp -> number."""
        self.texts: list[str] = []
        """How the frame of each is written."""
        self.own: set[int] = set()
        """Those that the tester sends."""

    def number(self, kind: Kind) -> int:
        """Its number; a new one if it was never seen."""
        found = self._known.get(kind)
        if found is None:
            found = self._known[kind] = len(self.all)
            self.all.append(kind)
            self.texts.append(str(kind.frame))
            if kind.own:
                self.own.add(found)
        return found

    def words(self, number: int) -> str:
        """What a frame of that kind means; worked out once, and only when somebody asks."""
        found = self._words.get(number)
        if found is None:
            found = self._words[number] = self._decode(self.all[number].frame)
        return found


Note = Moment | BusEvent


@dataclass(slots=True)
class Recording:
    """One recording.

    Args:
        path: the file.
        kinds: what its numbers mean; shared with other recordings.
        at: instant of each frame, ns.
        kind: number of the kind of each frame.
        notes: number of frames that stand before it, and what else was noted; what the judge
            said stands in `results.json`.
        damage: why the rest could not be read, "" = all was.
    """

    path: Path
    kinds: Kinds
    at: array[int] = field(default_factory=lambda: array("q"))
    kind: array[int] = field(default_factory=lambda: array("I"))
    notes: list[tuple[int, Note]] = field(default_factory=list)
    damage: str = ""

    def __len__(self) -> int:
        return len(self.at)

    def sighting(self, index: int) -> Sighting:
        """The frame with that index."""
        frame, doubt_ns, own = self.kinds.all[self.kind[index]]
        return Sighting(frame, self.at[index], doubt_ns, own)

    def moments(self) -> list[Moment]:
        """What was done to the device."""
        return [note for _, note in self.notes if isinstance(note, Moment)]

    def events(self) -> list[BusEvent]:
        """What else the bus showed."""
        return [note for _, note in self.notes if isinstance(note, BusEvent)]


def read_recording(path: Path, kinds: Kinds) -> Recording:
    """Everything that can be read of a recording; `damage` says what could not."""
    recording = Recording(path, kinds)
    try:
        _walk(path.read_bytes(), recording)
    except OSError as error:
        recording.damage = f"{path.name}: {error.strerror or error}"
    except (_Foreign, struct.error, ValueError, IndexError):
        recording = Recording(path, kinds)
        _read_slowly(recording)
    return recording


def _read_slowly(recording: Recording) -> None:
    kinds = recording.kinds
    try:
        for entry in read_pcapng(recording.path):
            if isinstance(entry, Sighting):
                recording.at.append(entry.at)
                kind = Kind(entry.frame, entry.doubt_ns, entry.own)
                recording.kind.append(kinds.number(kind))
            elif not isinstance(entry, Mark):
                recording.notes.append((len(recording.at), entry))
    except RecordUnreadable as error:
        recording.damage = str(error).replace(str(recording.path), recording.path.name)


def _walk(data: bytes, recording: Recording) -> None:
    """Take in a file of our writer, whole to its last block.

    Raises:
        _Foreign, struct.error, ValueError, IndexError: it is something else.
    """
    if not data.startswith(_SECTION):
        raise _Foreign
    place, end = len(_SECTION), len(data)
    tables: list[dict[bytes, int] | None] = []
    doubts: list[int] = []
    unpack, add_at, add_kind = _BLOCK.unpack_from, recording.at.append, recording.kind.append
    while place < end:
        block, size, interface, at, captured = unpack(data, place)
        table = tables[interface] if block == layout.ENHANCED_PACKET else None
        key = data[place + _PACKET_AT - 8 : place + size]
        number = None if table is None else table.get(key)
        # A key ends with the size of its block, so a known one needs no other check.
        if number is None and (size < _PACKET_AT or size % 4 or place + size > end):
            raise _Foreign
        if table is not None:
            if number is None:
                number = table[key] = _new_kind(key, captured, doubts[interface], recording.kinds)
            add_at(at)
            add_kind(number)
        elif block == layout.ENHANCED_PACKET:
            packet = data[place + _PACKET_AT : place + _PACKET_AT + captured]
            if not packet.startswith(_MARK, len(_PREFIX)):
                note = journal.unpack(packet)
                assert not isinstance(note, Mark)
                recording.notes.append((len(recording.at), note))
        elif block == layout.INTERFACE_DESCRIPTION:
            doubt_ns = _described(data[place + 8 : place + size - 4])
            doubts.append(doubt_ns or 0)
            tables.append(
                None if doubt_ns is None else recording.kinds.by_block.setdefault(doubt_ns, {})
            )
        else:
            raise _Foreign
        place += size


def _described(body: bytes) -> int | None:
    """The doubt of an interface for frames; None = the journal."""
    link_type = int.from_bytes(body[:2], "big")
    if link_type == layout.UPPER_PDU and journal.INTERFACE.encode() in body:
        return None
    if link_type != layout.CAN_SOCKETCAN:
        raise _Foreign
    doubt = layout.DOUBT.search(body.decode("ascii", "replace"))
    return int(doubt[1]) if doubt else 0


def _new_kind(key: bytes, captured: int, doubt_ns: int, kinds: Kinds) -> int:
    """The number of a frame whose block, from behind the stamp on, was never met before."""
    options = key[8 + captured + -captured % 4 : -4]
    if len(options) != 12 or int.from_bytes(key[-4:], "big") != len(key) + 20:
        raise _Foreign  # a comment tells a doubt of its own, or the block is damaged
    own = int.from_bytes(options[4:8], "big") & layout.DIRECTION_MASK == layout.OUTBOUND
    found = frame_of(key[8 : 8 + captured], 0, doubt_ns, own)
    if not isinstance(found, Sighting):
        raise _Foreign
    return kinds.number(Kind(found.frame, doubt_ns, own))
