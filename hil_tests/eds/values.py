"""Values in an EDS: numbers, formulas with $NODEID, reals, strings (CiA 306, 4.6).

Numbers are decimal, hexadecimal with 0x, or octal with a leading 0. A negative number may
be given as the two's complement of its type, in hexadecimal.
"""

from __future__ import annotations

import re
import struct
from dataclasses import dataclass

NODE = "$NODEID"
LONGEST_NUMBER = 40
"""Characters; 64 bits in octal have 23."""
LONGEST_VALUE = 1 << 20

_NUMBER = re.compile(r"([+-]?)(0[xX][0-9a-fA-F]+|[0-9]+)[uUlL]{0,3}")
_REAL = re.compile(r"[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]{1,4})?[fF]?")


class Unreadable(ValueError):
    """A text that is no value of its type; the message says what to write."""


@dataclass(frozen=True, slots=True)
class Kind:
    """A data type of CiA 301 (7.4.7.1).

    Args:
        name: for people.
        size: bytes; 0 where the length varies.
        form: "boolean", "signed", "unsigned", "real", "text", "bytes" or "time".
    """

    name: str
    size: int
    form: str

    @property
    def is_number(self) -> bool:
        """It has an order, and can have limits."""
        return self.form in {"boolean", "signed", "unsigned", "real"}


def _kinds() -> dict[int, Kind]:
    kinds = {0x01: Kind("BOOLEAN", 1, "boolean")}
    signed = {0x02: 1, 0x03: 2, 0x04: 4, 0x10: 3, 0x12: 5, 0x13: 6, 0x14: 7, 0x15: 8}
    unsigned = {0x05: 1, 0x06: 2, 0x07: 4, 0x16: 3, 0x18: 5, 0x19: 6, 0x1A: 7, 0x1B: 8}
    kinds |= {code: Kind(f"INTEGER{8 * size}", size, "signed") for code, size in signed.items()}
    kinds |= {
        code: Kind(f"UNSIGNED{8 * size}", size, "unsigned") for code, size in unsigned.items()
    }
    kinds |= {0x08: Kind("REAL32", 4, "real"), 0x11: Kind("REAL64", 8, "real")}
    kinds |= {0x09: Kind("VISIBLE_STRING", 0, "text"), 0x0A: Kind("OCTET_STRING", 0, "bytes")}
    kinds |= {0x0B: Kind("UNICODE_STRING", 0, "text"), 0x0F: Kind("DOMAIN", 0, "bytes")}
    kinds |= {0x0C: Kind("TIME_OF_DAY", 6, "time"), 0x0D: Kind("TIME_DIFFERENCE", 6, "time")}
    return kinds


KINDS = _kinds()
"""Data types by their code."""


@dataclass(frozen=True, slots=True)
class Value:
    """What a DefaultValue, ParameterValue or limit says.

    Args:
        text: as it stands in the file.
        line: where.
        kind: its data type.
        number: of a numeric type; with a formula, less the node id.
        data: of another type.
        follows_node: the node id is added.
    """

    text: str
    line: int
    kind: Kind
    number: int | float = 0
    data: bytes = b""
    follows_node: bool = False

    def at(self, node_id: int) -> int | float:
        """The number that a device with this node id has."""
        return self.number + node_id if self.follows_node else self.number

    def bytes_at(self, node_id: int) -> bytes:
        """The bytes that a device with this node id has.

        Raises:
            OverflowError: the number does not fit its type.
        """
        kind = self.kind
        if not kind.is_number:
            return self.data
        if kind.form == "real":
            return struct.pack("<f" if kind.size == 4 else "<d", self.at(node_id))
        number = int(self.at(node_id))
        return number.to_bytes(kind.size, "little", signed=kind.form == "signed")

    def fits(self, node_id: int) -> bool:
        """Whether the number is one of its type."""
        try:
            self.bytes_at(node_id)
        except (OverflowError, struct.error):
            return False
        return self.kind.form != "boolean" or self.at(node_id) in {0, 1}


