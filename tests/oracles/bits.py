"""A frame as a string of '0' and '1', written naively from ISO 11898-1, field by field.

Slow and plain on purpose: it shares no table, no shift and no constant with `node_model.frame`,
and takes its check sequence from the package crccheck.
"""

from __future__ import annotations

from crccheck.crc import Crc15Can

from node_model.frame import Frame

DOMINANT = "0"
RECESSIVE = "1"
TAIL = "1" + "0" + "1" + "1" * 7
"""CRC delimiter, acknowledge slot (some receiver drives it), its delimiter, end of frame."""


def arbitration_field(frame: Frame) -> str:
    """Identifier and the bits that decide who goes on: RTR and IDE, or SRR, IDE, RTR."""
    rtr = RECESSIVE if frame.remote else DOMINANT
    if not frame.extended:
        return f"{frame.can_id:011b}" + rtr + DOMINANT
    ident = f"{frame.can_id:029b}"
    return ident[:11] + RECESSIVE + RECESSIVE + ident[11:] + rtr


def unstuffed(frame: Frame) -> str:
    """From start of frame to the end of the data: everything that the CRC covers."""
    reserved = DOMINANT * (2 if frame.extended else 1)
    data = "".join(f"{byte:08b}" for byte in frame.data)
    return DOMINANT + arbitration_field(frame) + reserved + f"{frame.dlc:04b}" + data


def check_sequence(bits: str) -> str:
    """CRC-15/CAN of a bit string; zeros in front, up to a whole byte, do not change it."""
    padded = bits.zfill((len(bits) + 7) // 8 * 8)
    octets = bytes(int(padded[at : at + 8], 2) for at in range(0, len(padded), 8))
    return f"{Crc15Can.calc(octets):015b}"


def stuffed(bits: str) -> str:
    """After five equal bits, stuff bits counted, comes one of the other level."""
    sent = ""
    for bit in bits:
        sent += bit
        if sent.endswith((DOMINANT * 5, RECESSIVE * 5)):
            sent += RECESSIVE if bit == DOMINANT else DOMINANT
    return sent


def on_the_wire(frame: Frame) -> str:
    """Every bit of a frame, from its start to its end."""
    covered = unstuffed(frame)
    return stuffed(covered + check_sequence(covered)) + TAIL


def wins(one: Frame, other: Frame) -> bool:
    """Whether `one` prevails when both start together.

    Bit by bit: who sends recessive and sees dominant withdraws. With equal arbitration
    fields nobody withdraws, and nobody wins.
    """
    pairs = zip(arbitration_field(one), arbitration_field(other), strict=False)
    for mine, theirs in pairs:
        if mine != theirs:
            return mine == DOMINANT
    return False
