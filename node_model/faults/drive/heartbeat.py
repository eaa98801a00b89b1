"""Drives whose heartbeat is wrong (C-HB, EC-03)."""

from __future__ import annotations

from node_model.faults.parts import Fault
from node_model.frame import Frame
from node_model.heartbeat import HeartbeatService
from node_model.nmt import NmtState
from node_model.node import Frames


class HeartbeatTimeNeedsAReset(Fault, HeartbeatService):
    """A value that is written to 1017h acts after the next reset only."""

    violates = ("EC-03", "C-HB-03", "C-HB-04", "C-HB-06", "MGR-04")

    def _written(self, sub: int, now: int) -> None:
        pass


class HeartbeatCannotBeSwitchedOff(Fault, HeartbeatService):
    """Writing 0 to 1017h does not end the heartbeat."""

    violates = ("C-HB-06",)

    def _written(self, sub: int, now: int) -> None:
        if self.period_ns():
            super()._written(sub, now)


class HeartbeatStaleBeat(Fault, HeartbeatService):
    """After 1017h was written the beat that was due before still comes."""

    violates = ("C-HB-09",)

    def _written(self, sub: int, now: int) -> None:
        due = self._producer.due_at
        super()._written(sub, now)
        if due is not None and self._producer.due_at is not None:
            self._producer.due_at = min(due, self._producer.due_at)


class HeartbeatFirstBeatLate(Fault, HeartbeatService):
    """The first heartbeat after a new 1017h comes after two periods."""

    violates = ("C-HB-03",)

    def _written(self, sub: int, now: int) -> None:
        super()._written(sub, now + self.period_ns())


class HeartbeatLateAfterBootUp(Fault, HeartbeatService):
    """The first heartbeat after the boot-up comes after two periods."""

    violates = ("C-HB-13",)

    def start(self, now: int) -> Frames:
        return super().start(now + self.period_ns())


class HeartbeatWithToggle(Fault, HeartbeatService):
    """Bit 7 of the heartbeat alternates."""

    violates = ("C-HB-02",)

    toggle = 0

    def beat(self) -> Frame:
        self.toggle ^= 0x80
        frame = super().beat()
        return Frame(frame.can_id, bytes((frame.data[0] | self.toggle,)))


class HeartbeatWithOldState(Fault, HeartbeatService):
    """The heartbeat shows pre-operational in every state."""

    violates = ("C-HB-02", "C-HB-08")

    def enter(self, state: NmtState, now: int) -> Frames:
        return super().enter(NmtState.PRE_OPERATIONAL, now)


class HeartbeatOfFourBytes(Fault, HeartbeatService):
    """The heartbeat has four bytes."""

    violates = ("C-HB-02", "C-RB-02")

    def beat(self) -> Frame:
        frame = super().beat()
        return Frame(frame.can_id, frame.data + bytes(3))


class HeartbeatSilentInStopped(Fault, HeartbeatService):
    """There is no heartbeat in stopped."""

    violates = ("C-HB-07", "C-HB-04", "C-HB-05")

    def advance(self, now: int) -> Frames:
        said = super().advance(now)
        return () if self.state is NmtState.STOPPED else said


class HeartbeatSixPercentSlow(Fault, HeartbeatService):
    """The heartbeat's period is 6 % too long."""

    violates = ("C-HB-04", "C-HB-05", "C-HB-03", "C-HB-12", "C-HB-13")

    def period_ns(self) -> int:
        return super().period_ns() * 106 // 100


class HeartbeatSixPercentFast(Fault, HeartbeatService):
    """The heartbeat's period is 6 % too short."""

    violates = ("C-HB-04", "C-HB-05", "C-HB-09", "C-HB-12")

    def period_ns(self) -> int:
        return super().period_ns() * 94 // 100


class HeartbeatTimeOfOneByte(Fault, HeartbeatService):
    """Only the low byte of 1017h counts."""

    violates = ("C-HB-05", "C-HB-04")

    def period_ns(self) -> int:
        return super().period_ns() % 256_000_000


FAULTS: tuple[type[Fault], ...] = (
    HeartbeatTimeNeedsAReset,
    HeartbeatCannotBeSwitchedOff,
    HeartbeatStaleBeat,
    HeartbeatFirstBeatLate,
    HeartbeatLateAfterBootUp,
    HeartbeatWithToggle,
    HeartbeatWithOldState,
    HeartbeatOfFourBytes,
    HeartbeatSilentInStopped,
    HeartbeatSixPercentSlow,
    HeartbeatSixPercentFast,
    HeartbeatTimeOfOneByte,
)
