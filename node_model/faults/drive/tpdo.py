"""Drives whose TPDOs come at the wrong time or carry the wrong values (SYN-06, C-TP)."""

from __future__ import annotations

from node_model.faults.parts import Fault
from node_model.frame import Frame
from node_model.node import MS, US
from node_model.pdo import PdoService, Tpdo
from node_model.pdo.parameters import EVENTS


class TpdoOfTheLastSync(Fault, Tpdo):
    """A synchronous TPDO carries the values of the SYNC before."""

    violates = ("SYN-01", "C-TP-03")

    before: bytes | None = None

    def on_sync(self, counter: int | None) -> bytes | None:
        now = super().on_sync(counter)
        if now is None:
            return None
        now, self.before = self.before or now, now
        return now


class TpdoLongAfterSync(Fault, PdoService):
    """A synchronous TPDO is sent 4 ms after the SYNC."""

    violates = ("SYN-02", "C-TP-04")

    def sample(self, counter: int | None, now: int) -> list[tuple[int, Frame]]:
        return [(due + 4 * MS, frame) for due, frame in super().sample(counter, now)]


class TpdoEverySyncButOne(Fault, Tpdo):
    """With transmission type n a TPDO comes every n+1 SYNCs."""

    violates = ("SYN-06", "C-TP-04", "SYN-02")

    def counts(self, counter: int | None) -> bool:
        self._count = (self._count + 1) % (self._type + 1)
        return self._count == 0


class TpdoWithEverySync(Fault, Tpdo):
    """With transmission types 1 to 240 a TPDO comes with every SYNC."""

    violates = ("SYN-06", "C-TP-04")

    def counts(self, counter: int | None) -> bool:
        return True


class TpdoTypeZeroWithEverySync(Fault, Tpdo):
    """With transmission type 0 a TPDO comes with every SYNC."""

    violates = ("SYN-06", "C-TP-05")

    def is_due_at(self, counter: int | None) -> bool:
        return self._type == 0 or super().is_due_at(counter)


class TpdoTypeZeroNever(Fault, Tpdo):
    """With transmission type 0 a TPDO never comes."""

    violates = ("SYN-06", "C-TP-05")

    def is_due_at(self, counter: int | None) -> bool:
        return self._type != 0 and super().is_due_at(counter)


class TpdoTypeZeroAtOnce(Fault, Tpdo):
    """With transmission type 0 a TPDO comes with the event and not with the SYNC."""

    violates = ("SYN-06", "C-TP-05")

    def on_change(self, key: tuple[int, int], now: int) -> None:
        super().on_change(key, now)
        if self.active and self._type == 0 and self._changed:
            self._changed = False
            self._ask(now)


class TpdoNoEvents(Fault, Tpdo):
    """A change of a mapped object does not cause an event-driven TPDO."""

    violates = ("SYN-06",)

    def on_change(self, key: tuple[int, int], now: int) -> None:
        if self._type not in EVENTS:
            super().on_change(key, now)


class TpdoInhibitIsIgnored(Fault, Tpdo):
    """Event-driven TPDOs do not keep the inhibit time."""

    violates = ("SYN-06", "C-TP-09")

    def free_at(self) -> int:
        return 0


class TpdoInhibitTooShort(Fault, Tpdo):
    """The inhibit time of event-driven TPDOs counts in steps of 10 us."""

    violates = ("SYN-06", "C-TP-09")

    def free_at(self) -> int:
        steps = self.parameters.inhibit_ns() // (100 * US)
        return 0 if self._sent_at is None else self._sent_at + steps * 10 * US


class TpdoWithoutEventTimer(Fault, Tpdo):
    """The event timer does nothing."""

    violates = ("SYN-06", "C-TP-08")

    def _arm(self, now: int) -> None:
        pass


class TpdoEventTimerNotRestarted(Fault, Tpdo):
    """A TPDO that an event causes does not restart the event timer."""

    violates = ("C-TP-08", "SYN-06")

    def _arm(self, now: int) -> None:
        if self._timer_at is None or self._timer_at <= now:
            super()._arm(now)


class TpdoEventTimerSlow(Fault, Tpdo):
    """The event timer takes half as long again as it should."""

    violates = ("C-TP-08", "SYN-06")

    def _arm(self, now: int) -> None:
        super()._arm(now)
        if self._timer_at is not None:
            self._timer_at += (self._timer_at - now) // 2


class TpdoAnswersForbiddenRemote(Fault, Tpdo):
    """A remote frame is answered although bit 30 of the COB-ID forbids it."""

    violates = ("C-TP-13",)

    def answers_remote(self) -> bool:
        return True


class TpdoIgnoresRemote(Fault, Tpdo):
    """Remote frames are not answered."""

    violates = ("C-TP-13", "SYN-06")

    def answers_remote(self) -> bool:
        return False


class TpdoHighByteFirst(Fault, Tpdo):
    """The bytes of a TPDO stand in reverse."""

    violates = ("C-TP-02", "C-TP-03")

    def frame(self, data: bytes) -> Frame:
        return super().frame(data[::-1])


class TpdoAlwaysEightBytes(Fault, Tpdo):
    """A TPDO is filled up to eight bytes."""

    violates = ("C-TP-02", "C-RB-02")

    def frame(self, data: bytes) -> Frame:
        return super().frame(data.ljust(8, b"\0"))


class TpdoKeepsFirstValue(Fault, Tpdo):
    """While the inhibit time lasts the first new value is kept, and the last one is lost."""

    violates = ("C-TP-03", "C-TP-16")

    kept: bytes | None = None

    def _ask(self, now: int) -> None:
        self.kept = self.kept or self._mapping.pack()
        super()._ask(now)

    def _send(self, now: int) -> Frame:
        frame, self.kept = self.frame(self.kept or self._mapping.pack()), None
        super()._send(now)
        return frame


class TpdoStartValueIgnored(Fault, Tpdo):
    """A SYNC start value does not matter."""

    violates = ("C-TP-11", "SYN-06")

    def counts(self, counter: int | None) -> bool:
        self._waits = False
        return super().counts(counter)


class TpdoLivesWithoutBeingValid(Fault, Tpdo):
    """A TPDO is sent although bit 31 of its COB-ID is set."""

    violates = ("C-TP-01",)

    def begin(self, now: int) -> None:
        super().begin(now)
        self.active = self._mapping.size > 0


FAULTS: tuple[type[Fault], ...] = (
    TpdoOfTheLastSync,
    TpdoLongAfterSync,
    TpdoEverySyncButOne,
    TpdoWithEverySync,
    TpdoTypeZeroWithEverySync,
    TpdoTypeZeroNever,
    TpdoTypeZeroAtOnce,
    TpdoNoEvents,
    TpdoInhibitIsIgnored,
    TpdoInhibitTooShort,
    TpdoWithoutEventTimer,
    TpdoEventTimerNotRestarted,
    TpdoEventTimerSlow,
    TpdoAnswersForbiddenRemote,
    TpdoIgnoresRemote,
    TpdoHighByteFirst,
    TpdoAlwaysEightBytes,
    TpdoKeepsFirstValue,
    TpdoStartValueIgnored,
    TpdoLivesWithoutBeingValid,
)
