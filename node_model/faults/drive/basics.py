"""Drives that get plain things wrong: defaults, names, what a mapping says, who is spoken to."""

from __future__ import annotations

from node_model.drive import Drive
from node_model.faults.link import Delay
from node_model.faults.parts import Fault
from node_model.frame import Frame
from node_model.nmt import NMT_COB_ID, NmtCommand, NmtState
from node_model.node import MS, NOTHING, Frames
from node_model.od import AbortCode, SdoAbort
from node_model.pdo import Rpdo
from node_model.pdo.mapping import Mapping
from node_model.pdo.parameters import PdoParameters
from node_model.sdo import Channel

_MAPPINGS = frozenset({0x16, 0x1A})
"""High bytes of the indices of mapping parameters."""


class EmergencyInhibitIsNotTheDefault(Fault, Drive):
    """1015h is 100 us after a start, and 0 in its data sheet."""

    violates = ("C-OD-14",)

    def boot(self, now: int) -> Frames:
        self.od.put_number(0x1015, 0, 1)
        return super().boot(now)


class NameEndsALine(Fault, Drive):
    """The device name has a line feed in it."""

    violates = ("C-OD-18", "C-OD-14")

    def boot(self, now: int) -> Frames:
        self.od.put(0x1008, 0, b"nodeproof\ndrive")
        return super().boot(now)


class ReadsCommandsBeforeBootUp(Fault, Drive):
    """A command that comes while it starts is carried out after the boot-up."""

    violates = ("C-NMT-03", "C-NMT-01", "C-NMT-04")

    _early: NmtCommand | None = None

    def power_on(self, now: int) -> Frames:
        said = super().power_on(now)
        if self._boot_at is not None:
            self.bit_rate, self.listens_to = self._line_rate, frozenset({NMT_COB_ID})
        return said

    def receive(self, frame: Frame, now: int) -> Frames:
        if self.state is NmtState.INITIALISING and self._boot_at is not None:
            self._early = None if frame.extended or frame.can_id else self.command(frame)
        return super().receive(frame, now)

    def boot(self, now: int) -> Frames:
        said, early = super().boot(now), self._early
        self._early = None
        return said if early is None else (*said, *self.obey(early, now))


class HeartbeatTimeReadsSwapped(Fault, Channel):
    """A heartbeat time of 256 to 511 ms reads with its bytes swapped."""

    violates = ("C-HB-01",)

    def start_upload(self, data: bytes, now: int) -> Frames:
        if data[1:4] == b"\x17\x10\x00" and self.od.number(0x1017) >> 8 == 1:
            low = self.od.number(0x1017) & 0xFF
            return self.answer(b"\x4b", data, low << 8 | 1)
        return super().start_upload(data, now)


class HeartbeatTimeOutlivesAReset(Fault, Drive):
    """Reset node leaves 1017h as it was written."""

    violates = ("C-HB-11", "C-NMT-11", "C-ST-04")

    def reset(self, command: NmtCommand, now: int) -> Frames:
        written = self.od.number(0x1017)
        said = super().reset(command, now)
        if command is NmtCommand.RESET_NODE:
            self.od.put_number(0x1017, 0, written)
        return said


class SyncIdentifierShowsAReservedBit(Fault, Drive):
    """1005h reads with bit 28 set."""

    violates = ("C-SY-01", "C-OD-14", "C-OD-04")

    def boot(self, now: int) -> Frames:
        self.od.put_number(0x1005, 0, self.od.number(0x1005) | 1 << 28)
        return super().boot(now)


class TimeIdentifierShowsAReservedBit(Fault, Drive):
    """1012h reads with bit 28 set."""

    violates = ("C-TI-01", "C-OD-14", "C-OD-04")

    def boot(self, now: int) -> Frames:
        self.od.put_number(0x1012, 0, self.od.number(0x1012) | 1 << 28)
        return super().boot(now)


class RpdoOfTheNextNode(Fault, Drive):
    """The default identifier of RPDO 3 is that of the next node."""

    violates = ("C-RP-01", "C-OD-14", "C-EDS-09", "C-PC-13")

    def boot(self, now: int) -> Frames:
        self.od.put_number(0x1402, 1, self.od.number(0x1402, 1) & ~0x7F | self.node_id + 1)
        return super().boot(now)


