"""Small object dictionaries, and a host that lets time pass, for tests of services."""

from __future__ import annotations

from collections.abc import Sequence

import pytest

from node_model.frame import Frame
from node_model.node import Frames
from node_model.od import AbortCode, Access, DataType, Entry, ObjectDictionary, SdoAbort
from node_model.service import Fault, Service

Sent = list[tuple[int, str]]
"""Instants and frames in candump's notation."""


def entry(
    index: int,
    sub: int,
    data_type: DataType,
    value: float = 0,
    access: Access = Access.RW,
    pdo: bool = False,
) -> Entry:
    """A number of the dictionary; its value is its default."""
    data = data_type.pack(value)
    return Entry(index, sub, f"{index:04X}:{sub}", data_type, access, data, data, pdo=pdo)


def u8(index: int, sub: int = 0, value: int = 0, access: Access = Access.RW) -> Entry:
    """An UNSIGNED8."""
    return entry(index, sub, DataType.UNSIGNED8, value, access)


def u16(index: int, sub: int = 0, value: int = 0) -> Entry:
    """An UNSIGNED16."""
    return entry(index, sub, DataType.UNSIGNED16, value)


def u32(index: int, sub: int = 0, value: int = 0, access: Access = Access.RW) -> Entry:
    """An UNSIGNED32."""
    return entry(index, sub, DataType.UNSIGNED32, value, access)


def write(od: ObjectDictionary, index: int, sub: int, value: float, now: int = 0) -> None:
    """A client writes a number."""
    od.write(index, sub, od.find(index, sub).data_type.pack(value), now)


def refused(od: ObjectDictionary, index: int, sub: int, value: float) -> AbortCode:
    """The code with which a write is refused; the value must stay."""
    before = od.get(index, sub)
    with pytest.raises(SdoAbort) as refusal:
        write(od, index, sub, value)
    assert od.get(index, sub) == before
    return refusal.value.code


def told(frames: Frames) -> list[str]:
    """Frames in candump's notation."""
    return [str(frame) for frame in frames]


def passing(service: Service, until: int) -> Sent:
    """What a service sends when it is called at each of its deadlines up to `until`."""
    sent: Sent = []
    while (due := service.deadline()) is not None and due <= until:
        sent += [(due, str(frame)) for frame in service.advance(due)]
        after = service.deadline()
        assert after is None or after > due, "after advance the deadline is None or later"
    return sent


def feed(service: Service, now: int, *frames: Frame) -> list[str]:
    """What a service answers to frames that end at `now`."""
    return [text for frame in frames for text in told(service.receive(frame, now))]


class Reports:
    """An error handler that remembers what it was told, and says so with a frame each."""

    def __init__(self) -> None:
        self.seen: list[tuple[int, str, Fault | None]] = []
        self.active: dict[str, Fault] = {}

    def occur(self, cause: str, fault: Fault, now: int) -> Frames:
        """Remember it, once."""
        if self.active.get(cause) == fault:
            return ()
        self.active[cause] = fault
        self.seen.append((now, cause, fault))
        return (Frame(0x085, fault.code.to_bytes(2, "little")),)

    def heal(self, cause: str, now: int) -> Frames:
        """Remember it, where it was there."""
        if self.active.pop(cause, None) is None:
            return ()
        self.seen.append((now, cause, None))
        return (Frame(0x085, b"\0\0"),)

    @property
    def codes(self) -> Sequence[tuple[int, int]]:
        """Instants and emergency codes; 0 = an end."""
        return [(now, fault.code if fault else 0) for now, _, fault in self.seen]
