"""A classical CAN data or remote frame as a value, with its exact length on the wire.

The one type that both sides of the project share: devices send it, testers judge it.
Laws: a frame never changes; equal fields make equal frames; its length in bits counts
every stuff bit (ISO 11898-1:2015, 10.4-10.6), so that bus time can be computed exactly.
"""

from __future__ import annotations

from dataclasses import dataclass, field

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


@dataclass(frozen=True, slots=True)
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
    _bits: int = field(default=0, init=False, repr=False, compare=False)
    order: int = field(default=0, init=False, repr=False, compare=False)
    """Arbitration: of two frames that start together the one with the lower order wins."""
    body: int = field(default=0, init=False, repr=False, compare=False)
    """The data as a big-endian number, for packing."""
    head: int = field(default=0, init=False, repr=False, compare=False)
    """Everything but the data, packed: can_id | extended << 29 | remote << 30 | dlc << 32."""

    def __post_init__(self) -> None:
        size = len(self.data)
        if not 0 <= self.can_id <= (MAX_EXTENDED_ID if self.extended else MAX_BASE_ID):
            kind = "an extended" if self.extended else "a base"
            raise ValueError(f"identifier {self.can_id:#x} does not fit {kind} frame")
        if size > MAX_DATA_BYTES:
            raise ValueError(f"{size} data bytes; a classical frame holds at most 8")
        if self.remote and size:
            raise ValueError("a remote frame carries no data; give its length as dlc")
        write = object.__setattr__
        if self.dlc == -1:
            write(self, "dlc", size)
        elif not 0 <= self.dlc <= MAX_DLC or (not self.remote and min(self.dlc, 8) != size):
            raise ValueError(f"dlc {self.dlc} does not go with {size} data bytes")
        write(self, "body", int.from_bytes(self.data, "big"))
        write(self, "order", _arbitration_order(self.can_id, self.remote, self.extended))
        write(
            self,
            "head",
            self.can_id | self.extended << 29 | self.remote << 30 | self.dlc << 32,
        )

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
        bits = self._bits
        if not bits:
            bits = _wire_bits(self)
            object.__setattr__(self, "_bits", bits)
        return bits

    def __str__(self) -> str:
        ident = f"{self.can_id:08X}" if self.extended else f"{self.can_id:03X}"
        if self.remote:
            return f"{ident}#R{self.dlc}"
        extra = f"_{self.dlc:X}" if self.dlc > MAX_DATA_BYTES else ""
        return f"{ident}#{self.data.hex().upper()}{extra}"


def _arbitration_order(can_id: int, remote: bool, extended: bool) -> int:
    """The arbitration field as a number: base id, RTR or SRR, IDE, extension, RTR."""
    if not extended:
        return can_id << 21 | remote << 20
    return (can_id >> 18) << 21 | 3 << 19 | (can_id & 0x3FFFF) << 1 | remote


def _wire_bits(frame: Frame) -> int:
    """Exact length of a frame in bits; the start bit, header, data and CRC are stuffed."""
    size = len(frame.data)
    if frame.extended:
        # SOF, 11 id, SRR, IDE, 18 id, RTR, r1, r0, 4 dlc
        header = (frame.can_id >> 18) << 27 | 3 << 25 | (frame.can_id & 0x3FFFF) << 7
        header |= frame.remote << 6 | frame.dlc
        count = 39
    else:
        # SOF, 11 id, RTR, IDE, r0, 4 dlc
        header = frame.can_id << 7 | frame.remote << 6 | frame.dlc
        count = 19
    bits = header << 8 * size | int.from_bytes(frame.data, "big")
    count += 8 * size
    stuffed = bits << 15 | crc15(bits, count)
    count += 15
    return count + stuff_bits(stuffed, count) + _TAIL_BITS
