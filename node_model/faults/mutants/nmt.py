"""Faults in obeying NMT commands (requirements NMT-04..07)."""

from __future__ import annotations

from abc import abstractmethod

from node_model.faults.link import Slow
from node_model.faults.parts import Fault
from node_model.frame import Frame
from node_model.keypad.operation import Operation
from node_model.nmt import ALL_NODES, NmtCommand, NmtState, command_for
from node_model.node import MS, NOTHING, Frames


class Deaf(Operation):
    """Does not obey one command, in one state or in all."""

    ignores: NmtCommand
    only_in: NmtState | None = None

    def command(self, frame: Frame) -> NmtCommand | None:
        """None where it is that command."""
        found = super().command(frame)
        here = self.only_in is None or self.state is self.only_in
        return None if found is self.ignores and here else found


class IgnoresStart(Deaf, Fault):
    """Start (01h) is ignored."""

    violates = ("NMT-04", "NMT-07", "NMT-03", "KEY-01", "HB-03", "KEY-22")
    ignores = NmtCommand.START


class IgnoresStartWhenStopped(Deaf, Fault):
    """Start (01h) is ignored in stopped."""

    violates = ("NMT-04", "NMT-07", "HB-03", "KEY-01")
    ignores = NmtCommand.START
    only_in = NmtState.STOPPED


class IgnoresStop(Deaf, Fault):
    """Stop (02h) is ignored."""

    violates = ("NMT-04", "NMT-07", "HB-03", "KEY-07", "KEY-01")
    ignores = NmtCommand.STOP


class IgnoresStopWhenPreOperational(Deaf, Fault):
    """Stop (02h) is ignored in pre-operational."""

    violates = ("NMT-04", "NMT-07", "HB-03")
    ignores = NmtCommand.STOP
    only_in = NmtState.PRE_OPERATIONAL


class IgnoresPreOperational(Deaf, Fault):
    """Enter pre-operational (80h) is ignored."""

    violates = ("NMT-04", "NMT-07", "KEY-01", "KEY-07")
    ignores = NmtCommand.PRE_OPERATIONAL


class IgnoresResetNode(Deaf, Fault):
    """Reset node (81h) is ignored."""

    violates = ("NMT-04", "NMT-06", "NMT-07", "HB-05", "KEY-07")
    ignores = NmtCommand.RESET_NODE


class IgnoresResetNodeWhenStopped(Deaf, Fault):
    """Reset node (81h) is ignored in stopped."""

    violates = ("NMT-04", "NMT-06", "NMT-07")
    ignores = NmtCommand.RESET_NODE
    only_in = NmtState.STOPPED


class IgnoresResetCommunication(Deaf, Fault):
    """Reset communication (82h) is ignored."""

    violates = ("NMT-04", "NMT-06", "NMT-07", "HB-05", "KEY-07")
    ignores = NmtCommand.RESET_COMMUNICATION


class _Misled(Operation):
    """One command leads to the wrong state."""

    mistakes: NmtCommand
    leads_to: NmtState

    def target(self, command: NmtCommand) -> NmtState:
        """The wrong one for that command."""
        return self.leads_to if command is self.mistakes else super().target(command)


class StopLeadsToPreOperational(_Misled, Fault):
    """Stop (02h) leads to pre-operational."""

    violates = ("NMT-04", "NMT-07", "HB-03")
    mistakes = NmtCommand.STOP
    leads_to = NmtState.PRE_OPERATIONAL


class PreOperationalLeadsToStopped(_Misled, Fault):
    """Enter pre-operational (80h) leads to stopped."""

    violates = ("NMT-04", "NMT-07")
    mistakes = NmtCommand.PRE_OPERATIONAL
    leads_to = NmtState.STOPPED


class ResetNodeWithoutBootUp(_Misled, Fault):
    """Reset node (81h) only leads to pre-operational."""

    violates = ("NMT-06", "NMT-02", "NMT-04", "LED-21", "HB-05", "NMT-07")
    mistakes = NmtCommand.RESET_NODE
    leads_to = NmtState.PRE_OPERATIONAL


class ResetCommunicationWithoutBootUp(_Misled, Fault):
    """Reset communication (82h) only leads to pre-operational."""

    violates = ("NMT-06", "NMT-04", "LED-21", "HB-05", "NMT-07")
    mistakes = NmtCommand.RESET_COMMUNICATION
    leads_to = NmtState.PRE_OPERATIONAL


class ResetLosesParameters(Operation, Fault):
    """After an NMT reset the node works with the factory's times and bit rate."""

    violates = ("NMT-06", "HB-01", "HB-05", "HB-06")

    def reset(self, command: NmtCommand, now: int) -> Frames:
        """Initialise with what the factory set."""
        self.parameters = self.profile.factory
        self.beat = self.heartbeat_type(self.heartbeat_ns())
        return super().reset(command, now)


class _Addressed(Operation):
    """Takes NMT frames for other addresses than it should."""

    @abstractmethod
    def address(self, frame: Frame) -> int:
        """The id for which the frame is read."""

    def command(self, frame: Frame) -> NmtCommand | None:
        """The command in the frame, read for that id."""
        return command_for(frame, self.address(frame))


class IgnoresBroadcast(Operation, Fault):
    """NMT commands to all nodes (id 0) are ignored."""

    violates = ("NMT-04", "NMT-07", "NMT-06", "KEY-01", "KEY-07")

    def command(self, frame: Frame) -> NmtCommand | None:
        """Only what names it."""
        broadcast = len(frame.data) > 1 and frame.data[1] == ALL_NODES
        return None if broadcast else super().command(frame)


