"""Data types of CiA 301 (4.2.0, 7.4.7.1): their codes, sizes and number formats."""

from __future__ import annotations

import struct
from enum import IntEnum


class DataType(IntEnum):
    """Codes of the static data types."""

    BOOLEAN = 0x01
    INTEGER8 = 0x02
    INTEGER16 = 0x03
    INTEGER32 = 0x04
    UNSIGNED8 = 0x05
    UNSIGNED16 = 0x06
    UNSIGNED32 = 0x07
    REAL32 = 0x08
    VISIBLE_STRING = 0x09
    OCTET_STRING = 0x0A
    UNICODE_STRING = 0x0B
    TIME_OF_DAY = 0x0C
    TIME_DIFFERENCE = 0x0D
    DOMAIN = 0x0F
    INTEGER24 = 0x10
    REAL64 = 0x11
    INTEGER40 = 0x12
    INTEGER48 = 0x13
    INTEGER56 = 0x14
    INTEGER64 = 0x15
    UNSIGNED24 = 0x16
    UNSIGNED40 = 0x18
    UNSIGNED48 = 0x19
    UNSIGNED56 = 0x1A
    UNSIGNED64 = 0x1B

    @property
    def size(self) -> int:
        """Bytes of a value; 0 where the length varies."""
        return _SIZES.get(self, 0)

    @property
    def is_number(self) -> bool:
        """An integer, a BOOLEAN or a REAL: it has an order, and can have limits."""
        return self in _SIZES and self not in {DataType.TIME_OF_DAY, DataType.TIME_DIFFERENCE}

    @property
    def is_signed(self) -> bool:
        """An INTEGERn."""
        return self.name.startswith("INTEGER")

    @property
    def is_real(self) -> bool:
        """A REAL32 or REAL64."""
        return self in _REALS

    def unpack(self, data: bytes) -> int | float:
        """The number in `data`, little-endian, of exactly `size` bytes."""
        if self.is_real:
            value: float = struct.unpack(_REALS[self], data)[0]
            return value
        return int.from_bytes(data, "little", signed=self.is_signed)

    def pack(self, value: float) -> bytes:
        """A number as bytes.

        Raises:
            OverflowError: it does not fit.
        """
        if self.is_real:
            return struct.pack(_REALS[self], value)
        return int(value).to_bytes(self.size, "little", signed=self.is_signed)


_REALS = {DataType.REAL32: "<f", DataType.REAL64: "<d"}
_SIZES = {
    DataType.BOOLEAN: 1,
    DataType.INTEGER8: 1,
    DataType.INTEGER16: 2,
    DataType.INTEGER32: 4,
    DataType.UNSIGNED8: 1,
    DataType.UNSIGNED16: 2,
    DataType.UNSIGNED32: 4,
    DataType.REAL32: 4,
    DataType.TIME_OF_DAY: 6,
    DataType.TIME_DIFFERENCE: 6,
    DataType.INTEGER24: 3,
    DataType.REAL64: 8,
    DataType.INTEGER40: 5,
    DataType.INTEGER48: 6,
    DataType.INTEGER56: 7,
    DataType.INTEGER64: 8,
    DataType.UNSIGNED24: 3,
    DataType.UNSIGNED40: 5,
    DataType.UNSIGNED48: 6,
    DataType.UNSIGNED56: 7,
    DataType.UNSIGNED64: 8,
}
