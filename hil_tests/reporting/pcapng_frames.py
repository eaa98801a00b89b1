"""The packet of a CAN frame in a pcapng file: what is the same in every one is made once.

An enhanced packet block with a SocketCAN header and the direction; see `pcapng_layout`.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from typing import NamedTuple

from hil_tests.reporting import pcapng_layout as layout
from hil_tests.trace import OWN

_FIXED_BYTES = 52
"""Of the block of a frame without data."""

_MOST_KEPT = 4096
"""A stranger may send with any identifier."""

_START = struct.Struct(">III")
"""Type, length and interface."""
_END = struct.Struct(">HHIII")
"""Flags option | end of options, length of the block."""


class Recipe(NamedTuple):
    """How the block of a frame is made.

    Args:
        pack: of `start`, the instant in ns, `header`, the shifted body, and `end`.
        start: before the instant.
        header: before the data.
        shift: brings `Frame.body` to the left end of its room, in bits.
        end: after the data.
    """

    pack: Callable[[bytes, int, bytes, int, bytes], bytes]
    start: bytes
    header: bytes
    shift: int
    end: bytes


class Recipes(dict[int, Recipe]):
    """Packed head of a frame -> how its block is made.

    Args:
        place: index of the interface.
    """

    def __init__(self, place: int) -> None:
        super().__init__()
        self._place = place

    def __missing__(self, head: int) -> Recipe:
        if len(self) >= _MOST_KEPT:
            self.clear()
        recipe = self[head] = _recipe(head, self._place)
        return recipe


def header_of(head: int) -> bytes:
    """Identifier, lengths and DLC as SocketCAN has them, from the packed head of a frame."""
    word, dlc = head & 0x1FFF_FFFF, head >> 32 & 0xF
    if head >> 29 & 1:
        word |= layout.CAN_EXTENDED
    if head >> 30 & 1:
        word |= layout.CAN_REMOTE
    return struct.pack(">I4B", word, min(dlc, 8), 0, 0, dlc if dlc > 8 else 0)


def direction_of(head: int) -> int:
    """Whether the tester sent it."""
    return layout.OUTBOUND if head >= OWN else layout.INBOUND


def _recipe(head: int, place: int) -> Recipe:
    size = 0 if head >> 30 & 1 else min(head >> 32 & 0xF, 8)
    room = size + -size % 4
    length, packet = _FIXED_BYTES + room, 8 + size
    return Recipe(
        _PACKS[room],
        _START.pack(layout.ENHANCED_PACKET, length, place),
        struct.pack(">II", packet, packet) + header_of(head),
        8 * (room - size),
        _END.pack(layout.EPB_FLAGS, 4, direction_of(head), 0, length),
    )


_WITHOUT_DATA = struct.Struct(">12sq16s16s").pack


def _without_data(start: bytes, at: int, header: bytes, _: int, end: bytes) -> bytes:
    return _WITHOUT_DATA(start, at, header, end)


_PACKS: dict[int, Callable[[bytes, int, bytes, int, bytes], bytes]] = {
    0: _without_data,
    4: struct.Struct(">12sq16sI16s").pack,
    8: struct.Struct(">12sq16sQ16s").pack,
}
"""By the bytes of the data, filled up to whole words."""
