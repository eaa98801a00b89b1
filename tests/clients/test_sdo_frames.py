"""SDO requests byte by byte, as CiA 301 (7.2.4.3) draws them."""

from __future__ import annotations

import pytest

from hil_tests.clients import sdo_frames
from hil_tests.clients.values import number, u8, u16, u32

REQUESTS = {
    "4017100000000000": sdo_frames.read(0x1017, 0),
    "6000000000000000": sdo_frames.read_segment(0),
    "7000000000000000": sdo_frames.read_segment(1),
    "2F17100100000000": sdo_frames.write(0x1017, 1, b"\x00"),
    "2B171000F4010000": sdo_frames.write(0x1017, 0, u16(500)),
    "2717100001020300": sdo_frames.write(0x1017, 0, b"\x01\x02\x03"),
    "2310100173617665": sdo_frames.write(0x1010, 1, b"save"),
    "2217100001000000": sdo_frames.write_unsized(0x1017, 0, b"\x01"),
    "2108100005000000": sdo_frames.write_many(0x1008, 0, 5),
    "2008100000000000": sdo_frames.write_many(0x1008, 0, None),
    "0001020304050607": sdo_frames.write_segment(0, b"\1\2\3\4\5\6\7", last=False),
    "1D01000000000000": sdo_frames.write_segment(1, b"\1", last=True),
    "8008100000000405": sdo_frames.abort(0x1008, 0, 0x0504_0000),
    "C620200100010000": sdo_frames.block_write(0x2020, 1, 256),
    "C220200100010000": sdo_frames.block_write(0x2020, 1, 256, crc=False),
    "C420200100000000": sdo_frames.block_write(0x2020, 1, None),
    "0101020304050607": sdo_frames.block_segment(1, b"\1\2\3\4\5\6\7", last=False),
    "FF01000000000000": sdo_frames.block_segment(127, b"\1", last=True),
    "D934120000000000": sdo_frames.block_write_end(6, 0x1234),
    "A42020017F000000": sdo_frames.block_read(0x2020, 1),
    "A020200101150000": sdo_frames.block_read(0x2020, 1, 1, 21, crc=False),
    "A300000000000000": sdo_frames.block_read_start(),
    "A2057F0000000000": sdo_frames.block_read_acknowledge(5),
    "A100000000000000": sdo_frames.block_read_end(),
}


@pytest.mark.parametrize(("wanted", "made"), REQUESTS.items(), ids=list(REQUESTS))
def test_a_request_has_these_bytes(wanted: str, made: bytes) -> None:
    """Each builder makes the bytes that the clause draws."""
    assert made.hex().upper() == wanted


def test_the_crc_has_its_check_value() -> None:
    """CRC of the digits 1 to 9 is 31C3h (CiA 301, 7.2.4.3.16); it can be made in parts."""
    assert sdo_frames.crc16(b"123456789") == 0x31C3
    assert sdo_frames.crc16(b"6789", sdo_frames.crc16(b"12345")) == 0x31C3


def test_values_are_little_endian() -> None:
    """Numbers travel with their low byte first."""
    assert (u8(5), u16(0x0102), u32(0x01020304)) == (b"\5", b"\2\1", b"\4\3\2\1")
    assert number(b"\4\3\2\1") == 0x01020304
