"""The devices that are fuzzed: the drive, and a generic one that has every kind of object."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from benchmarks.fuzz.known import NODE
from benchmarks.fuzz.lives import Maker
from node_model.composition import Facts, Parts
from node_model.device import Cia301Device
from node_model.devices import make_device
from node_model.od import Access, DataType, Entry
from node_model.sheets import entries_of, shipped

RW, WO = Access.RW, Access.WO


def _drive() -> Cia301Device:
    device = make_device("drive")
    assert isinstance(device, Cia301Device)
    return device


def _more() -> list[Entry]:
    """What the drive has not: a second SDO server, and values of every length."""
    subs = ((0, DataType.UNSIGNED8, 2), (1, DataType.UNSIGNED32, 1 << 31))
    found = [
        Entry(0x1201, sub, "SDO server", kind, RW if sub else Access.RO, value, value)
        for sub, kind, number in (*subs, (2, DataType.UNSIGNED32, 1 << 31))
        for value in (kind.pack(number),)
    ]
    for kind in DataType:
        value = bytes(kind.size)
        places = 0x2100 + kind, "value", kind, RW, value, value
        found.append(Entry(places[0], 0, *places[1:], pdo=bool(kind.size)))
    found.append(Entry(0x2180, 0, "limits", DataType.INTEGER16, RW, b"\0\0", b"\0\0", -5, 5, True))
    found.append(Entry(0x2181, 0, "short", DataType.OCTET_STRING, RW, most=20))
    found.append(Entry(0x2182, 0, "write only", DataType.UNSIGNED32, WO, bytes(4), bytes(4)))
    found.append(Entry(0x2183, 0, "long", DataType.DOMAIN, RW, bytes(1000), bytes(1000)))
    return found


def _entries(node_id: int) -> list[Entry]:
    return [*entries_of(shipped("drive.eds"), node_id), *_more()]


def generic(parts: Parts | None = None) -> Cia301Device:
    """A device with every kind of object.

    Args:
        parts: the classes that it is made of.
    """
    return Cia301Device(Facts("generic", NODE, 250_000, _entries), parts=parts)


MODELS: Mapping[str, Maker] = MappingProxyType({"drive": _drive, "generic": generic})
"""What makes them, by name."""


def chosen(number: int) -> tuple[str, bool]:
    """The model of a life, and whether it is on a wire with bit times: one in eight is."""
    names = list(MODELS)
    return names[number % len(names)], number // len(names) % 8 == 7
