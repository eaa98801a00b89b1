"""Drives whose SYNC or synchronous window is wrong (SYN-03, SYN-05, SYN-07, C-SY)."""

from __future__ import annotations

from collections import deque

from node_model.faults.link import Effect, Travel, base_of
from node_model.faults.parts import Fault
from node_model.frame import Frame
from node_model.nmt import NmtState
from node_model.node import MS, US, Frames
from node_model.pdo import PdoService, Rpdo
from node_model.sync import CYCLE_PERIOD, SYNC_COB_ID, SyncService

SDO_ANSWER = 0x580


class WindowOpenForSending(Fault, PdoService):
    """Synchronous TPDOs that miss the window are sent all the same."""

    violates = ("SYN-03",)

    def is_in_time(self, due: int) -> bool:
        return True


class WindowOpenForReceiving(Fault, Rpdo):
    """Synchronous RPDOs that miss the window are taken all the same."""

    violates = ("SYN-03",)

    def is_late(self, window_open: bool) -> bool:
        return False


class WindowForEventsToo(Fault, Rpdo):
    """Event-driven RPDOs that miss the window are ignored, too."""

    violates = ("SYN-03",)

    def is_late(self, window_open: bool) -> bool:
        return not window_open


class WindowInAnotherUnit(Fault, SyncService):
    """The unit of 1007h is a thousand times what the profile says, or a thousandth of it."""

    violates = ("SYN-05", "SYN-03")

    def window_ns(self) -> int:
        window = super().window_ns()
        return window * 1000 if self._window_unit_ns == US else window // 1000


class WindowOfZeroIsShut(Fault, SyncService):
    """With 1007h = 0 no synchronous PDO is in time."""

    violates = (
        "SYN-05",
        "SYN-01",
        "SYN-02",
        "SYN-06",
        "C-TP-03",
        "C-TP-04",
        "C-TP-11",
        "C-RP-02",
        "C-RP-04",
    )

    def is_open(self, now: int) -> bool:
        return self.window_ns() > 0 and super().is_open(now)


class WindowTwiceAsLong(Fault, SyncService):
    """The synchronous window is twice as long as 1007h says."""

    violates = ("SYN-03", "SYN-05")

    def window_ns(self) -> int:
        return super().window_ns() * 2


class WindowHalfAsLong(Fault, SyncService):
    """The synchronous window is half as long as 1007h says."""

    violates = ("SYN-03", "SYN-05")

    def window_ns(self) -> int:
        return super().window_ns() // 2


class SyncActsInPreOperational(Fault, PdoService):
    """Once it was operational PDOs are sent and taken in pre-operational, too."""

    violates = ("SYN-07", "C-NMT-14", "C-TP-01", "C-TP-14", "C-RP-03")

    def may_act(self) -> bool:
        return self.state in {NmtState.OPERATIONAL, NmtState.PRE_OPERATIONAL}


class SyncActsInStopped(Fault, SyncService):
    """SYNCs are produced in stopped, too."""

    violates = ("C-SY-09", "C-NMT-16")

    def may_act(self) -> bool:
        return True


class SyncOfAnyLength(Fault, SyncService):
    """A SYNC of any length is one."""

    violates = ("C-SY-10",)

    def fits(self, data: bytes) -> bool:
        return True


class SyncCounterFromZero(Fault, SyncService):
    """The counter of the SYNCs that it produces begins at 0."""

    violates = ("C-SY-04", "C-SY-09")

    def first_counter(self) -> int:
        return 0


class SyncCounterWrapsLate(Fault, SyncService):
    """The counter of the SYNCs goes one past what 1019h says."""

    violates = ("C-SY-04",)

    def next_counter(self) -> int:
        return self._counter % (self.overflow() + 1) + 1


class SyncCounterWrapsToZero(Fault, SyncService):
    """After its greatest value the counter of the SYNCs is 0."""

    violates = ("C-SY-04",)

    def next_counter(self) -> int:
        return (self._counter + 1) % (self.overflow() + 1)


class SyncCounterGoesOnAfterStopped(Fault, SyncService):
    """The counter of the SYNCs goes on after stopped."""

    violates = ("C-SY-09",)

    def first_counter(self) -> int:
        return max(self._counter, 1)


