"""Drives that differ from ours and conform: what CiA 301 leaves to the maker."""

from __future__ import annotations

from collections.abc import Callable

from node_model.drive import Drive
from node_model.emcy import EmergencyProducer
from node_model.faults.link import Delay
from node_model.faults.parts import Deviation
from node_model.frame import Frame
from node_model.guarding import NodeGuarding
from node_model.heartbeat import HeartbeatService
from node_model.heartbeat_consumer import HeartbeatConsumer, Watch
from node_model.nmt import NmtCommand, NmtState
from node_model.node import MS, Frames
from node_model.od import AbortCode, SdoAbort
from node_model.pdo import PdoService, Tpdo
from node_model.pdo.parameters import PdoParameters
from node_model.sdo import Channel
from node_model.sdo.transfer import Upload
from node_model.sync import SyncService


class FirstBeatAtOnce(Deviation, HeartbeatService):
    """The first heartbeat comes as soon as 1017h is written, not one period later."""

    allowed_by = "C-HB-03"

    def _written(self, sub: int, now: int) -> None:
        super()._written(sub, now)
        if self._producer.due_at is not None:
            self._producer.due_at = now


class FirstBeatSoonAfterBootUp(Deviation, HeartbeatService):
    """The first heartbeat comes a millisecond after the boot-up."""

    allowed_by = "C-HB-13"

    def start(self, now: int) -> Frames:
        said = super().start(now)
        if self._producer.due_at is not None:
            self._producer.due_at = now + MS
        return said


class BeatsAtStateChanges(Deviation, HeartbeatService):
    """A change of the NMT state causes a heartbeat of its own, and a new phase."""

    allowed_by = "C-HB-08"

    def enter(self, state: NmtState, now: int) -> Frames:
        changed = state is not self.state
        super().enter(state, now)
        if not changed or not self.period_ns():
            return ()
        self._restart(now)
        return (self.beat(),)


class ClockOnePercentFast(Deviation, HeartbeatService):
    """Its clock is a little fast: heartbeats come 1 % early."""

    allowed_by = "C-HB-04"

    def period_ns(self) -> int:
        return super().period_ns() * 99 // 100


class TellsEachErrorThatGoes(Deviation, EmergencyProducer):
    """Each error that goes is told with 0000h and the bits that remain."""

    allowed_by = "EM-06"

    def tells_end(self, register: int) -> bool:
        return True


class TakesItsTimeForEmergencies(Deviation, Delay):
    """An emergency is sent 15 ms after its error."""

    allowed_by = "EM-01"

    span_ns = 15 * MS

    def picks(self, frame: Frame) -> bool:
        return 0x080 < frame.can_id < 0x100


class KeepsHeartbeatTimeOverResetCommunication(Deviation, Drive):
    """A reset communication leaves 1017h as it is."""

    allowed_by = "C-HB-11"

    def restored_by(self, command: NmtCommand) -> Callable[[int], bool]:
        concerned = super().restored_by(command)
        keeps = command is NmtCommand.RESET_COMMUNICATION
        return lambda index: concerned(index) and not (keeps and index == 0x1017)


class WantsNmtOfTwoBytes(Deviation, Drive):
    """An NMT frame of more than two bytes is ignored."""

    allowed_by = "C-NMT-09"

    def command(self, frame: Frame) -> NmtCommand | None:
        return super().command(frame) if len(frame.data) == 2 else None


class BootsInAlmostASecond(Deviation, Drive):
    """From power-on to the boot-up it takes 0.9 s."""

    allowed_by = "C-NMT-20"

    def start_ns(self) -> int:
        return 900 * MS


class RefusesUnsizedDownloads(Deviation, Channel):
    """An expedited download that does not tell its size is refused."""

    allowed_by = "C-SD-03"

    def unsized(self, index: int, sub: int, data: bytes) -> bytes:
        raise SdoAbort(AbortCode.LENGTH)


class FillsUpShortRequests(Deviation, Channel):
    """An SDO request with fewer than eight bytes is filled up with zeros."""

    allowed_by = "C-SD-18"

    def receive(self, frame: Frame, now: int) -> Frames:
        data = frame.data.ljust(8, b"\0") if frame.data else frame.data
        return super().receive(Frame(frame.can_id, data), now)


class EndsWithAnEmptySegment(Deviation, Upload):
    """An upload whose last segment is full goes on with an empty one."""

    allowed_by = "C-SD-04"

    def segment(self, data: bytes) -> bytes:
        answer = super().segment(data)
        if self.done and len(data) == 7:
            self.done = False
            return bytes((answer[0] & ~1,)) + answer[1:]
        return answer


