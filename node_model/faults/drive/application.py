"""Drives whose axis or whose time-keeping is wrong."""

from __future__ import annotations

from node_model.drive import Axis
from node_model.faults.link import Drop
from node_model.faults.parts import Fault
from node_model.frame import Frame
from node_model.time_of_day import TimeOfDay


class AxisDoesNotMove(Fault, Axis):
    """The actual position never changes."""

    violates = ("SYN-01",)

    def position(self, now: int) -> int:
        return self._from


class LosesEverySeventhSynchronousPdo(Fault, Drop):
    """Every seventh TPDO is lost on the way to the wire."""

    violates = ("SYN-02", "C-TP-04", "SYN-06", "C-TP-08", "C-TP-16")

    def picks(self, frame: Frame) -> bool:
        return frame.can_id & 0x780 == 0x180


class TimeIdentifierIsNotChecked(Fault, TimeOfDay):
    """1012h takes any identifier."""

    violates = ("C-PC-02",)

    def _guard(self, sub: int, data: bytes) -> None:
        pass


FAULTS: tuple[type[Fault], ...] = (
    AxisDoesNotMove,
    LosesEverySeventhSynchronousPdo,
    TimeIdentifierIsNotChecked,
)
