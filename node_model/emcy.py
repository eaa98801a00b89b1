"""Emergency object (CiA 301 4.2.0, 7.2.7): its frame."""

from __future__ import annotations

from node_model.frame import Frame, data_frame

EMCY_BASE = 0x080
HARDWARE_ERROR = 0x5000
GENERIC_ERROR = 0x01
"""Bit 0 of the error register 1001h: set whenever there is any error."""


def emcy_frame(node_id: int, code: int, register: int, manufacturer: bytes = bytes(5)) -> Frame:
    """EMCY of a node: error code little-endian, error register, five bytes of the maker."""
    return data_frame(
        EMCY_BASE + node_id, code.to_bytes(2, "little") + bytes((register,)) + manufacturer
    )
