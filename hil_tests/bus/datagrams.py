"""Many datagrams with one system call: Linux's recvmmsg, which Python's `socket` lacks.

References: recvmmsg(2), cmsg(3). A system call from Python costs more than the datagram that
it brings, so that a slow machine falls behind a full bus; a hundred in one call cost a tenth.
"""

from __future__ import annotations

import ctypes
import errno
import os
import socket
import struct

Note = tuple[int, int, bytes]
"""Level, type and content of a control message, as `socket.recvmsg` gives it."""

_NOTE = struct.Struct("@Nii")
"""struct cmsghdr: length with this head, level, type."""
_NOTE_HEAD = socket.CMSG_LEN(0)


class _Part(ctypes.Structure):
    """struct iovec."""

    _fields_ = (("base", ctypes.c_void_p), ("size", ctypes.c_size_t))


class _Message(ctypes.Structure):
    """struct msghdr."""

    _fields_ = (
        ("name", ctypes.c_void_p),
        ("name_size", ctypes.c_uint32),
        ("parts", ctypes.c_void_p),
        ("part_count", ctypes.c_size_t),
        ("notes", ctypes.c_void_p),
        ("notes_size", ctypes.c_size_t),
        ("flags", ctypes.c_int),
    )


class _Slot(ctypes.Structure):
    """struct mmsghdr."""

    _fields_ = (("message", _Message), ("size", ctypes.c_uint))


def _address(memory: bytearray) -> int:
    return ctypes.addressof(ctypes.c_char.from_buffer(memory))


class Datagrams:
    """Room for many datagrams, filled anew by each call of `receive`.

    Args:
        room: for a datagram, bytes; a multiple of 8. A longer one is cut.
        notes_room: for the control messages of a datagram, bytes; a multiple of 8.
        most: how many at once.
    """

    def __init__(self, room: int, notes_room: int, most: int = 256) -> None:
        self._receive = ctypes.CDLL(None, use_errno=True).recvmmsg
        self._most = most
        self._room, self._notes_room = room, notes_room
        self._data, self._notes = bytearray(room * most), bytearray(notes_room * most)
        self._parts = (_Part * most)()
        self._slots = bytearray(ctypes.sizeof(_Slot) * most)
        self._lay_out()
        self._fresh = bytes(self._slots)
        self.count = 0
        """How many the last call brought."""

    def _lay_out(self) -> None:
        """Each slot gets its part of the room."""
        data, notes, parts = _address(self._data), _address(self._notes), self._parts
        notes_room = self._notes_room
        slots = (_Slot * self._most).from_buffer(self._slots)
        for place, slot in enumerate(slots):
            parts[place] = _Part(data + place * self._room, self._room)
            message = slot.message
            message.parts, message.part_count = ctypes.addressof(parts[place]), 1
            message.notes, message.notes_size = notes + place * notes_room, notes_room

    def receive(self, descriptor: int) -> int:
        """Take what waits at a socket, and wait for no more.

        Returns:
            How many there were; 0 = none waited.

        Raises:
            OSError: what the kernel reports.
        """
        used = self.count * ctypes.sizeof(_Slot)
        self._slots[:used] = self._fresh[:used]
        slots = ctypes.c_void_p(_address(self._slots))
        found = self._receive(descriptor, slots, self._most, socket.MSG_DONTWAIT, None)
        self.count = max(found, 0)
        if found < 0 and (code := ctypes.get_errno()) != errno.EAGAIN:
            raise OSError(code, os.strerror(code))
        return self.count

    # One number of each datagram, in the byte order of the machine.

    @property
    def sizes(self) -> list[int]:
        """Bytes of each."""
        return self._column(self._slots, "I", _Slot.size.offset, ctypes.sizeof(_Slot)).tolist()

    @property
    def flags(self) -> list[int]:
        """MSG_ flags of each."""
        return self._column(self._slots, "i", _Message.flags.offset, ctypes.sizeof(_Slot)).tolist()

    @property
    def notes_sizes(self) -> list[int]:
        """Bytes of each one's control messages."""
        at = _Message.notes_size.offset
        return self._column(self._slots, "N", at, ctypes.sizeof(_Slot)).tolist()

    def in_data(self, kind: str, at: int) -> memoryview:
        """What stands `at` that many bytes from the start of each.

        Args:
            kind: a letter of `struct`.
            at: a multiple of the size of that.
        """
        return self._column(self._data, kind, at, self._room)

    def in_notes(self, kind: str, at: int) -> memoryview:
        """As `in_data`, of the control messages."""
        return self._column(self._notes, kind, at, self._notes_room)

    def _column(self, memory: bytearray, kind: str, at: int, step: int) -> memoryview:
        size = struct.calcsize(kind)
        every = step // size
        column: memoryview = memoryview(memory).cast(kind)  # type: ignore[call-overload]
        return column[at // size : self.count * every : every]

    # One datagram.

    def datagram(self, place: int) -> tuple[bytes, list[Note], int]:
        """Content, control messages and flags of one, as `socket.recvmsg` gives them."""
        start = place * self._room
        slot = _Slot.from_buffer(self._slots, place * ctypes.sizeof(_Slot))
        raw = bytes(self._data[start : start + slot.size])
        return raw, self._notes_of(place, slot.message.notes_size), slot.message.flags

    def _notes_of(self, place: int, size: int) -> list[Note]:
        notes = []
        at = place * self._notes_room
        end = at + size
        while at + _NOTE_HEAD <= end:
            length, level, kind = _NOTE.unpack_from(self._notes, at)
            notes.append((level, kind, bytes(self._notes[at + _NOTE_HEAD : at + length])))
            at += socket.CMSG_SPACE(length - _NOTE_HEAD)
        return notes
