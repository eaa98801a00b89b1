"""The kernel's frame layout, against bytes written by hand from <linux/can.h>."""

from __future__ import annotations

import sys

import pytest

from hil_tests.bus import rawcan
from node_model.frame import Frame

LAYOUTS = [
    (Frame(0x705, b"\x05"), "05070000 01000000 0500000000000000"),
    (Frame(0, b"\x01\x00"), "00000000 02000000 0100000000000000"),
    (Frame(0x705, remote=True, dlc=1), "05070040 01000000 0000000000000000"),
    (Frame(0x705, b"\x05", extended=True), "05070080 01000000 0500000000000000"),
    (Frame(0x1FFFFFFF, bytes(8), extended=True), "ffffff9f 08000000 0000000000000000"),
    (Frame(0x123, bytes(range(8)), dlc=15), "23010000 0800000f 0001020304050607"),
    (Frame(0x123, remote=True, dlc=9), "23010040 08000009 0000000000000000"),
]


@pytest.mark.skipif(sys.byteorder != "little", reason="the bytes are written little-endian")
@pytest.mark.parametrize(("frame", "layout"), LAYOUTS, ids=lambda value: str(value)[:12])
def test_layout_is_the_kernels(frame: Frame, layout: str) -> None:
    """Packing gives the kernel's bytes, and unpacking them the frame."""
    raw = bytes.fromhex(layout)

    assert rawcan.pack(frame) == raw
    assert rawcan.unpack(raw) == frame


def test_length_code_counts_only_beside_eight_bytes() -> None:
    """A len8_dlc of 8 or less, or beside a shorter frame, is no DLC (can.h)."""
    short = bytes.fromhex("23010000 0700000f 0001020304050600")
    plain = bytes.fromhex("23010000 08000008 0001020304050607")

    assert rawcan.unpack(short).dlc == 7
    assert rawcan.unpack(plain).dlc == 8
