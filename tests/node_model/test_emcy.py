"""The emergency object's layout."""

from __future__ import annotations

from node_model.emcy import GENERIC_ERROR, HARDWARE_ERROR, emcy_frame
from node_model.frame import Frame


def test_error_code_is_little_endian_then_register_then_maker() -> None:
    """Eight bytes at 080h + node id (CiA 301, 7.2.7.3): code low, code high, register, five."""
    frame = emcy_frame(0x0F, 0x5012, 0x81, b"\1\2\3\4\5")
    assert frame == Frame(0x08F, b"\x12\x50\x81\x01\x02\x03\x04\x05")


def test_hardware_error_leaves_the_maker_bytes_zero() -> None:
    """Code 5000h (hardware) with the generic bit of the register."""
    frame = emcy_frame(1, HARDWARE_ERROR, GENERIC_ERROR)
    assert frame == Frame(0x081, b"\x00\x50\x01\x00\x00\x00\x00\x00")
