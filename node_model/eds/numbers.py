"""Numbers and values as CiA 306 writes them (4.6): text in, number or bytes out."""

from __future__ import annotations

import struct
from dataclasses import dataclass

from node_model.od import DataType

NODE_ID = "$nodeid"
MOST_DIGITS = 40
"""Of a number; Python's own limit is a hundred times higher, and so is what it costs."""
_SUFFIXES = "ul"
_HEX = frozenset("0123456789abcdef")
_DIGITS = frozenset("0123456789")
_OCTAL = frozenset("01234567")
_REAL = frozenset("0123456789+-.e")


class NotThis(ValueError):
    """The text is no such value; the message is the remedy."""


@dataclass(frozen=True, slots=True)
class Amount:
    """A number, to which the node id is added where it is `relative`."""

    number: float
    relative: bool = False

    def of(self, node_id: int) -> float:
        """The number for a node id."""
        return self.number + node_id if self.relative else self.number


def without_comment(text: str) -> str:
    """A number may be followed by a comment."""
    return text.split(";", 1)[0].strip()


def whole(text: str) -> int:
    """Decimal, hexadecimal with 0x, or octal with 0 in front, with a sign and C's suffixes.

    Raises:
        NotThis: it is none of these.
    """
    body = without_comment(text).lower()
    sign = -1 if body.startswith("-") else 1
    body = body[1:] if body[:1] in {"+", "-"} else body
    if len(body) > MOST_DIGITS:
        raise NotThis("shorten the number")
    if body.startswith("0x"):
        digits, known, base = body[2:].rstrip(_SUFFIXES), _HEX, 16
    else:
        digits = body.rstrip(_SUFFIXES)
        octal = digits.startswith("0") and set(digits) <= _OCTAL
        known, base = (_OCTAL, 8) if octal else (_DIGITS, 10)
    if not digits or not set(digits) <= known:
        raise NotThis("write it like 12 or 0x0C")
    return sign * int(digits, base)


def amount(text: str) -> Amount:
    """A number or a sum of one and $NODEID, in either order.

    Raises:
        NotThis: it is neither.
    """
    body = "".join(without_comment(text).lower().split())
    if NODE_ID not in body:
        return Amount(whole(text))
    if body == NODE_ID:
        return Amount(0, relative=True)
    for rest, fits in (
        (body.removeprefix(NODE_ID + "+"), body.startswith(NODE_ID + "+")),
        (body.removesuffix("+" + NODE_ID), body.endswith("+" + NODE_ID)),
    ):
        if fits:
            return Amount(whole(rest), relative=True)
    raise NotThis("write it like $NODEID+0x180")


def real(text: str, kind: DataType) -> Amount:
    """A decimal number, or its bits in hexadecimal.

    Raises:
        NotThis: it is neither.
    """
    body = without_comment(text).lower()
    if body.startswith("0x"):
        bits = whole(body)
        if bits.bit_length() > 8 * kind.size:
            raise NotThis(f"a {kind.name} has {8 * kind.size} bits")
        return Amount(kind.unpack(bits.to_bytes(kind.size, "little")))
    digits = body.removesuffix("f")
    if len(digits) > MOST_DIGITS or not set(digits) <= _REAL:
        raise NotThis("write it like 1.5")
    try:
        return Amount(float(digits))
    except ValueError:
        raise NotThis("write it like 1.5") from None


def number(text: str, kind: DataType) -> Amount:
    """A value of a numeric type; hexadecimal may be the two's complement of a negative one.

    Raises:
        NotThis: it is none, or it does not fit.
    """
    if kind.is_real:
        found = real(text, kind)
    else:
        found = amount(text)
        bits = 8 * kind.size
        is_hex = without_comment(text).lower().startswith("0x")
        if kind.is_signed and is_hex and not found.relative and int(found.number) >> bits - 1 == 1:
            found = Amount(found.number - (1 << bits))
    for node_id in (1, 127) if found.relative else (0,):
        try:
            kind.pack(found.of(node_id))
        except (OverflowError, struct.error):
            raise NotThis(f"a {kind.name} cannot hold it") from None
    return found


def octets(text: str) -> bytes:
    """Bytes in hexadecimal, with or without spaces, commas and 0x.

    Raises:
        NotThis: it is none.
    """
    body = text.lower().replace("0x", "").replace(",", " ")
    try:
        return bytes.fromhex("".join(body.split()))
    except ValueError:
        raise NotThis("write bytes like 01 AB") from None


def string(text: str, kind: DataType) -> bytes:
    """The bytes of a value that is no number.

    Raises:
        NotThis: it is no value of that type.
    """
    if kind is DataType.VISIBLE_STRING:
        return text.encode("utf-8", "replace")
    if kind is DataType.UNICODE_STRING:
        return text.encode("utf-16-le", "replace")
    if kind.size:  # times
        count = whole(text)
        if not 0 <= count < 1 << 8 * kind.size:
            raise NotThis(f"a {kind.name} has {kind.size} bytes")
        return count.to_bytes(kind.size, "little")
    return octets(text)
