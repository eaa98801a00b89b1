"""The drive as a whole: a CiA 301 device with an axis and errors of its own."""

from __future__ import annotations

import struct
from dataclasses import astuple

from node_model.device import Cia301Device, Parts
from node_model.drive.profile import Factory, Profile
from node_model.node import NOTHING, Frames, refuse_strangers
from node_model.od import Access, DataType, Entry
from node_model.storage import RecordStore

_RECORD = struct.Struct("<BIH")
"""Node id, bit rate and heartbeat time in memory."""


def entries(factory: Factory) -> list[Entry]:
    """The objects of the drive, with the values that it leaves the factory with."""
    objects = (
        (0x1000, 0, "Device type", DataType.UNSIGNED32, Access.RO, 0x0002_0192),
        (0x1001, 0, "Error register", DataType.UNSIGNED8, Access.RO, 0),
        (
            0x1017,
            0,
            "Producer heartbeat time",
            DataType.UNSIGNED16,
            Access.RW,
            factory.heartbeat_ms,
        ),
    )
    return [
        Entry(index, sub, name, kind, access, kind.pack(value), kind.pack(value))
        for index, sub, name, kind, access, value in objects
    ]


def record_of(factory: Factory) -> bytes:
    """What the memory of a drive with these settings holds."""
    return _RECORD.pack(*astuple(factory))


class Drive(Cia301Device):
    """A drive that keeps the laws of a node.

    Args:
        profile: facts of the hardware.
        image: content of its memory, e.g. from an earlier life; b"" = as it left the factory.
        parts: the classes it is made of.
    """

    def __init__(self, profile: Profile, image: bytes = b"", parts: Parts | None = None) -> None:
        self.profile = profile
        self.faults = tuple(profile.faults)
        self._active: frozenset[str] = frozenset()
        store = RecordStore(_RECORD.size, image)
        record = store.load()
        self.factory = Factory(*_RECORD.unpack(record)) if record else profile.factory
        super().__init__(profile.name, self.factory.node_id, self.factory.bit_rate, parts)
        self._memory = bytes(store.memory)

    def entries(self, node_id: int) -> list[Entry]:  # noqa: ARG002 - COB-IDs follow it
        """Its objects."""
        return entries(self.factory)

    def image(self) -> bytes:
        """Content of its memory."""
        return self._memory

    def fail(self, active: frozenset[str], now: int) -> Frames:  # noqa: ARG002 - a verb
        """From `now` on exactly these errors exist."""
        refuse_strangers("fault", active, self.faults, self.name)
        self._active = active
        return NOTHING
