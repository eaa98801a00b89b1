"""Faults of the way into commissioning and of the wait (COM-01..03, COM-20, COM-27..29)."""

from __future__ import annotations

from abc import abstractmethod

from node_model.faults.link import base_of
from node_model.faults.parts import Fault
from node_model.frame import Frame
from node_model.heartbeat import heartbeat_frame
from node_model.keypad import Keypad, Parameters
from node_model.keypad.commissioning import ECHO_ID, REQUEST_ID, Commissioning
from node_model.keypad.operation import KEY_BASE
from node_model.keypad.parameters import SIZE
from node_model.nmt import ALL_NODES, NMT_COB_ID, NmtCommand, NmtState, command_for
from node_model.node import MS, NOTHING, Frames
from node_model.storage import RecordStore

_SYNC_COB_ID = 0x080
_SDO_REQUEST_BASE = 0x600
_SDO_ANSWER_BASE = 0x580
_LSS_REQUEST_ID = 0x7E5
_LSS_ANSWER_ID = 0x7E4
_ABORT_GENERAL = b"\x80\x00\x00\x00\x00\x00\x00\x08"


# The way into commissioning.


class NeverCommissions(Keypad, Fault):
    """Held commissioning keys are overlooked: the start is regular."""

    violates = ("COM-01", "COM-04", "COM-05", "COM-02", "COM-12")

    def wants_commissioning(self) -> bool:
        """Never."""
        return False


class CommissionsWithOneKey(Keypad, Fault):
    """One of the two commissioning keys is enough."""

    violates = ("COM-27", "NMT-02")

    def wants_commissioning(self) -> bool:
        """Any of them."""
        return bool(self._held & self.profile.commissioning_keys)


class CommissionsWithAnyTwoKeys(Keypad, Fault):
    """Any two keys start commissioning."""

    violates = ("COM-27",)

    def wants_commissioning(self) -> bool:
        """It only counts."""
        return len(self._held) == len(self.profile.commissioning_keys)


# What it does while it waits.


class BootUpWhileWaiting(Commissioning, Fault):
    """The wait for parameters begins with a boot-up."""

    violates = ("COM-01",)
    announced = False

    def advance(self, now: int) -> Frames:
        """Boot-up of node 1 at the first opportunity."""
        frames = super().advance(now)
        if self.announced:
            return frames
        self.announced = True
        return (heartbeat_frame(1, NmtState.INITIALISING), *frames)


class HeartbeatsWhileWaiting(Commissioning, Fault):
    """There is a heartbeat every second in commissioning."""

    violates = ("COM-01", "COM-12")
    beats = 0

    def advance(self, now: int) -> Frames:
        """A beat on the whole seconds since the start; late calls may find several."""
        frames: list[Frame] = []
        while (due := self._beat_at()) <= now:
            self.beats += 1
            frames += super().advance(due)
            frames.append(heartbeat_frame(1, NmtState.PRE_OPERATIONAL))
        return [*frames, *super().advance(now)]

    def deadline(self) -> int | None:
        """The next beat, if nothing else comes first."""
        due = super().deadline()
        return self._beat_at() if due is None else min(due, self._beat_at())

    def _beat_at(self) -> int:
        return self.since + (self.beats + 1) * 1000 * MS


class WaitsAtStoredRate(Commissioning, Fault):
    """Commissioning runs at the stored bit rate."""

    violates = ("COM-02",)

    def __init__(self, store: RecordStore, now: int) -> None:
        super().__init__(store, now)
        stored = Parameters.decode(store.load() or b"") or Parameters()
        self.bit_rate = stored.bit_rate


class EchoesAtNewRate(Commissioning, Fault):
    """The echo is sent at the bit rate that was just received."""

    violates = ("COM-02", "COM-04")

    def echo_frame(self, parameters: Parameters) -> Frame:
        """Switch too early."""
        self.bit_rate = parameters.bit_rate
        return super().echo_frame(parameters)


class ReportsKeysWhileWaiting(Commissioning, Fault):
    """Keys are reported during the wait for parameters."""

    violates = ("COM-03", "COM-01")

    def hold(self, mask: int, now: int) -> Frames:  # noqa: ARG002  the seam's arguments
        """A key frame of node 1."""
        return NOTHING if self.echo else (Frame(KEY_BASE + 1, bytes((mask & 0xFF,))),)


class TakesAnyPdo(Commissioning, Fault):
    """Any PDO of six bytes is taken for the parameters."""

    violates = ("COM-03", "COM-01")
    listens_to = None

    def accepts(self, frame: Frame) -> bool:
        """The identifier is not looked at."""
        pdo = 0x180 <= frame.can_id < 0x580 and not frame.extended
        return pdo and len(frame.data) >= SIZE