class NeverGivesUpATransfer(Deviation, Channel):
    """There is no time-out of SDO transfers."""

    allowed_by = "C-SD-17"

    def _await(self, now: int) -> None:
        pass


class TakesTimeForSdoAnswers(Deviation, Delay):
    """An SDO answer takes 40 ms."""

    allowed_by = "C-SD-20"

    span_ns = 40 * MS

    def picks(self, frame: Frame) -> bool:
        return frame.can_id & 0x780 == 0x580


class CallsUnknownCommandsAGeneralError(Deviation, Channel):
    """An unknown command is refused with the code "general error"."""

    allowed_by = "C-SD-07"

    def unknown(self, data: bytes, now: int) -> Frames:
        return self.refuse(data[1:4], AbortCode.GENERAL)


class NoGuardingWithoutLifeTime(Deviation, NodeGuarding):
    """Polls are not answered while there is no life time."""

    allowed_by = "C-NG-12"

    def serves(self) -> bool:
        return super().serves() and self.life_ns() > 0


class NoEmergencyForSyncLength(Deviation, SyncService):
    """A SYNC of another length is ignored without an emergency."""

    allowed_by = "C-EM-20"

    def receive(self, frame: Frame, now: int) -> Frames:
        return super().receive(frame, now) if self.fits(frame.data) else ()


class BootUpIsAnEvent(Deviation, HeartbeatConsumer):
    """The boot-up of a watched node is a heartbeat event."""

    allowed_by = "C-HBC-07"

    def _heard(self, watch: Watch, data: int, now: int) -> Frames:
        said = super()._heard(watch, data, now)
        if data == 0 and watch.lapse_at is not None:
            watch.lapse_at = now
        return said


class NoEventPdoAtStart(Deviation, Tpdo):
    """Entering operational does not cause event-driven TPDOs."""

    allowed_by = "C-TP-07"

    def sends_first(self) -> bool:
        return False


class SlowToSendSynchronousPdos(Deviation, PdoService):
    """A synchronous TPDO is sent 0.7 ms later than by ours, inside its limit."""

    allowed_by = "SYN-02"

    def sample(self, counter: int | None, now: int) -> list[tuple[int, Frame]]:
        return [(due + 700_000, frame) for due, frame in super().sample(counter, now)]


class CallsMappingInUseAGeneralError(Deviation, PdoParameters):
    """A mapping written while its PDO is valid is refused with the code "general error"."""

    allowed_by = "C-PC-05"

    def _guard_mapping(self, sub: int, data: bytes) -> None:
        if self.is_valid():
            raise SdoAbort(AbortCode.GENERAL)
        super()._guard_mapping(sub, data)


class ForgetsErrorsInStopped(Deviation, EmergencyProducer):
    """An error that comes in stopped is never told."""

    allowed_by = "EM-08"

    def enter(self, state: NmtState, now: int) -> Frames:
        if self.state is NmtState.STOPPED:
            self._queue.clear()
        return super().enter(state, now)


class SamplesBeforeItTakesSetPoints(Deviation, PdoService):
    """With a SYNC TPDOs are sampled before the RPDOs have taken effect."""

    allowed_by = "SYN-01"

    def on_sync(self, counter: int | None, now: int) -> Frames:
        if not self.may_act():
            return ()
        self._waiting = self.sample(counter, now)
        self.take_received(now)
        return self._send_synchronous(now)


DEVIATIONS: tuple[type[Deviation], ...] = (
    FirstBeatAtOnce,
    FirstBeatSoonAfterBootUp,
    BeatsAtStateChanges,
    ClockOnePercentFast,
    TellsEachErrorThatGoes,
    TakesItsTimeForEmergencies,
    KeepsHeartbeatTimeOverResetCommunication,
    WantsNmtOfTwoBytes,
    BootsInAlmostASecond,
    RefusesUnsizedDownloads,
    FillsUpShortRequests,
    EndsWithAnEmptySegment,
    NeverGivesUpATransfer,
    TakesTimeForSdoAnswers,
    CallsUnknownCommandsAGeneralError,
    NoGuardingWithoutLifeTime,
    NoEmergencyForSyncLength,
    BootUpIsAnEvent,
    NoEventPdoAtStart,
    SlowToSendSynchronousPdos,
    CallsMappingInUseAGeneralError,
    ForgetsErrorsInStopped,
    SamplesBeforeItTakesSetPoints,
)