class DummiesTakeNoRoom(Fault, Rpdo):
    """Dummy entries of an RPDO's mapping are passed over as if they had no bits."""

    violates = ("C-RP-06",)

    def begin(self) -> None:
        super().begin()
        self._mapping = Mapping(tuple(f for f in self._mapping.fields if f.entry is not None))


class MappingReadsWithoutLengths(Fault, Channel):
    """Entries of a mapping read without the length of their objects."""

    violates = ("C-PC-04", "C-PC-05", "C-OD-13", "C-OD-14")

    def start_upload(self, data: bytes, now: int) -> Frames:
        place = (data[1] | data[2] << 8, data[3])
        if data[2] in _MAPPINGS and data[3] and self.od.has(*place):
            return self.answer(b"\x43", data, self.od.number(*place) & ~0xFF)
        return super().start_upload(data, now)


class RefusalLocksTheMapping(Fault, PdoParameters):
    """After a wrong entry no step is taken until the identifier is written again."""

    violates = ("C-PC-09",)

    locked = False

    def check_cob_id(self, new: int) -> None:
        super().check_cob_id(new)
        self.locked = False

    def _guard_mapping(self, sub: int, data: bytes) -> None:
        if self.locked:
            raise SdoAbort(AbortCode.DEVICE_STATE)
        try:
            super()._guard_mapping(sub, data)
        except SdoAbort as abort:
            self.locked = abort.code is not AbortCode.ACCESS
            raise


class HasNoFourthTpdo(Fault, Channel):
    """TPDO 4, which its data sheet lists, does not exist."""

    violates = ("C-EDS-10", "C-OD-04", "C-OD-14", "C-EDS-09", "C-TP-01")

    def start_upload(self, data: bytes, now: int) -> Frames:
        if data[1:3] == b"\x03\x18":
            raise SdoAbort(AbortCode.NO_OBJECT)
        return super().start_upload(data, now)


class StoringIsConfirmedLate(Fault, Delay):
    """The answer to "save" comes a second late."""

    violates = ("C-ST-08",)

    span_ns = 1050 * MS

    def picks(self, frame: Frame) -> bool:
        return frame.can_id & 0x780 == 0x580 and frame.data[:3] == b"\x60\x10\x10"


class HearsEverything(Drive):
    """Its acceptance filter is open: it counts what is for others, and heirs stumble over it."""

    strangers = 0

    def _route(self) -> None:
        super()._route()
        self._own = self.listens_to or frozenset()
        self.listens_to = None if self.bit_rate else frozenset()

    def receive(self, frame: Frame, now: int) -> Frames:
        said = super().receive(frame, now)
        if not self.bit_rate or frame.can_id in self._own:
            return said
        return self._settle(said, now, now) if self.stumbles(frame) else said

    def stumbles(self, frame: Frame) -> bool:
        """Whether a frame for others moves the device."""
        self.strangers += 1
        return False


class StopsOnAStrangeFrame(Fault, HearsEverything):
    """A frame of 7C0h to 7DFh, which is for nobody, leads to stopped."""

    violates = ("C-RB-06",)

    def stumbles(self, frame: Frame) -> bool:
        if frame.can_id in range(0x7C0, 0x7E0):
            self._wanted = NmtState.STOPPED
        return self._wanted is not None


class LosesBeatsUnderLoad(Fault, HearsEverything):
    """A heartbeat is lost where more than fifty frames for others came since the last one."""

    violates = ("C-RB-05", "C-HB-04")

    def _fire(self, now: int) -> Frames:
        said = super()._fire(now)
        if not any(each.can_id == 0x700 + self.node_id for each in said):
            return said
        lost, self.strangers = self.strangers > 50, 0
        return NOTHING if lost else said


FAULTS: tuple[type[Fault], ...] = (
    EmergencyInhibitIsNotTheDefault,
    NameEndsALine,
    ReadsCommandsBeforeBootUp,
    HeartbeatTimeReadsSwapped,
    HeartbeatTimeOutlivesAReset,
    SyncIdentifierShowsAReservedBit,
    TimeIdentifierShowsAReservedBit,
    RpdoOfTheNextNode,
    DummiesTakeNoRoom,
    MappingReadsWithoutLengths,
    RefusalLocksTheMapping,
    HasNoFourthTpdo,
    StoringIsConfirmedLate,
    StopsOnAStrangeFrame,
    LosesBeatsUnderLoad,
)
