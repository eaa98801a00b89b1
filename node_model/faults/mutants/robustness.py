"""Faults that foreign traffic brings out, and frames that nobody asked for (requirements ROB)."""

from __future__ import annotations

from abc import abstractmethod

from node_model.emcy import EMCY_BASE, emcy_frame
from node_model.faults.link import AsExtended, AsRemote, Corrupt, WrongLength, base_of
from node_model.faults.mutants.heartbeat import is_beat
from node_model.faults.parts import Fault
from node_model.frame import MAX_DATA_BYTES, Frame
from node_model.heartbeat import HEARTBEAT_BASE
from node_model.keypad import Keypad, Parameters
from node_model.keypad.commissioning import REQUEST_ID
from node_model.keypad.operation import Operation
from node_model.nmt import NmtCommand
from node_model.node import MS, NOTHING, Frames, S

_SDO_REQUEST_BASE = 0x600
SYNC_COB_ID = 0x080


class Open(Operation):
    """Looks at every frame on the bus."""

    def acceptance(self) -> frozenset[int] | None:
        """No filter."""
        return None

    def foreign(self, frame: Frame) -> bool:
        """Whether this frame is for others."""
        own = super().acceptance() or ()
        return frame.extended or frame.can_id not in own

    @abstractmethod
    def upset_by(self, frame: Frame) -> bool:
        """Whether a frame does harm."""

    def harm(self, now: int) -> Frames:
        """What it does."""
        return self.reset(NmtCommand.RESET_NODE, now)

    def receive(self, frame: Frame, now: int) -> Frames:
        """Harm, or the usual."""
        if self.boot_at is None and self.upset_by(frame):
            return self.harm(now)
        return super().receive(frame, now)


class ExtendedFrameRestarts(Open, Fault):
    """Any frame with a 29-bit identifier restarts the node."""

    violates = ("ROB-01", "NMT-05", "NMT-02", "NMT-07")

    def upset_by(self, frame: Frame) -> bool:
        """29 bits do not fit."""
        return frame.extended


class RemoteFrameRestarts(Open, Fault):
    """Any remote frame restarts the node."""

    violates = ("ROB-01", "NMT-05", "NMT-02", "HB-04", "ROB-02", "NMT-07")

    def upset_by(self, frame: Frame) -> bool:
        """Without data it trips."""
        return frame.remote


class LongDlcRestarts(Open, Fault):
    """A frame with a DLC above 8 restarts the node."""

    violates = ("ROB-01", "NMT-02")

    def upset_by(self, frame: Frame) -> bool:
        """More bytes than the buffer has."""
        return frame.dlc > MAX_DATA_BYTES


class EmptyFrameRestarts(Open, Fault):
    """A data frame without data restarts the node, unless it is SYNC."""

    violates = ("ROB-01", "LED-06", "NMT-02", "NMT-05", "NMT-07")

    def upset_by(self, frame: Frame) -> bool:
        """Its first byte is missed."""
        return not (frame.data or frame.remote or frame.can_id == SYNC_COB_ID)


class SdoRestarts(Open, Fault):
    """An SDO request to the node restarts it."""

    violates = ("ROB-01", "NMT-02")

    def upset_by(self, frame: Frame) -> bool:
        """A service that was never written."""
        mine = frame.can_id == _SDO_REQUEST_BASE + self.node_id
        return mine and not frame.extended and not frame.remote


class FloodRestarts(Open, Fault):
    """Every two-hundredth foreign frame restarts the node."""

    violates = ("ROB-01", "ROB-03", "NMT-02", "HB-04", "NMT-07")
    heard = 0

    def upset_by(self, frame: Frame) -> bool:
        """A counter runs over."""
        self.heard += self.foreign(frame)
        return self.foreign(frame) and self.heard % 200 == 0


