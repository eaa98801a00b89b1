"""Drives whose fault shows rarely, or at an edge: a node id, a start in three, a cut supply."""

from __future__ import annotations

from node_model.drive import Drive
from node_model.emcy import EmergencyProducer
from node_model.faults.parts import Fault
from node_model.frame import Frame
from node_model.heartbeat import HeartbeatService, heartbeat_frame
from node_model.nmt import NmtState
from node_model.node import MS, NOTHING, Frames
from node_model.nonvolatile import Content, NonVolatile, decode, encode
from node_model.sdo import Channel


class IsAnotherProduct(Fault, Drive):
    """Its product code is one more than its data sheet says."""

    violates = ("C-EDS-08",)

    def boot(self, now: int) -> Frames:
        self.od.put_number(0x1018, 2, self.od.number(0x1018, 2) + 1)
        return super().boot(now)


class TpdoOfTheFactoryNodeId(Fault, Drive):
    """The identifier of TPDO 1 is that of node 5, whatever node it is."""

    violates = ("C-PC-13", "C-EDS-09", "C-TP-01", "C-RB-01")

    def boot(self, now: int) -> Frames:
        if self.node_id != self.facts.node_id:
            shift = self.node_id - self.facts.node_id
            self.od.put_number(0x1800, 1, self.od.number(0x1800, 1) - shift)
        return super().boot(now)


class StructuresAreVariables(Fault, Channel):
    """Sub-index 255 of a record or an array tells that it is a variable."""

    violates = ("C-OD-15", "C-OD-08")

    def start_upload(self, data: bytes, now: int) -> Frames:
        if data[3] == 0xFF and self.od.has(data[1] | data[2] << 8, 1):
            return self.answer(b"\x43", data, 7)
        return super().start_upload(data, now)


class CompatibilityEntry(Fault, Channel):
    """TPDOs have a sub-index 4 that reads 0, and no data sheet lists it."""

    violates = ("C-TP-12", "C-OD-08")

    def start_upload(self, data: bytes, now: int) -> Frames:
        if data[2] == 0x18 and data[3] == 4 and self.od.has(data[1] | data[2] << 8, 1):
            return self.answer(b"\x4f", data, 0)
        return super().start_upload(data, now)


class SkipsOneBeatInEightHundred(Fault, HeartbeatService):
    """Every 800th heartbeat is left out."""

    violates = ("C-HB-12", "C-HB-04")

    count = 0

    def advance(self, now: int) -> Frames:
        frames = super().advance(now)
        self.count += len(frames)
        return NOTHING if frames and self.count % 800 == 0 else frames


class NewestEmergencyFirst(Fault, EmergencyProducer):
    """Of emergencies that an inhibit time holds back the newest is sent first."""

    violates = ("C-EM-16", "EM-07")

    def _tell(self, data: bytes, now: int) -> None:
        super()._tell(data, now)
        self._queue.rotate(1)


class TpdoOnceMore(Fault, Drive):
    """Some time after operational was left a TPDO is sent once more."""

    violates = ("C-TP-14", "C-TP-01", "SYN-07", "C-NMT-14", "C-NMT-16")

    _once_at: int | None = None

    def enter(self, state: NmtState, now: int) -> Frames:
        if self.state is NmtState.OPERATIONAL and state is not self.state:
            self._once_at = now + 100 * MS
        return super().enter(state, now)

    def _fall_silent(self) -> None:
        super()._fall_silent()
        self._once_at = None

    def _next(self) -> int:
        due = super()._next()
        return due if self._once_at is None else min(due, self._once_at)

    def _fire(self, now: int) -> Frames:
        said = super()._fire(now)
        if self._once_at is None or self._once_at > now:
            return said
        self._once_at = None
        return (*said, Frame(self.od.number(0x1800, 1) & 0x7FF, bytes(2)))


class ForgetsTheWindow(Fault, NonVolatile):
    """The synchronous window is left out when parameters are stored."""

    violates = ("C-SY-13", "C-ST-04")

    def saved(self, group: range) -> Content:
        return {key: value for key, value in super().saved(group).items() if key[0] != 0x1007}


class MixesWhenCut(Fault, NonVolatile):
    """A supply that fails while it stores leaves some values new and the others old."""

    violates = ("C-ST-07",)

    def stop(self) -> None:
        if self.store.due_at is not None:
            old, new = decode(self.store.load() or b""), self._content
            keys = {*old, *new}
            mixed = {key: new.get(key) if key[0] < 0x2000 else old.get(key) for key in keys}
            self.store.save(encode({k: v for k, v in mixed.items() if v is not None}), 0)
            self.store.finish()
        super().stop()


class DateOutlivesTheConfiguration(Fault, NonVolatile):
    """1020h is kept when a parameter is changed."""

    violates = ("C-ST-09",)

    def _configured(self, index: int, differs: bool) -> None:
        pass


class BackAfterOneSwitchDelay(Fault, Drive):
    """With a new bit timing it speaks again after the first delay already."""

    violates = ("C-LS-05",)

    def switch(self, bit_rate: int | None, delay_ns: int, now: int) -> None:
        super().switch(bit_rate, delay_ns // 2, now)


class EveryThirdStartHangs(Fault, Drive):
    """Every third time that its supply comes it takes 4 s to boot up."""

    violates = ("C-RB-07", "C-NMT-20", "C-NMT-01")

    starts = 0

    def start_ns(self) -> int:
        self.starts += 1
        return super().start_ns() if self.starts % 3 else 4000 * MS


class BootUpOfSixBits(Fault, Drive):
    """The boot-up carries six bits of the node id: under 127 it is that of node 63."""

    violates = ("C-RB-08", "C-NMT-01", "C-NMT-20", "C-NMT-02", "C-RB-01")

    def boot_frames(self) -> Frames:
        return (heartbeat_frame(self.node_id & 0x3F, NmtState.INITIALISING),)


FAULTS: tuple[type[Fault], ...] = (
    IsAnotherProduct,
    TpdoOfTheFactoryNodeId,
    StructuresAreVariables,
    CompatibilityEntry,
    SkipsOneBeatInEightHundred,
    NewestEmergencyFirst,
    TpdoOnceMore,
    ForgetsTheWindow,
    MixesWhenCut,
    DateOutlivesTheConfiguration,
    BackAfterOneSwitchDelay,
    EveryThirdStartHangs,
    BootUpOfSixBits,
)
