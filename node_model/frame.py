"""A classical CAN data or remote frame as a value, with its exact length on the wire.

The one type that both sides of the project share: devices send it, testers judge it.
Laws: a frame never changes; equal fields make equal frames; its length in bits counts
every stuff bit (ISO 11898-1:2015, 10.4-10.6), so that bus time can be computed exactly.
"""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from functools import lru_cache

MAX_BASE_ID = 0x7FF
MAX_EXTENDED_ID = 0x1FFF_FFFF
MAX_DATA_BYTES = 8
MAX_DLC = 15
INTERMISSION_BITS = 3
"""Recessive bits between two frames (ISO 11898-1, interframe space)."""

_CRC15_POLYNOMIAL = 0x4599
_TAIL_BITS = 10
"""CRC delimiter, acknowledge slot and delimiter, seven bits end of frame: never stuffed."""


def _crc15_table() -> tuple[int, ...]:
    table = []
    for byte in range(256):
        crc = byte << 7
        for _ in range(8):
            crc <<= 1
            if crc & 0x8000:
                crc ^= 0x8000 | _CRC15_POLYNOMIAL
        table.append(crc & 0x7FFF)
    return tuple(table)


_CRC15 = _crc15_table()


def crc15(bits: int, count: int) -> int:
    """CRC-15/CAN of the lowest `count` bits of `bits`, most significant bit first.

    Args:
        bits: the bit string as an integer.
        count: how many bits it has; leading zeros leave this CRC at 0, so any count works.

    Returns:
        The 15-bit check sequence of ISO 11898-1, 10.4.2.6.
    """
    crc = 0
    table = _CRC15
    for byte in bits.to_bytes((count + 7) // 8, "big"):
        crc = ((crc << 8) ^ table[((crc >> 7) ^ byte) & 0xFF]) & 0x7FFF
    return crc


def _stuff_step(level: int, run: int, bit: int) -> tuple[int, int, int]:
    """One bit through the stuffing rule: new level, new run length, stuff bits added."""
    run = run + 1 if bit == level else 1
    if run < 5:
        return bit, run, 0
    return 1 - bit, 1, 1


def _stuff_table() -> tuple[tuple[int, ...], ...]:
    """Per state (level * 5 + run) and byte: next state * 8 + stuff bits added."""
    states = []
    for state in range(10):
        row = []
        for byte in range(256):
            level, run, added = state // 5, state % 5, 0
            for shift in range(7, -1, -1):
                level, run, more = _stuff_step(level, run, byte >> shift & 1)
                added += more
            row.append((level * 5 + run) * 8 + added)
        states.append(tuple(row))
    return tuple(states)


_STUFF = _stuff_table()


def stuff_bits(bits: int, count: int) -> int:
    """How many stuff bits a transmitter inserts into `count` bits of `bits`.

    A bit of opposite level follows every five equal ones and counts for the next five
    (ISO 11898-1, 10.5).
    """
    level, run, added = 1, 0, 0
    head = count % 8
    for shift in range(head - 1, -1, -1):
        level, run, more = _stuff_step(level, run, bits >> (count - head + shift) & 1)
        added += more
    state = level * 5 + run
    table = _STUFF
    for byte in (bits & (1 << (count - head)) - 1).to_bytes(count // 8, "big"):
        code = table[state][byte]
        added += code & 7
        state = code >> 3
    return added


@dataclass(frozen=True, slots=True, init=False)
class Frame:
    """A classical CAN frame.

    Args:
        can_id: identifier, 0..7FFh, or 0..1FFFFFFFh where `extended`.
        data: 0..8 bytes; empty in a remote frame.
        remote: a remote transmission request.
        extended: 29-bit identifier.
        dlc: data length code 0..15; left out it is the number of bytes. In a data frame
            8..15 all mean eight bytes; in a remote frame it is the length asked for.

    Raises:
        ValueError: a field out of range, with its value.
    """

    can_id: int
    data: bytes = b""
    remote: bool = False
    extended: bool = False
    dlc: int = -1
    known_bits: int = field(default=0, init=False, repr=False, compare=False)
    """`bits` once somebody asked for it, 0 before: spares whoever is in a hurry a call."""
    order: int = field(default=0, init=False, repr=False, compare=False)
    """Arbitration: of two frames that start together the one with the lower order wins."""
    body: int = field(default=0, init=False, repr=False, compare=False)
    """The data as a big-endian number, for packing."""
    head: int = field(default=0, init=False, repr=False, compare=False)
    """Everything but the data, packed: can_id | extended << 29 | remote << 30 | dlc << 32."""

    def __init__(
        self,
        can_id: int,
        data: bytes = b"",
        remote: bool = False,
        extended: bool = False,
        dlc: int = -1,
    ) -> None:
        size = len(data)
        unusual = remote or extended or dlc != -1
        if unusual or size > MAX_DATA_BYTES or not 0 <= can_id <= MAX_BASE_ID:
            dlc = _checked_dlc(can_id, size, remote, extended, dlc)
            order = _arbitration_order(can_id, remote, extended)
            head = can_id | extended << 29 | remote << 30 | dlc << 32
        else:
            # As above, for the frames that nearly all are: base, data, of their own length.
            dlc = size
            order = can_id << 21
            head = can_id | size << 32
        _CAN_ID(self, can_id)
        _DATA(self, data)
        _REMOTE(self, remote)
        _EXTENDED(self, extended)
        _DLC(self, dlc)
        _KNOWN_BITS(self, 0)
        _ORDER(self, order)
        _BODY(self, int.from_bytes(data, "big"))
        _HEAD(self, head)

    @classmethod
    def unpack(cls, head: int, data: bytes) -> Frame:
        """The frame whose `head` and data are given (the inverse of packing in a trace)."""
        return cls(
            head & MAX_EXTENDED_ID,
            data,
            bool(head >> 30 & 1),
            bool(head >> 29 & 1),
            head >> 32 & 0xF,
        )

    @property
    def bits(self) -> int:
        """Length on the wire in bits: start of frame to end of frame, stuff bits included.

        The intermission that follows (3 bits) is not counted.
        """
        bits = self.known_bits
        if not bits:
            bits = _wire_bits(self.head, self.body)
            object.__setattr__(self, "known_bits", bits)
        return bits

    def __str__(self) -> str:
        ident = f"{self.can_id:08X}" if self.extended else f"{self.can_id:03X}"
        if self.remote:
            return f"{ident}#R{self.dlc}"
        extra = f"_{self.dlc:X}" if self.dlc > MAX_DATA_BYTES else ""
        return f"{ident}#{self.data.hex().upper()}{extra}"


_CAN_ID, _DATA, _REMOTE, _EXTENDED, _DLC, _KNOWN_BITS, _ORDER, _BODY, _HEAD = (
    getattr(Frame, slot.name).__set__ for slot in fields(Frame)
)
"""Write the slots of a new frame: a quarter of what the `__init__` of a frozen class takes."""


@lru_cache(maxsize=4096)
def data_frame(can_id: int, data: bytes) -> Frame:
    """A base data frame, from memory where it was made before: for what is sent many times."""
    return Frame(can_id, data)


def _checked_dlc(can_id: int, size: int, remote: bool, extended: bool, dlc: int) -> int:
    """The data length code of a frame; ValueError where its fields make none."""
    if not 0 <= can_id <= (MAX_EXTENDED_ID if extended else MAX_BASE_ID):
        kind = "an extended" if extended else "a base"
        raise ValueError(f"identifier {can_id:#x} does not fit {kind} frame")
    if size > MAX_DATA_BYTES:
        raise ValueError(f"{size} data bytes; a classical frame holds at most 8")
    if remote and size:
        raise ValueError("a remote frame carries no data; give its length as dlc")
    if dlc == -1:
        return size
    if not 0 <= dlc <= MAX_DLC or (not remote and min(dlc, 8) != size):
        raise ValueError(f"dlc {dlc} does not go with {size} data bytes")
    return dlc


def _arbitration_order(can_id: int, remote: bool, extended: bool) -> int:
    """The arbitration field as a number: base id, RTR or SRR, IDE, extension, RTR."""
    if not extended:
        return can_id << 21 | remote << 20
    return (can_id >> 18) << 21 | 3 << 19 | (can_id & 0x3FFFF) << 1 | remote


@lru_cache(maxsize=4096)  # most frames of a bus have been there before
def _wire_bits(head: int, body: int) -> int:
    """Exact length of a frame in bits; the start bit, header, data and CRC are stuffed."""
    can_id, remote, dlc = head & MAX_EXTENDED_ID, head >> 30 & 1, head >> 32 & 0xF
    size = 0 if remote else min(dlc, MAX_DATA_BYTES)
    if head >> 29 & 1:
        # SOF, 11 id, SRR, IDE, 18 id, RTR, r1, r0, 4 dlc
        header = (can_id >> 18) << 27 | 3 << 25 | (can_id & 0x3FFFF) << 7 | remote << 6 | dlc
        count = 39
    else:
        # SOF, 11 id, RTR, IDE, r0, 4 dlc
        header = can_id << 7 | remote << 6 | dlc
        count = 19
    bits = header << 8 * size | body
    count += 8 * size
    stuffed = bits << 15 | crc15(bits, count)
    count += 15
    return count + stuff_bits(stuffed, count) + _TAIL_BITS
