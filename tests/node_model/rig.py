"""A device and everything that a master does to it, frame by frame, for tests."""

from __future__ import annotations

from collections.abc import Sequence

from node_model.frame import Frame
from node_model.node import MS, Panel

Said = list[tuple[int, Frame]]


class Refused(Exception):
    """An SDO abort; its code is the argument."""


class Rig:
    """A device whose time this test decides.

    Args:
        device: switched off.
        node_id: under which it is spoken to.
    """

    def __init__(self, device: Panel, node_id: int = 5) -> None:
        self.device = device
        self.node_id = node_id
        self.now = 0
        self.said: Said = []

    def __call__(self, at_ms: float) -> list[Frame]:
        """Let time go on to an instant; what the device says meanwhile."""
        until, first = int(at_ms * MS), len(self.said)
        while (due := self.device.deadline()) is not None and due <= until:
            self.said += [(due, frame) for frame in self.device.advance(due)]
        self.now = until
        return [frame for _, frame in self.said[first:]]

    def power_on(self, boot_ms: float = 60) -> list[Frame]:
        """Supply, and time to boot."""
        self.keep(self.device.power_on(self.now))
        return self(self.now / MS + boot_ms)

    def power_off(self) -> None:
        """No supply."""
        assert not self.device.power_off(self.now)

    def keep(self, frames: Sequence[Frame]) -> list[Frame]:
        """Write down what was said now."""
        self.said += [(self.now, frame) for frame in frames]
        return list(frames)

    def send(self, can_id: int, *data: int, remote: bool = False) -> list[Frame]:
        """A frame now; what it is answered."""
        frame = Frame(can_id, b"" if remote else bytes(data), remote=remote)
        return self.keep(self.device.receive(frame, self.now))

    def nmt(self, command: int) -> list[Frame]:
        """An NMT command for this node."""
        return self.send(0, command, self.node_id)

    def sync(self) -> list[Frame]:
        """A SYNC without counter, and two milliseconds: the synchronous TPDOs."""
        said = self.send(0x080)
        return said + self(self.now / MS + 2)

    def fail(self, *active: str) -> list[Frame]:
        """Exactly these errors exist from now on."""
        return self.keep(self.device.fail(frozenset(active), self.now))

    def request(self, *data: int) -> list[Frame]:
        """An SDO request."""
        return self.send(0x600 + self.node_id, *bytes(data).ljust(8, b"\0"))

    def write(self, index: int, sub: int, value: int, size: int) -> list[Frame]:
        """Expedited download; what else is said because of it.

        Raises:
            Refused: with the abort code.
        """
        place = (*index.to_bytes(2, "little"), sub)
        number = value.to_bytes(size, "little", signed=value < 0)
        answer, *rest = self.request(0x23 | 4 - size << 2, *place, *number)
        assert answer.can_id == 0x580 + self.node_id
        if answer.data[0] == 0x80:
            raise Refused(int.from_bytes(answer.data[4:], "little"))
        assert answer.data == bytes((0x60, *place, 0, 0, 0, 0))
        return rest

    def read(self, index: int, sub: int = 0, signed: bool = False) -> int:
        """Expedited upload.

        Raises:
            Refused: with the abort code.
        """
        (answer,) = self.request(0x40, *index.to_bytes(2, "little"), sub)
        if answer.data[0] == 0x80:
            raise Refused(int.from_bytes(answer.data[4:], "little"))
        size = 4 - (answer.data[0] >> 2 & 3)
        return int.from_bytes(answer.data[4 : 4 + size], "little", signed=signed)