class ObeysOnlyBroadcast(_Addressed, Fault):
    """NMT commands to the node's own id are ignored."""

    violates = ("NMT-04", "NMT-07", "HB-03", "NMT-06", "HB-05", "KEY-01", "KEY-22")

    def address(self, frame: Frame) -> int:  # noqa: ARG002  the seam's arguments
        """Nobody but all."""
        return ALL_NODES


class ObeysEveryNodeId(_Addressed, Fault):
    """NMT commands are obeyed whatever node they address."""

    violates = ("NMT-05", "NMT-07", "KEY-07", "NMT-02", "NMT-03")

    def address(self, frame: Frame) -> int:
        """Every id is its own."""
        return frame.data[1] if len(frame.data) > 1 else self.node_id


class ObeysItsNeighbour(_Addressed, Fault):
    """NMT commands to the next higher node id are obeyed too."""

    violates = ("NMT-05", "NMT-07", "KEY-07", "NMT-02", "NMT-03")

    def address(self, frame: Frame) -> int:
        """One more than its own counts as its own."""
        one_more = self.node_id + 1
        return one_more if frame.data[1:2] == bytes((one_more,)) else self.node_id


class ComparesFourBitsOfNodeId(_Addressed, Fault):
    """Of the node id in an NMT command only the lowest four bits are compared."""

    violates = ("NMT-05", "NMT-07", "KEY-07", "NMT-02")

    def address(self, frame: Frame) -> int:
        """Its own with any upper half."""
        asked = frame.data[1] if len(frame.data) > 1 else 0
        return asked if asked & 0x0F == self.node_id else self.node_id


class ObeysUnknownCommands(Operation, Fault):
    """Of an NMT command only bits 7, 1 and 0 are decoded: 05h starts the node too."""

    violates = ("NMT-05", "KEY-07", "NMT-02", "NMT-07")

    def command(self, frame: Frame) -> NmtCommand | None:
        """The command with the other bits cleared."""
        if frame.data and not frame.remote:
            masked = bytes((frame.data[0] & 0x83, *frame.data[1:]))
            frame = Frame(frame.can_id, masked, extended=frame.extended)
        return super().command(frame)


class ObeysRemoteFrames(Operation, Fault):
    """A remote frame with identifier 0 and length 2 starts the node."""

    violates = ("NMT-05", "NMT-03", "KEY-07", "NMT-07")

    def command(self, frame: Frame) -> NmtCommand | None:
        """Its buffer holds the last start command."""
        if frame.remote and not frame.extended and not frame.can_id and frame.dlc == 2:
            return NmtCommand.START
        return super().command(frame)


class ObeysExtendedFrames(Operation, Fault):
    """NMT commands are obeyed in frames with a 29-bit identifier 0 too."""

    violates = ("NMT-05", "KEY-07", "NMT-07", "NMT-02", "NMT-03")

    def acceptance(self) -> frozenset[int] | None:
        """Everything: the filter does not look at the format."""
        return None

    def command(self, frame: Frame) -> NmtCommand | None:
        """Format and all, it is identifier 0."""
        if frame.extended and not frame.remote and not frame.can_id:
            frame = Frame(0, frame.data)
        return super().command(frame)


class ObeysOneByte(Operation, Fault):
    """An NMT frame of one byte is taken as a command to all nodes."""

    violates = ("NMT-05", "KEY-07", "NMT-07", "NMT-02", "NMT-03")

    def command(self, frame: Frame) -> NmtCommand | None:
        """What is missing counts as zero."""
        if len(frame.data) == 1 and not frame.extended:
            frame = Frame(frame.can_id, frame.data + b"\0")
        return super().command(frame)


class CommandsTakeEffectLate(Slow, Fault):
    """NMT commands take effect after 51 ms."""

    violates = ("KEY-01", "HB-03", "NMT-07", "KEY-07", "NMT-06")
    span_ns = 51 * MS

    def picks(self, frame: Frame) -> bool:
        """NMT only."""
        return frame.can_id == 0


class StopsObeyingAfterStop(Operation, Fault):
    """Once stopped the node obeys nothing but a power cycle."""

    violates = ("NMT-04", "NMT-07", "NMT-06", "HB-03", "KEY-01")

    def obey(self, command: NmtCommand, now: int) -> Frames:
        """Stopped for good."""
        return NOTHING if self.state is NmtState.STOPPED else super().obey(command, now)


FAULTS: tuple[type[Fault], ...] = (
    IgnoresStart,
    IgnoresStartWhenStopped,
    IgnoresStop,
    IgnoresStopWhenPreOperational,
    IgnoresPreOperational,
    IgnoresResetNode,
    IgnoresResetNodeWhenStopped,
    IgnoresResetCommunication,
    StopLeadsToPreOperational,
    PreOperationalLeadsToStopped,
    ResetNodeWithoutBootUp,
    ResetCommunicationWithoutBootUp,
    ResetLosesParameters,
    IgnoresBroadcast,
    ObeysOnlyBroadcast,
    ObeysEveryNodeId,
    ObeysItsNeighbour,
    ComparesFourBitsOfNodeId,
    ObeysUnknownCommands,
    ObeysRemoteFrames,
    ObeysExtendedFrames,
    ObeysOneByte,
    CommandsTakeEffectLate,
    StopsObeyingAfterStop,
)