class TrafficDelaysHeartbeat(Open, Fault):
    """Each foreign frame delays the next heartbeat by 1 ms."""

    violates = ("ROB-01", "HB-04", "HB-01", "ROB-03", "HB-06")

    def upset_by(self, frame: Frame) -> bool:
        """Whatever it need not care for."""
        return self.foreign(frame)

    def harm(self, now: int) -> Frames:  # noqa: ARG002  the seam's arguments
        """A millisecond lost in an interrupt."""
        if self.beat.due_at is not None:
            self.beat.due_at += MS
        return NOTHING


class TrafficStopsNmt(Open, Fault):
    """After a thousand foreign frames the node obeys NMT no more."""

    violates = ("ROB-01", "NMT-04", "NMT-07", "ROB-03")
    heard = 0

    def upset_by(self, frame: Frame) -> bool:
        """The queue is full for good."""
        self.heard += self.foreign(frame)
        return self.heard >= 1000 and frame.can_id == 0

    def harm(self, now: int) -> Frames:  # noqa: ARG002  the seam's arguments
        """Nobody empties it."""
        return NOTHING


class ForeignBootUpEndsOperational(Open, Fault):
    """The boot-up of another node leads back to pre-operational."""

    violates = ("ROB-01", "NMT-03", "HB-03", "NMT-07")

    def upset_by(self, frame: Frame) -> bool:
        """Any node's boot-up."""
        return base_of(frame) == HEARTBEAT_BASE and frame.data == b"\0"

    def harm(self, now: int) -> Frames:
        """As if commanded."""
        return self.obey(NmtCommand.PRE_OPERATIONAL, now)


class SyncStarts(Open, Fault):
    """SYNC makes the node operational."""

    violates = ("NMT-03", "ROB-01", "ROB-02", "KEY-07", "NMT-07")

    def upset_by(self, frame: Frame) -> bool:
        """SYNC."""
        return frame.can_id == SYNC_COB_ID and not frame.extended

    def harm(self, now: int) -> Frames:
        """As if commanded."""
        return self.obey(NmtCommand.START, now)


class TakesParametersInOperation(Keypad, Fault):
    """A 4F8h is stored in regular operation too."""

    violates = ("ROB-01", "NMT-02")

    def advance(self, now: int) -> Frames:
        """Storing takes its time; every frame is looked at."""
        frames = super().advance(now)
        if isinstance(self._mode, Operation):
            self.store.advance(now)
            self.listens_to = None
        return frames

    def receive(self, frame: Frame, now: int) -> Frames:
        """Store what looks like parameters."""
        taken = frame.can_id == REQUEST_ID and not frame.extended
        parameters = Parameters.decode(frame.data) if taken else None
        if parameters and isinstance(self._mode, Operation):
            self.store.save(parameters.encode(), now)
        return super().receive(frame, now)

    def deadline(self) -> int | None:
        """The next byte to store, too."""
        dues = (due for due in (super().deadline(), self.store.due_at) if due is not None)
        return min(dues, default=None)


# What nobody asked for.


class SendsUnlistedFrame(Operation, Fault):
    """With the third heartbeat a frame 5F0h is sent, once in a life."""

    violates = ("ROB-02",)
    sent = 0

    def beat_frames(self) -> Frames:
        """Left over from the developers."""
        self.sent += 1
        frames = super().beat_frames()
        return (*frames, Frame(0x5F0, b"\xde\xad")) if self.sent == 3 else frames


class SendsEmcyInOperation(Operation, Fault):
    """Entering operational is followed by an EMCY "no error"."""

    violates = ("ROB-02",)

    def entry_frames(self, now: int) -> Frames:
        """Error reset, though there was no error."""
        frames = super().entry_frames(now)
        return (*frames, emcy_frame(self.node_id, 0, 0))


class SendsHeartbeatOfNeighbour(Operation, Fault):
    """Each heartbeat is followed by one of the next higher node id."""

    violates = ("ROB-02",)

    def beat_frames(self) -> Frames:
        """It speaks for two."""
        frames = super().beat_frames()
        return (*frames, *(Frame(f.can_id + 1, f.data) for f in frames))


