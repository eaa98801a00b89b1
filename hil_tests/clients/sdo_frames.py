"""SDO requests as bytes, right or wrong (CiA 301 4.2.0, 7.2.4.3).

Each builder makes the eight bytes of one request. Nothing is checked: a wrong toggle bit,
sequence number, size or CRC is made by passing one.
"""

from __future__ import annotations

from binascii import crc_hqx

SEGMENT_BYTES = 7
LONGEST_BLOCK = 127


def crc16(data: bytes, crc: int = 0) -> int:
    """CRC of a block transfer: polynomial 1021h, start value 0 (7.2.4.3.16).

    "123456789" gives 31C3h.
    """
    return crc_hqx(data, crc)


def multiplexer(index: int, sub: int) -> bytes:
    """Index and sub-index as a request carries them."""
    return bytes((index & 0xFF, index >> 8, sub))


def _named(command: int, index: int, sub: int, rest: bytes = b"") -> bytes:
    return (bytes((command,)) + multiplexer(index, sub) + rest).ljust(8, b"\x00")


def read(index: int, sub: int) -> bytes:
    """Initiate upload."""
    return _named(0x40, index, sub)


def read_segment(toggle: int) -> bytes:
    """Upload segment."""
    return bytes((0x60 | toggle << 4,)) + bytes(7)


def write(index: int, sub: int, data: bytes) -> bytes:
    """Initiate download, expedited, of one to four bytes with their number."""
    return _named(0x23 | (4 - len(data)) << 2, index, sub, data)


def write_unsized(index: int, sub: int, data: bytes) -> bytes:
    """Initiate download, expedited, that does not tell how many of the four bytes count."""
    return _named(0x22, index, sub, data)


def write_many(index: int, sub: int, size: int | None) -> bytes:
    """Initiate download in segments, with or without its size in bytes."""
    told = b"" if size is None else size.to_bytes(4, "little")
    return _named(0x20 | (size is not None), index, sub, told)


def write_segment(toggle: int, data: bytes, *, last: bool) -> bytes:
    """Download segment of up to seven bytes."""
    command = toggle << 4 | (SEGMENT_BYTES - len(data)) << 1 | last
    return bytes((command,)) + data.ljust(7, b"\x00")


def abort(index: int, sub: int, code: int) -> bytes:
    """The client ends the transfer."""
    return _named(0x80, index, sub, code.to_bytes(4, "little"))


def block_write(index: int, sub: int, size: int | None, *, crc: bool = True) -> bytes:
    """Initiate block download."""
    told = b"" if size is None else size.to_bytes(4, "little")
    return _named(0xC0 | crc << 2 | (size is not None) << 1, index, sub, told)


def block_segment(number: int, data: bytes, *, last: bool) -> bytes:
    """A segment of a block, in either direction; `number` counts from 1."""
    return bytes((last << 7 | number,)) + data.ljust(7, b"\x00")


def block_write_end(unused: int, crc: int) -> bytes:
    """End of a block download; `unused` = bytes without data in its last segment."""
    return bytes((0xC1 | unused << 2,)) + crc.to_bytes(2, "little") + bytes(5)


def block_read(
    index: int, sub: int, block: int = LONGEST_BLOCK, threshold: int = 0, *, crc: bool = True
) -> bytes:
    """Initiate block upload: segments a block, and below which size to switch protocols."""
    return _named(0xA0 | crc << 2, index, sub, bytes((block, threshold)))


def block_read_start() -> bytes:
    """The server may send the first block."""
    return b"\xa3" + bytes(7)


def block_read_acknowledge(number: int, block: int = LONGEST_BLOCK) -> bytes:
    """The last segment that came in its order, and the length of the next block."""
    return bytes((0xA2, number, block)) + bytes(5)


def block_read_end() -> bytes:
    """The upload is over."""
    return b"\xa1" + bytes(7)
