"""Answers to what nobody asked this node (requirement ROB-02)."""

from __future__ import annotations

from node_model.emcy import GENERIC_ERROR, HARDWARE_ERROR, emcy_frame
from node_model.faults.mutants.robustness import SYNC_COB_ID, Open
from node_model.faults.parts import Fault
from node_model.frame import Frame
from node_model.heartbeat import HEARTBEAT_BASE
from node_model.keypad.operation import KEY_BASE
from node_model.nmt import NmtState
from node_model.node import NOTHING, Frames

_LSS_MASTER, _LSS_SLAVE = 0x7E5, 0x7E4
_SWITCH_GLOBAL, _INQUIRE_NODE_ID, _IDENTIFY_UNCONFIGURED = 0x04, 0x5E, 0x4C


class AnswersGuarding(Open, Fault):
    """A remote frame 700h+X is answered with the state, as in node guarding."""

    violates = ("ROB-02", "HB-01", "HB-04", "ROB-01")

    def upset_by(self, frame: Frame) -> bool:
        """A guarding request."""
        asked = frame.remote and not frame.extended
        return asked and frame.can_id == HEARTBEAT_BASE + self.node_id

    def harm(self, now: int) -> Frames:  # noqa: ARG002  the seam's arguments
        """One more heartbeat."""
        return self.beat_frames()


class AnswersRemoteKeys(Open, Fault):
    """A remote frame 180h+X is answered with a key frame in every state."""

    violates = ("ROB-02", "KEY-06", "KEY-07", "ROB-01")

    def upset_by(self, frame: Frame) -> bool:
        """A request for the key frame."""
        return frame.remote and not frame.extended and frame.can_id == KEY_BASE + self.node_id

    def harm(self, now: int) -> Frames:
        """The state of the keys."""
        return super().entry_frames(now)


class SyncTellsKeys(Open, Fault):
    """In operational SYNC is answered with a key frame."""

    violates = ("ROB-02", "KEY-06")

    def upset_by(self, frame: Frame) -> bool:
        """SYNC."""
        return frame.can_id == SYNC_COB_ID and not frame.extended and not frame.remote

    def harm(self, now: int) -> Frames:
        """A PDO of transmission type 1."""
        return super().entry_frames(now) if self.state is NmtState.OPERATIONAL else NOTHING


class AnswersLssInquiry(Open, Fault):
    """An LSS master that asks a slave for its node id is answered with it."""

    violates = ("ROB-02",)
    asks = _INQUIRE_NODE_ID

    def upset_by(self, frame: Frame) -> bool:
        """The question, well-formed."""
        asked = frame.can_id == _LSS_MASTER and len(frame.data) == 8
        return asked and not frame.extended and frame.data[0] == self.asks

    def harm(self, now: int) -> Frames:  # noqa: ARG002  the seam's arguments
        """Though it was never told to configure itself."""
        return (Frame(_LSS_SLAVE, bytes((self.asks, self.node_id)) + bytes(6)),)


class AnswersLssIdentify(AnswersLssInquiry, Fault):
    """An LSS master that looks for slaves without configuration finds it."""

    violates = ("ROB-02",)
    asks = _IDENTIFY_UNCONFIGURED


class LssSwitchSendsEmcy(AnswersLssInquiry, Fault):
    """The LSS command "switch state global" is answered with an EMCY "hardware"."""

    violates = ("ROB-02",)
    asks = _SWITCH_GLOBAL

    def harm(self, now: int) -> Frames:  # noqa: ARG002  the seam's arguments
        """A service that it does not know."""
        return (emcy_frame(self.node_id, HARDWARE_ERROR, GENERIC_ERROR),)


FAULTS: tuple[type[Fault], ...] = (
    AnswersGuarding,
    AnswersRemoteKeys,
    SyncTellsKeys,
    AnswersLssInquiry,
    AnswersLssIdentify,
    LssSwitchSendsEmcy,
)
