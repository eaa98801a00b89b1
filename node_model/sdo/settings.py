"""What CiA 301 leaves to the maker of an SDO server."""

from __future__ import annotations

from dataclasses import dataclass

MOST_SEGMENTS = 127
"""Segments of a block (CiA 301 4.2.0, 7.2.4.3.9)."""


@dataclass(frozen=True, slots=True)
class SdoSettings:
    """Choices of an SDO server.

    Args:
        time_out_ns: silence of the client after which a transfer is aborted; 0 = never.
        block_time_out_ns: silence inside a block of a download after which the server
            confirms what it has, so that a lost last segment is sent again; 0 = never.
        segment_gap_ns: distance of the segments in an uploaded block. 0 = all at once: a
            block of 127 then keeps the wire busy and delays what the device sends with a
            higher identifier, the heartbeat first of all.
        block_size: segments of a block that the server asks for, 1..127.
        has_blocks: it can do block transfers.
        has_crc: it can do the CRC of block transfers.
        tells_size: it tells the size of what it uploads in segments or blocks.
        takes_switch: it answers a block upload of few bytes as the protocol switch
            threshold of the client allows.
        memory: bytes that a download into an entry without limit may have.

    Raises:
        ValueError: a block size out of range.
    """

    time_out_ns: int = 0
    block_time_out_ns: int = 0
    segment_gap_ns: int = 0
    block_size: int = MOST_SEGMENTS
    has_blocks: bool = True
    has_crc: bool = True
    tells_size: bool = True
    takes_switch: bool = True
    memory: int = 16 << 20

    def __post_init__(self) -> None:
        if not 1 <= self.block_size <= MOST_SEGMENTS:
            raise ValueError(f"block_size is {self.block_size}; a block has 1..127 segments")
