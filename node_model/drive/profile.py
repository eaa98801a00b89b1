"""The facts of a drive, read from a TOML profile.

The device's reader: it takes what it needs to behave and trusts the rest; the tester has
a reader of its own that checks every key and reports all errors at once.
"""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import ClassVar

from node_model.generic import WINDOW_UNITS, Factory
from node_model.node import US
from node_model.service import Fault

REGISTER_BITS = {
    "current": 0x02,
    "voltage": 0x04,
    "temperature": 0x08,
    "communication": 0x10,
    "profile": 0x20,
    "manufacturer": 0x80,
}
"""Bits of the error register 1001h (CiA 301 4.2.0, 7.5.2.2); bit 0 is set by every error."""

Place = tuple[int, int]
"""Index and sub-index of an object."""


@dataclass(frozen=True, slots=True)
class Profile:
    """What a drive is.

    Args:
        name: for people.
        eds: path of its EDS file.
        factory: how it leaves the factory.
        window_unit_ns: what one step of 1007h is.
        control, status, set_point, actual: the objects of the axis.
        faults: errors that a bench can raise, by name.
    """

    kind: ClassVar[str] = "drive"

    name: str = "drive"
    eds: str = ""
    factory: Factory = field(default_factory=Factory)
    window_unit_ns: int = US
    control: Place = (0x6040, 0)
    status: Place = (0x6041, 0)
    set_point: Place = (0x607A, 0)
    actual: Place = (0x6064, 0)
    faults: Mapping[str, Fault] = field(default_factory=dict)


def _place(value: Iterable[int]) -> Place:
    index, sub = value
    return index, sub


def _fault(table: Mapping[str, object]) -> Fault:
    """One line of [faults]."""
    code, register, manufacturer = table["code"], table["register"], table["manufacturer"]
    if not isinstance(code, int) or not isinstance(register, list):
        raise ValueError(f"{table} is no fault: code is a number, register a list of names")
    bits = sum({REGISTER_BITS[name] for name in register})
    return Fault(code, bits, bytes.fromhex(str(manufacturer)))


def loads(text: str) -> Profile:
    """A profile from the text of a TOML file.

    Raises:
        ValueError, KeyError, TypeError: not TOML, or a value that the device needs is
            missing or of the wrong form.
    """
    table = tomllib.loads(text)
    axis = table["axis"]
    return Profile(
        name=table["device"]["name"],
        eds=table["device"]["eds"],
        factory=Factory(**table["factory"]),
        window_unit_ns=WINDOW_UNITS[table["sync"]["window_unit"]],
        control=_place(axis["control"]),
        status=_place(axis["status"]),
        set_point=_place(axis["set_point"]),
        actual=_place(axis["actual"]),
        faults={name: _fault(fault) for name, fault in table["faults"].items()},
    )