class TakesParametersOverSdo(Commissioning, Fault):
    """An SDO request with sensible bytes is taken for the parameters."""

    violates = ("COM-03", "COM-01")
    listens_to = None

    def accepts(self, frame: Frame) -> bool:
        """Requests to any node."""
        request = base_of(frame) == _SDO_REQUEST_BASE and len(frame.data) >= SIZE
        return (request and not frame.extended) or super().accepts(frame)


class AnswersSdoWhileWaiting(Commissioning, Fault):
    """SDO requests are answered with an abort in commissioning."""

    violates = ("COM-03", "COM-01", "COM-12")
    listens_to = None

    def receive(self, frame: Frame, now: int) -> Frames:
        """Abort, whoever was asked."""
        if base_of(frame) == _SDO_REQUEST_BASE and not frame.extended:
            return (Frame(_SDO_ANSWER_BASE + (frame.can_id & 0x7F), _ABORT_GENERAL),)
        return super().receive(frame, now)


class ErasesWhileWaiting(Commissioning, Fault):
    """The stored parameters are erased when the wait begins."""

    violates = ("COM-29", "COM-26")

    def __init__(self, store: RecordStore, now: int) -> None:
        super().__init__(store, now)
        store.memory[:] = bytes(len(store.memory))


# The services that mean nothing in commissioning.


class NmtStopsEcho(Commissioning, Fault):
    """NMT stop ends the echo."""

    violates = ("COM-20", "COM-05")
    listens_to = frozenset((REQUEST_ID, NMT_COB_ID))

    def receive(self, frame: Frame, now: int) -> Frames:
        """Quiet, as any stopped node."""
        if command_for(frame, ALL_NODES) is NmtCommand.STOP:
            self.echo_at = None
        return super().receive(frame, now)


class NmtResetEndsWait(Commissioning, Fault):
    """NMT reset node makes the waiting node send a boot-up."""

    violates = ("COM-20", "COM-01", "COM-12")
    listens_to = frozenset((REQUEST_ID, NMT_COB_ID))

    def receive(self, frame: Frame, now: int) -> Frames:
        """Boot-up, then it goes on waiting."""
        if command_for(frame, ALL_NODES) is NmtCommand.RESET_NODE:
            return (heartbeat_frame(1, NmtState.INITIALISING),)
        return super().receive(frame, now)


class _EchoesOn(Commissioning):
    """Another frame makes it send an echo out of turn."""

    listens_to = None

    @abstractmethod
    def provokes(self, frame: Frame) -> bool:
        """Whether it is such a frame."""

    def receive(self, frame: Frame, now: int) -> Frames:
        """The echo that there is, or an empty one."""
        if self.provokes(frame):
            return (self.echo or Frame(ECHO_ID, bytes(SIZE)),)
        return super().receive(frame, now)


class EchoesOnSync(_EchoesOn, Fault):
    """SYNC makes the node send an echo, even while it waits."""

    violates = ("COM-20", "COM-01", "COM-05")

    def provokes(self, frame: Frame) -> bool:
        """SYNC."""
        return frame.can_id == _SYNC_COB_ID and not frame.extended and not frame.remote


class EchoesOnRemote(_EchoesOn, Fault):
    """A remote frame 3F8h is answered with an echo, even while it waits."""

    violates = ("COM-20", "COM-01", "COM-05")

    def provokes(self, frame: Frame) -> bool:
        """A request for the echo."""
        return frame.can_id == ECHO_ID and frame.remote and not frame.extended


class AnswersLss(Commissioning, Fault):
    """LSS identify is answered in commissioning."""

    violates = ("COM-20", "COM-01", "COM-12")
    listens_to = frozenset((REQUEST_ID, _LSS_REQUEST_ID))

    def receive(self, frame: Frame, now: int) -> Frames:
        """Identify non-configured slave: here I am (CiA 305, 50h)."""
        if frame.can_id == _LSS_REQUEST_ID and not frame.extended and not frame.remote:
            return (Frame(_LSS_ANSWER_ID, b"\x50" + bytes(7)),)
        return super().receive(frame, now)


FAULTS: tuple[type[Fault], ...] = (
    NeverCommissions,
    CommissionsWithOneKey,
    CommissionsWithAnyTwoKeys,
    BootUpWhileWaiting,
    HeartbeatsWhileWaiting,
    WaitsAtStoredRate,
    EchoesAtNewRate,
    ReportsKeysWhileWaiting,
    TakesAnyPdo,
    TakesParametersOverSdo,
    AnswersSdoWhileWaiting,
    ErasesWhileWaiting,
    NmtStopsEcho,
    NmtResetEndsWait,
    EchoesOnSync,
    EchoesOnRemote,
    AnswersLss,
)
