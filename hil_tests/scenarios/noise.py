"""Garbage for scenarios: frames of any identifier, length and type that must change nothing."""

from __future__ import annotations

NOISES = 96
"""How many different frames of garbage a family of noise knows."""


def noise(number: int) -> str:
    """A frame of garbage: any identifier, length and type, the same for the same number."""
    state = (number * 2654435761 + 40503) & 0xFFFFFFFF
    near = (0x080, 0x100, 0x180, 0x1F8, 0x280, 0x380, 0x3F8, 0x480, 0x4F8, 0x580, 0x600, 0x680,
            0x700, 0x7E4, 0x7E5, 0x7FF)  # fmt: skip
    can_id = near[number % 16] if number % 3 else state >> 8 & 0x7FF
    size = state >> 20 & 0xF
    data = bytes((state >> shift & 0xFF) for shift in (0, 3, 7, 11, 13, 17, 19, 23))
    if can_id == 0:
        can_id = 0x7FF
    match number % 7:
        case 0:
            return f"send {can_id:03X}#R{size % 9}"
        case 1:
            return f"send {can_id << 18 | state & 0x3FFFF:08X}#{data[: size % 9].hex().upper()}"
        case 2:
            return f"send {can_id:03X}#{data.hex().upper()}_{9 + size % 7:X}"
        case 3:
            base = (0x080, 0x180, 0x280, 0x380, 0x580, 0x600, 0x700)[state % 7]
            kind = f"R{size % 9}" if number % 2 else data[: size % 9].hex().upper()
            return f"send +{base:03X}#{kind}"
        case _:
            return f"send {can_id:03X}#{data[: size % 9].hex().upper()}"


NOISE = tuple(noise(number) for number in range(NOISES))
