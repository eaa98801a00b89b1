"""Frames of a SocketCAN socket by the hundred: read with one call, unpacked column by column."""

from __future__ import annotations

import socket
import struct
import sys
from array import array
from collections.abc import Sequence
from operator import rshift
from typing import NamedTuple

from hil_tests.bus import rawcan
from hil_tests.bus.datagrams import Datagrams, Note
from hil_tests.clock import S
from hil_tests.trace import OWN

_MOST_CACHED = 4096
_LONG = struct.calcsize("l")
_KIND_AT = struct.calcsize("Ni")
"""Where the type of a control message stands."""
_STAMP_ROOM = {
    rawcan.SO_TIMESTAMPNS: socket.CMSG_SPACE(rawcan.TIMESPEC.size),
    rawcan.SO_TIMESTAMPING: socket.CMSG_SPACE(rawcan.TIMESPECS.size),
}
"""Bytes of the note with the stamp, by its type."""


class Packed(NamedTuple):
    """Frames, column by column.

    Args:
        heads: as a trace has them.
        bodies: as a trace has them.
        soft: the kernel's stamps, ns.
        hard: the adapter's stamps, ns, 0 = it made none; empty on a simulated wire.
        drops: how many frames the kernel had dropped when each came; empty = none yet.
    """

    heads: array[int]
    bodies: array[int]
    soft: list[int]
    hard: list[int]
    drops: list[int]


class ManyFrames:
    """What waits at a raw CAN socket."""

    def __init__(self) -> None:
        self._many = Datagrams(rawcan.CANFD_MTU, rawcan.ROOM)
        self._heads: dict[int, int] = {}
        self._shifts: dict[int, int] = {}

    def receive(self, descriptor: int) -> int:
        """See `Datagrams.receive`."""
        return self._many.receive(descriptor)

    def datagrams(self) -> list[tuple[bytes, list[Note], int]]:
        """Those that came last, one by one, as `socket.recvmsg` gives them."""
        return [self._many.datagram(place) for place in range(self._many.count)]

    def packed(self) -> Packed | None:
        """Those that came last; None where one of them needs a closer look.

        That is an error frame, a CAN FD frame, or one whose stamp is another kind than that
        of the first one.
        """
        many = self._many
        notes = many.notes_sizes
        flags = many.flags
        same = notes.count(notes[0]) == len(notes) and set(many.sizes) == {rawcan.CAN_MTU}
        if not same or any(each & rawcan.MSG_CUT for each in flags):
            return None
        words: list[int] = many.in_data("Q", 0).tolist()
        heads = self._heads_of(words)
        stamps = self._stamps(notes[0])
        if heads is None or stamps is None:
            return None
        for place, each in enumerate(flags):
            if each & rawcan.MSG_CONFIRM:
                heads[place] |= OWN
        return Packed(heads, self._bodies(words), *stamps)

    def _heads_of(self, words: Sequence[int]) -> array[int] | None:
        """Packed heads by the first halves of struct can_frame; None where one is no frame's."""
        known = self._heads
        if not known.keys() >= set(words) and not self._learn(words):
            return None
        return array("q", map(known.__getitem__, words))

    def _learn(self, words: Sequence[int]) -> bool:
        """Remember the heads that were not seen yet; False where one is an error frame's."""
        if len(self._heads) > _MOST_CACHED:
            self._heads.clear()
            self._shifts.clear()
        for place, word in enumerate(words):
            if word in self._heads:
                continue
            raw = self._many.datagram(place)[0]
            if int.from_bytes(raw[:4], sys.byteorder) & rawcan.ERR_FLAG:
                return False
            frame = rawcan.unpack(raw)
            self._heads[word] = frame.head
            self._shifts[word] = 64 - 8 * len(frame.data)
        return True

    def _bodies(self, words: Sequence[int]) -> array[int]:
        """The data of each as a number; what stands behind them is nobody's."""
        bodies = array("Q", self._many.in_data("Q", 8).tobytes())
        if sys.byteorder == "little":
            bodies.byteswap()
        shifts = list(map(self._shifts.__getitem__, words))
        return array("Q", map(rshift, bodies, shifts)) if any(shifts) else bodies

    def _stamps(self, size: int) -> tuple[list[int], list[int], list[int]] | None:
        """Stamps of kernel and adapter, and drops; None where one has notes of another kind."""
        kinds = set(self._many.in_notes("i", _KIND_AT).tolist())
        kind = kinds.pop()
        room = _STAMP_ROOM.get(kind, size + 1)
        if kinds or size < room:
            return None
        drops = self._drops(room) if size > room else []
        if drops is None:
            return None
        hard = self._instants(2) if kind == rawcan.SO_TIMESTAMPING else []
        return self._instants(0), hard, drops

    def _drops(self, at: int) -> list[int] | None:
        """Counts of drops, where every second note, at that place, is such a one."""
        kinds = set(self._many.in_notes("i", at + _KIND_AT).tolist())
        if kinds != {rawcan.SO_RXQ_OVFL}:
            return None
        counts: list[int] = self._many.in_notes("I", at + socket.CMSG_LEN(0)).tolist()
        return counts

    def _instants(self, which: int) -> list[int]:
        """Of the struct timespec with that number in the first note, ns."""
        at = socket.CMSG_LEN(0) + which * rawcan.TIMESPEC.size
        seconds = self._many.in_notes("l", at).tolist()
        parts = self._many.in_notes("l", at + _LONG).tolist()
        return [second * S + ns for second, ns in zip(seconds, parts, strict=True)]
