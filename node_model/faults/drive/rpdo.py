"""Drives whose RPDOs take effect wrongly (SYN-01, C-RP)."""

from __future__ import annotations

from node_model.faults.parts import Fault
from node_model.frame import Frame
from node_model.node import Frames
from node_model.pdo import PdoService, Rpdo


class RpdoAtOnce(Fault, Rpdo):
    """A synchronous RPDO takes effect without waiting for the SYNC."""

    violates = ("SYN-01", "C-RP-02")

    def _take(self, data: bytes, now: int) -> None:
        self._apply(self._mapping.unpack(data), now)


class RpdoAlwaysWaits(Fault, Rpdo):
    """An event-driven RPDO waits for the next SYNC."""

    violates = ("C-RP-02",)

    def _take(self, data: bytes, now: int) -> None:
        self._pending = data


class RpdoOneSyncLate(Fault, Rpdo):
    """A synchronous RPDO takes effect with the SYNC after the next."""

    violates = ("SYN-01", "C-RP-02", "C-RP-04")

    older: bytes | None = None

    def on_sync(self, now: int) -> None:
        self.older, self._pending = self._pending, self.older
        super().on_sync(now)


class RpdoFirstWins(Fault, Rpdo):
    """Of several synchronous RPDOs before a SYNC the first one counts."""

    violates = ("C-RP-07", "SYN-01")

    def _take(self, data: bytes, now: int) -> None:
        if not self.is_synchronous() or self._pending is None:
            super()._take(data, now)


class RpdoTakenAgain(Fault, Rpdo):
    """A synchronous RPDO takes effect again with each SYNC until another one comes."""

    violates = ("SYN-01",)

    def on_sync(self, now: int) -> None:
        kept = self._pending
        super().on_sync(now)
        self._pending = kept


class RpdoTooShortIsTaken(Fault, Rpdo):
    """An RPDO with fewer bytes than are mapped takes effect, filled up with zeros."""

    violates = ("C-EM-18", "C-RP-04")

    def is_short(self, data: bytes) -> bool:
        return False


class RpdoTooShortIsSilent(Fault, Rpdo):
    """An RPDO with fewer bytes than are mapped causes no emergency."""

    violates = ("C-EM-18",)

    def on_data(self, data: bytes, window_open: bool, now: int) -> Frames:
        return () if self.is_short(data) else super().on_data(data, window_open, now)


class RpdoHighByteFirst(Fault, Rpdo):
    """The bytes of an RPDO are read from the end."""

    violates = ("C-RP-04", "SYN-01", "SYN-06")

    def _take(self, data: bytes, now: int) -> None:
        super()._take(data[: self._mapping.size][::-1], now)


class RpdoTypeOfTheStart(Fault, Rpdo):
    """A transmission type that is written in operational acts after the next start only."""

    violates = ("C-PC-12",)

    def _written(self, sub: int, now: int) -> None:
        kept = self._type
        super()._written(sub, now)
        self._type = kept


class RpdoAlsoFromRemoteFrames(Fault, PdoService):
    """A remote frame with the identifier of an RPDO counts as one full of zeros."""

    violates = ("C-RP-08",)

    def receive(self, frame: Frame, now: int) -> Frames:
        if frame.remote and any(r.parameters.can_id() == frame.can_id for r in self.rpdos):
            frame = Frame(frame.can_id, bytes(8))
        return super().receive(frame, now)


FAULTS: tuple[type[Fault], ...] = (
    RpdoAtOnce,
    RpdoAlwaysWaits,
    RpdoOneSyncLate,
    RpdoFirstWins,
    RpdoTakenAgain,
    RpdoTooShortIsTaken,
    RpdoTooShortIsSilent,
    RpdoHighByteFirst,
    RpdoTypeOfTheStart,
    RpdoAlsoFromRemoteFrames,
)
