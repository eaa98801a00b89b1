"""Faults in taking the one message 4F8h (requirements COM-04, COM-08, COM-21..24)."""

from __future__ import annotations

from node_model.faults.parts import Fault
from node_model.frame import Frame
from node_model.keypad import Parameters
from node_model.keypad.commissioning import REQUEST_ID, Commissioning
from node_model.keypad.parameters import SIZE
from node_model.node import Frames


class IgnoresRequestWithSyncTime(Commissioning, Fault):
    """A 4F8h whose sync time is not zero is ignored."""

    violates = ("COM-04", "COM-11", "COM-05")

    def accepts(self, frame: Frame) -> bool:
        """Byte 4 must be zero."""
        return super().accepts(frame) and not frame.data[4]


class IgnoresLongRequest(Commissioning, Fault):
    """A 4F8h of eight bytes is ignored."""

    violates = ("COM-24",)

    def accepts(self, frame: Frame) -> bool:
        """Six bytes to the letter."""
        return super().accepts(frame) and len(frame.data) == SIZE


class TakesFiveBytes(Commissioning, Fault):
    """A 4F8h of five bytes is taken, the missing debounce time as 0."""

    violates = ("COM-24",)

    def accepts(self, frame: Frame) -> bool:
        """One byte less will do."""
        return super().accepts(frame) or (
            frame.can_id == REQUEST_ID and not frame.extended and len(frame.data) == SIZE - 1
        )

    def decode(self, data: bytes) -> Parameters | None:
        """What is missing counts as zero."""
        return super().decode(data.ljust(SIZE, b"\0"))


class TakesRemoteRequest(Commissioning, Fault):
    """A remote frame 4F8h is taken as parameters, every byte 1."""

    violates = ("COM-24", "COM-20")

    def accepts(self, frame: Frame) -> bool:
        """Its buffer holds whatever it holds."""
        empty = frame.remote and not frame.extended and frame.can_id == REQUEST_ID
        return empty or super().accepts(frame)

    def decode(self, data: bytes) -> Parameters | None:
        """Nothing was transmitted."""
        return super().decode(data.ljust(SIZE, b"\1"))


class TakesExtendedRequest(Commissioning, Fault):
    """A frame with the 29-bit identifier 4F8h is taken as parameters."""

    violates = ("COM-24",)
    listens_to = None

    def accepts(self, frame: Frame) -> bool:
        """The format is not looked at."""
        named = frame.can_id == REQUEST_ID and not frame.remote
        return named and len(frame.data) >= SIZE


class SecondRequestChangesEcho(Commissioning, Fault):
    """A second 4F8h is taken like the first."""

    violates = ("COM-21",)

    def receive(self, frame: Frame, now: int) -> Frames:
        """Forget the first one."""
        if self.accepts(frame) and self.decode(frame.data):
            self.echo = None
        return super().receive(frame, now)


class SecondRequestChangesMemory(Commissioning, Fault):
    """A second 4F8h is stored, though the echo shows the first."""

    violates = ("COM-21", "COM-06")

    def receive(self, frame: Frame, now: int) -> Frames:
        """Store behind the echo's back."""
        parameters = self.decode(frame.data) if self.accepts(frame) else None
        if self.echo and parameters:
            self.store.save(parameters.encode(), now)
        return super().receive(frame, now)


class _AnyId(Commissioning):
    """Takes one node id that it should refuse."""

    takes: range

    def decode(self, data: bytes) -> Parameters | None:
        """Parameters with an id that is none."""
        if len(data) < SIZE or data[0] not in self.takes:
            return super().decode(data)
        return Parameters(data[0], data[1], data[2] << 8 | data[3], data[4], data[5])


class TakesIdZero(_AnyId, Fault):
    """A 4F8h with node id 0 is taken."""

    violates = ("COM-22",)
    takes = range(1)


class TakesIdSixteen(_AnyId, Fault):
    """A 4F8h with node id 16 is taken."""

    violates = ("COM-22",)
    takes = range(16, 17)


class TakesIdsAboveFifteen(Commissioning, Fault):
    """Of the node id only the lowest four bits are taken."""

    violates = ("COM-22",)

    def decode(self, data: bytes) -> Parameters | None:
        """The upper half is cut off."""
        return super().decode(bytes((data[0] & 0x0F, *data[1:])))


class RefusesIdFifteen(Commissioning, Fault):
    """A 4F8h with node id 15 is refused."""

    violates = ("COM-08", "COM-04", "COM-05")

    def decode(self, data: bytes) -> Parameters | None:
        """One too few."""
        return None if data[0] == 15 else super().decode(data)


class RefusesIdOne(Commissioning, Fault):
    """A 4F8h with node id 1 is refused."""

    violates = ("COM-08", "COM-04", "COM-05")

    def decode(self, data: bytes) -> Parameters | None:
        """One too few at the other end."""
        return None if data[0] == 1 else super().decode(data)


FAULTS: tuple[type[Fault], ...] = (
    IgnoresRequestWithSyncTime,
    IgnoresLongRequest,
    TakesFiveBytes,
    TakesRemoteRequest,
    TakesExtendedRequest,
    SecondRequestChangesEcho,
    SecondRequestChangesMemory,
    TakesIdZero,
    TakesIdSixteen,
    TakesIdsAboveFifteen,
    RefusesIdFifteen,
    RefusesIdOne,
)
