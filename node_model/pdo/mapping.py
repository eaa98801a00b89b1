"""PDO mapping: which objects, bit by bit, a PDO carries (CiA 301 4.2.0, 7.5.2.36 and .38).

Laws: the first entry has the lowest bits. An object is mapped whole. Dummy entries, the
indices 0001h..0007h of the static data types, fill up an RPDO and carry nothing.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from node_model.od import AbortCode, Access, DataType, Entry, ObjectDictionary, SdoAbort

MAX_BITS = 64
DUMMIES = frozenset(range(0x0001, 0x0008))


class Direction(Enum):
    """Which way a PDO goes, with the access types of objects that may be mapped so (CiA 306)."""

    RECEIVE = frozenset({Access.WO, Access.RW, Access.RWW})
    TRANSMIT = frozenset({Access.RO, Access.CONST, Access.RW, Access.RWR})


@dataclass(frozen=True, slots=True)
class Field:
    """One entry of a mapping.

    Args:
        bits: length.
        entry: the object; None = a dummy.
    """

    bits: int
    entry: Entry | None


class Mapping:
    """The layout of a PDO.

    Args:
        fields: its entries, the first in the lowest bits.
    """

    __slots__ = ("_whole", "fields", "keys", "size")

    def __init__(self, fields: tuple[Field, ...] = ()) -> None:
        self.fields = fields
        self.size = (sum(field.bits for field in fields) + 7) // 8
        """Bytes of the PDO."""
        entries = [field.entry for field in fields if field.entry]
        self.keys = frozenset((entry.index, entry.sub) for entry in entries)
        """Index and sub-index of all objects that it carries."""
        bits = [8 * entry.data_type.size for entry in entries]
        self._whole = entries if bits == [field.bits for field in fields] else None

    def pack(self) -> bytes:
        """The values of the objects now, as they travel."""
        if self._whole is not None:
            # Nearly every PDO: whole bytes, and nothing but objects.
            return b"".join([entry.value for entry in self._whole])
        number, place = 0, 0
        for field in self.fields:
            if field.entry is not None:
                value = int.from_bytes(field.entry.value, "little") & (1 << field.bits) - 1
                number |= value << place
            place += field.bits
        return number.to_bytes(self.size, "little")

    def unpack(self, data: bytes) -> list[tuple[Entry, bytes]]:
        """The objects and their new values from at least `size` bytes."""
        number, place = int.from_bytes(data, "little"), 0
        found = []
        for field in self.fields:
            if field.entry is not None:
                value = number >> place & (1 << field.bits) - 1
                size = field.entry.data_type.size
                found.append((field.entry, value.to_bytes(size, "little")))
            place += field.bits
        return found


def field_of(od: ObjectDictionary, value: int, direction: Direction) -> Field:
    """What an entry of a mapping object means: index, sub-index and length in bits.

    Raises:
        SdoAbort: 0602 0000h or 0609 0011h, no such object; 0604 0041h, it cannot be mapped
            that way or has another length.
    """
    index, sub, bits = value >> 16, value >> 8 & 0xFF, value & 0xFF
    if index in DUMMIES:
        return Field(_dummy_bits(index, sub, bits, direction), None)
    entry = od.find(index, sub)
    if not entry.pdo or entry.access not in direction.value:
        raise SdoAbort(AbortCode.NOT_MAPPABLE)
    if bits not in lengths_of(entry.data_type):
        raise SdoAbort(AbortCode.NOT_MAPPABLE)
    return Field(bits, entry)


def lengths_of(data_type: DataType) -> tuple[int, ...]:
    """Lengths in bits with which an object of this type is mapped whole; none if it varies."""
    if data_type is DataType.BOOLEAN:
        return (1, 8)
    return (8 * data_type.size,) if data_type.size else ()


def _dummy_bits(index: int, sub: int, bits: int, direction: Direction) -> int:
    fits = sub == 0 and bits in lengths_of(DataType(index))
    if not fits or direction is Direction.TRANSMIT:
        raise SdoAbort(AbortCode.NOT_MAPPABLE)
    return bits


def mapping_of(od: ObjectDictionary, index: int, count: int, direction: Direction) -> Mapping:
    """The mapping that the first `count` entries of the object `index` describe.

    Raises:
        SdoAbort: an entry is wrong, see `field_of`; 0604 0042h, there are not so many, or
            all together are longer than 64 bits.
    """
    if count and not od.has(index, count):
        raise SdoAbort(AbortCode.PDO_LENGTH)
    values = (od.number(index, sub) for sub in range(1, count + 1))
    fields = tuple(field_of(od, value, direction) for value in values)
    if sum(field.bits for field in fields) > MAX_BITS:
        raise SdoAbort(AbortCode.PDO_LENGTH)
    return Mapping(fields)
