"""Values as SDO carries them: little-endian (CiA 301 4.2.0, 7.1.4)."""

from __future__ import annotations


def u8(value: int) -> bytes:
    """UNSIGNED8."""
    return value.to_bytes(1, "little")


def u16(value: int) -> bytes:
    """UNSIGNED16."""
    return value.to_bytes(2, "little")


def u32(value: int) -> bytes:
    """UNSIGNED32."""
    return value.to_bytes(4, "little")


def number(data: bytes) -> int:
    """An unsigned integer of any size."""
    return int.from_bytes(data, "little")