def number_of(text: str) -> int:
    """A number without formula.

    Raises:
        Unreadable: it is none.
    """
    plain = text.partition(";")[0].strip()
    found = _NUMBER.fullmatch(plain) if len(plain) <= LONGEST_NUMBER else None
    if found is None:
        raise Unreadable("write a number as 12 or 0x0C")
    sign, digits = found.groups()
    if digits[:2] in {"0x", "0X"}:
        number = int(digits, 16)
    elif digits[0] == "0" and set(digits) <= set("01234567"):
        number = int(digits, 8)
    else:
        number = int(digits)
    return -number if sign == "-" else number


def is_octal_trap(text: str) -> bool:
    """A leading 0 that readers take for octal or for decimal, with different numbers."""
    found = _NUMBER.fullmatch(text.partition(";")[0].strip())
    digits = found.group(2) if found else ""
    return len(digits) > 1 and digits[0] == "0" and digits.isdecimal() and int(digits) > 7


def formula_of(text: str) -> tuple[int, bool]:
    """A number, with or without $NODEID; the order and the case do not matter.

    Raises:
        Unreadable: it is none.
    """
    plain = text.partition(";")[0].upper().replace(" ", "").replace("\t", "")
    if NODE not in plain:
        return number_of(text), False
    terms = plain.split("+")
    if len(terms) > 2 or terms.count(NODE) != 1:
        raise Unreadable("write $NODEID+0x180")
    terms.remove(NODE)
    return (number_of(terms[0].replace("0X", "0x")) if terms else 0), True


def value_of(text: str, line: int, kind: Kind) -> Value:
    """A value of that type.

    Raises:
        Unreadable: the text is none.
    """
    if len(text) > LONGEST_VALUE:
        raise Unreadable("shorten it")
    if kind.form == "text":
        encoding = "utf-16-le" if kind.name == "UNICODE_STRING" else "utf-8"
        return Value(text, line, kind, data=text.encode(encoding, "replace"))
    if kind.form == "bytes":
        return Value(text, line, kind, data=bytes_of(text))
    if kind.form == "time":
        return Value(text, line, kind, data=_time_of(text, kind))
    if kind.form == "real":
        return Value(text, line, kind, number=real_of(text, kind))
    number, follows = formula_of(text)
    bits = 8 * kind.size
    if kind.form == "signed" and not follows and 0 <= number - (1 << bits - 1) < 1 << bits - 1:
        if text[:2] not in {"0x", "0X"}:
            raise Unreadable(f"{kind.name} ends at {(1 << bits - 1) - 1}")
        number -= 1 << bits
    return Value(text, line, kind, number=number, follows_node=follows)


def bytes_of(text: str) -> bytes:
    """Octets in hexadecimal, with or without spaces or 0x.

    Raises:
        Unreadable: they are none.
    """
    plain = re.sub(r"[\s,]|0[xX]", "", text)
    try:
        return bytes.fromhex(plain)
    except ValueError:
        raise Unreadable("write bytes in hexadecimal, e.g. 01 AB") from None


def _time_of(text: str, kind: Kind) -> bytes:
    number = number_of(text)
    if not 0 <= number < 1 << 8 * kind.size:
        raise Unreadable(f"a {kind.name} has six bytes")
    return number.to_bytes(kind.size, "little")


def real_of(text: str, kind: Kind) -> float:
    """A decimal number, or in hexadecimal the bits of one.

    Raises:
        Unreadable: it is neither.
    """
    plain = text.partition(";")[0].strip()
    if plain[:2] in {"0x", "0X"}:
        number = number_of(plain)
        if number >= 1 << 8 * kind.size:
            raise Unreadable(f"a {kind.name} has {8 * kind.size} bits")
        real: float = struct.unpack(
            "<f" if kind.size == 4 else "<d", number.to_bytes(kind.size, "little")
        )[0]
        return real
    if len(plain) > LONGEST_NUMBER or not _REAL.fullmatch(plain):
        raise Unreadable("write a real as 1.5")
    return float(plain.rstrip("fF"))