class SyncWithoutCounter(Fault, SyncService):
    """The SYNCs that it produces never have a counter."""

    violates = ("C-SY-03",)

    def _produce(self, due: int) -> Frames:
        return [
            type(frame)(frame.can_id, b"") if frame.can_id == self.can_id() else frame
            for frame in super()._produce(due)
        ]


class SyncTenPercentSlow(Fault, SyncService):
    """The period of the SYNCs that it produces is 10 % too long."""

    violates = ("C-SY-02",)

    def period_ns(self) -> int:
        return super().period_ns() * 11 // 10


class SyncPeriodInMilliseconds(Fault, SyncService):
    """1006h counts in milliseconds."""

    violates = ("C-SY-02", "C-SY-08")

    def period_ns(self) -> int:
        return super().period_ns() * 1000


class SyncStartsWithAReset(Fault, SyncService):
    """Setting bit 30 of 1005h has no effect until communication is reset."""

    violates = ("C-SY-08",)

    def _written(self, sub: int, now: int) -> None:
        if not (self.is_producer() and self.period_ns()):
            super()._written(sub, now)


class SyncCannotBeStopped(Fault, SyncService):
    """Neither 1006h = 0 nor bit 30 of 1005h = 0 ends the production of SYNCs."""

    violates = ("C-SY-08",)

    def _written(self, sub: int, now: int) -> None:
        if self.is_producer() and self.period_ns():
            self.last_ns = self.period_ns()
            super()._written(sub, now)

    def next_due(self, due: int) -> int:
        return due + (self.period_ns() or self.last_ns)


class SyncCounterLimitOfOne(Fault, SyncService):
    """1019h takes values that are reserved."""

    violates = ("C-SY-05",)

    def _guard_overflow(self, sub: int, data: bytes) -> None:
        if 2 <= data[0] <= 240:
            super()._guard_overflow(sub, data)


class SyncCounterChangesInUse(Fault, SyncService):
    """1019h can be written while there is a communication cycle."""

    violates = ("C-SY-06",)

    def _guard_overflow(self, sub: int, data: bytes) -> None:
        kept = self._od.number(CYCLE_PERIOD)
        self._od.put_number(CYCLE_PERIOD, 0, 0)
        try:
            super()._guard_overflow(sub, data)
        finally:
            self._od.put_number(CYCLE_PERIOD, 0, kept)


class SyncIdentifierChangesInUse(Fault, SyncService):
    """The identifier in 1005h can be changed while SYNCs are produced, and to any number."""

    violates = ("C-SY-07", "C-PC-02")

    def _guard_cob_id(self, sub: int, data: bytes) -> None:
        pass


class SdoStarvesUnderSync(Fault, Effect):
    """While SYNCs come every 25 ms or more often SDO requests are not answered."""

    violates = ("SYN-04", "C-OD-04", "C-SD-01")

    def __init__(self) -> None:
        self._syncs: deque[int] = deque(maxlen=4)

    def incoming(self, frame: Frame, now: int) -> Travel:
        if frame.can_id == SYNC_COB_ID:
            self._syncs.append(now)
        return super().incoming(frame, now)

    def picks(self, frame: Frame) -> bool:
        return base_of(frame) == SDO_ANSWER

    def change(self, frame: Frame, now: int) -> Travel:
        busy = len(self._syncs) == 4 and now - self._syncs[0] < 4 * 25 * MS
        return () if busy else super().change(frame, now)


FAULTS: tuple[type[Fault], ...] = (
    SdoStarvesUnderSync,
    WindowOpenForSending,
    WindowOpenForReceiving,
    WindowForEventsToo,
    WindowInAnotherUnit,
    WindowOfZeroIsShut,
    WindowTwiceAsLong,
    WindowHalfAsLong,
    SyncActsInPreOperational,
    SyncActsInStopped,
    SyncOfAnyLength,
    SyncCounterFromZero,
    SyncCounterWrapsLate,
    SyncCounterWrapsToZero,
    SyncCounterGoesOnAfterStopped,
    SyncWithoutCounter,
    SyncTenPercentSlow,
    SyncPeriodInMilliseconds,
    SyncStartsWithAReset,
    SyncCannotBeStopped,
    SyncCounterLimitOfOne,
    SyncCounterChangesInUse,
    SyncIdentifierChangesInUse,
)