class RestartsEveryTwentySeconds(Operation, Fault):
    """A watchdog restarts the node every 20 s."""

    violates = ("NMT-02", "ROB-02", "HB-01", "HB-04", "NMT-03", "ROB-03", "HB-06", "NMT-07")
    bites_at: int | None = None

    def boot(self, now: int) -> Frames:
        """The watchdog starts with the node."""
        self.bites_at = now + 20 * S
        return super().boot(now)

    def deadline(self) -> int | None:
        """Its bite too."""
        due = super().deadline()
        bites_at = None if self.boot_at is not None else self.bites_at
        return bites_at if bites_at is not None and (due is None or bites_at < due) else due

    def fire(self, now: int) -> Frames:
        """Bite, or the usual."""
        if self.boot_at is None and now == self.bites_at:
            return self.reset(NmtCommand.RESET_NODE, now)
        return super().fire(now)


# Load.


class LosesKeysUnderLoad(Open, Fault):
    """A key change that matures within 1 ms of a foreign frame is not reported."""

    violates = ("ROB-03", "KEY-06", "ROB-01")
    busy_until = 0

    def upset_by(self, frame: Frame) -> bool:
        """Everything for others."""
        return self.foreign(frame)

    def harm(self, now: int) -> Frames:
        """Busy with the interrupt."""
        self.busy_until = now + MS
        return NOTHING

    def settle(self, now: int) -> Frames:
        """Lost while busy."""
        frames = super().settle(now)
        return NOTHING if now < self.busy_until else frames


class LosesHeartbeatsUnderLoad(Open, Fault):
    """A heartbeat that is due within 1 ms of a foreign frame is left out."""

    violates = ("ROB-03", "ROB-01", "HB-01", "HB-04", "HB-06")
    busy_until = 0

    def upset_by(self, frame: Frame) -> bool:
        """Everything for others."""
        return self.foreign(frame)

    def harm(self, now: int) -> Frames:
        """Busy with the interrupt."""
        self.busy_until = now + MS
        return NOTHING

    def fire(self, now: int) -> Frames:
        """What is due, without the heartbeat while busy."""
        frames = super().fire(now)
        busy = now < self.busy_until
        return [f for f in frames if not busy or base_of(f) != HEARTBEAT_BASE]


# Cable, connector, transceiver.


class HeartbeatsAreRemote(AsRemote, Fault):
    """Heartbeats are sent as remote frames."""

    violates = ("HB-01", "HB-02", "ROB-02", "HB-06")

    def picks(self, frame: Frame) -> bool:
        """Heartbeats, not boot-up."""
        return is_beat(frame)


class EverythingExtended(AsExtended, Fault):
    """All frames are sent with 29-bit identifiers."""

    violates = ("NMT-02", "HB-01", "KEY-01", "ROB-02", "COM-05", "HB-05", "COM-12", "COM-01")


class EverythingTooLong(WrongLength, Fault):
    """All frames have a byte too many, those of eight bytes one too few."""

    violates = ("ROB-02", "NMT-02", "HB-02", "KEY-03", "HB-05")


class StuckDataBit(Corrupt, Fault):
    """Bit 4 of the first byte is inverted in every frame but EMCY."""

    violates = ("HB-02", "KEY-03", "COM-05", "NMT-02", "HB-05")

    def picks(self, frame: Frame) -> bool:
        """All but EMCY."""
        return base_of(frame) != EMCY_BASE


FAULTS: tuple[type[Fault], ...] = (
    ExtendedFrameRestarts,
    RemoteFrameRestarts,
    LongDlcRestarts,
    EmptyFrameRestarts,
    SdoRestarts,
    FloodRestarts,
    TrafficDelaysHeartbeat,
    TrafficStopsNmt,
    ForeignBootUpEndsOperational,
    SyncStarts,
    TakesParametersInOperation,
    SendsUnlistedFrame,
    SendsEmcyInOperation,
    SendsHeartbeatOfNeighbour,
    RestartsEveryTwentySeconds,
    LosesKeysUnderLoad,
    LosesHeartbeatsUnderLoad,
    HeartbeatsAreRemote,
    EverythingExtended,
    EverythingTooLong,
    StuckDataBit,
)
