"""Data types of CiA 301 (4.2.0, 7.4.7.1): their codes, sizes and number formats."""

from __future__ import annotations

import struct
from enum import IntEnum
from typing import Self


class DataType(IntEnum):
    """Codes of the static data types; each member knows its size and kind.

    Plain attributes instead of properties with tables: hashing a member of an enumeration
    costs more than the rest of an SDO access.
    """

    size: int
    """Bytes of a value; 0 where the length varies."""
    is_number: bool
    """An integer, a BOOLEAN or a REAL: it has an order, and can have limits."""
    is_signed: bool
    """An INTEGERn."""
    is_real: bool
    """A REAL32 or REAL64."""

    def __new__(cls, code: int, size: int = 0, kind: str = "") -> Self:  # noqa: D102
        member = int.__new__(cls, code)
        member._value_ = code
        member.size = size
        member.is_number = kind != ""
        member.is_signed = kind == "signed"
        member.is_real = kind == "real"
        return member

    BOOLEAN = 0x01, 1, "unsigned"
    INTEGER8 = 0x02, 1, "signed"
    INTEGER16 = 0x03, 2, "signed"
    INTEGER32 = 0x04, 4, "signed"
    UNSIGNED8 = 0x05, 1, "unsigned"
    UNSIGNED16 = 0x06, 2, "unsigned"
    UNSIGNED32 = 0x07, 4, "unsigned"
    REAL32 = 0x08, 4, "real"
    VISIBLE_STRING = 0x09
    OCTET_STRING = 0x0A
    UNICODE_STRING = 0x0B
    TIME_OF_DAY = 0x0C, 6
    TIME_DIFFERENCE = 0x0D, 6
    DOMAIN = 0x0F
    INTEGER24 = 0x10, 3, "signed"
    REAL64 = 0x11, 8, "real"
    INTEGER40 = 0x12, 5, "signed"
    INTEGER48 = 0x13, 6, "signed"
    INTEGER56 = 0x14, 7, "signed"
    INTEGER64 = 0x15, 8, "signed"
    UNSIGNED24 = 0x16, 3, "unsigned"
    UNSIGNED40 = 0x18, 5, "unsigned"
    UNSIGNED48 = 0x19, 6, "unsigned"
    UNSIGNED56 = 0x1A, 7, "unsigned"
    UNSIGNED64 = 0x1B, 8, "unsigned"

    def unpack(self, data: bytes) -> int | float:
        """The number in `data`, little-endian, of exactly `size` bytes."""
        if self.is_real:
            value: float = struct.unpack("<f" if self.size == 4 else "<d", data)[0]
            return value
        return int.from_bytes(data, "little", signed=self.is_signed)

    def pack(self, value: float) -> bytes:
        """A number as bytes.

        Raises:
            OverflowError: it does not fit.
        """
        if self.is_real:
            return struct.pack("<f" if self.size == 4 else "<d", value)
        return int(value).to_bytes(self.size, "little", signed=self.is_signed)
