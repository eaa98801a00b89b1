"""Drives whose network management is wrong (C-NMT)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from node_model.drive import Drive
from node_model.faults.link import Slow
from node_model.faults.parts import Fault
from node_model.frame import Frame
from node_model.nmt import NMT_COB_ID, NmtCommand, NmtState
from node_model.node import MS, Frames
from node_model.sdo import SdoServer


class BootsByItselfIntoOperational(Fault, Drive):
    """After the boot-up it becomes operational without a command."""

    violates = ("C-NMT-19", "C-NMT-01")

    def boot(self, now: int) -> Frames:
        return (*super().boot(now), *self.enter(NmtState.OPERATIONAL, now))


class AnnouncesItselfTwice(Fault, Drive):
    """The boot-up is sent twice."""

    violates = ("C-NMT-01", "C-NMT-13")

    def boot_frames(self) -> Frames:
        return (*super().boot_frames(), *super().boot_frames())


class AnnouncesItselfWithItsState(Fault, Drive):
    """The boot-up has 7Fh instead of 00h."""

    violates = ("C-NMT-01", "C-NMT-20")

    def boot_frames(self) -> Frames:
        return [replace(frame, data=b"\x7f") for frame in super().boot_frames()]


class NeverAnnouncesItself(Fault, Drive):
    """There is no boot-up."""

    violates = ("C-NMT-01", "C-NMT-12", "C-NMT-20")

    def boot_frames(self) -> Frames:
        return ()


class BootsSlowly(Fault, Drive):
    """From power-on to the boot-up it takes 1.2 s."""

    violates = ("C-NMT-20",)

    def start_ns(self) -> int:
        return 1200 * MS


class ResetsSlowly(Fault, Drive):
    """From a reset to the boot-up it takes 1.2 s."""

    violates = ("C-NMT-20",)

    def reset_ns(self) -> int:
        return 1200 * MS


class DeafToResetCommunication(Fault, Drive):
    """A reset communication changes nothing."""

    violates = ("C-NMT-04", "C-NMT-12", "C-NMT-13", "C-NMT-20", "C-NMT-02", "C-LS-10")

    def obey(self, command: NmtCommand, now: int) -> Frames:
        return () if command is NmtCommand.RESET_COMMUNICATION else super().obey(command, now)


class ResetNodeKeepsTheApplication(Fault, Drive):
    """A reset node leaves the objects from 2000h on as they are."""

    violates = ("C-NMT-11",)

    def restored_by(self, command: NmtCommand) -> Callable[[int], bool]:
        return super().restored_by(NmtCommand.RESET_COMMUNICATION)


class ResetCommunicationRestoresAll(Fault, Drive):
    """A reset communication brings the objects from 2000h on to their power-on values, too."""

    violates = ("C-NMT-12",)

    def restored_by(self, command: NmtCommand) -> Callable[[int], bool]:
        return super().restored_by(NmtCommand.RESET_NODE)


class IgnoresCommandsToAll(Fault, Drive):
    """An NMT command to all nodes is ignored."""

    violates = ("C-NMT-06",)

    def command(self, frame: Frame) -> NmtCommand | None:
        return super().command(frame) if frame.data[1:2] != b"\0" else None


class ObeysCommandsToOthers(Fault, Drive):
    """An NMT command to another node is obeyed."""

    violates = ("C-NMT-07", "C-NMT-13")

    def command(self, frame: Frame) -> NmtCommand | None:
        if not frame.remote:
            frame = Frame(frame.can_id, frame.data[:1] + b"\0")
        return super().command(frame)


class ObeysAnUnknownCommand(Fault, Drive):
    """The command specifier 03h stops the node."""

    violates = ("C-NMT-08",)

    def command(self, frame: Frame) -> NmtCommand | None:
        if frame.data[:1] == b"\x03":
            frame = replace(frame, data=b"\x02" + frame.data[1:])
        return super().command(frame)


class ObeysRemoteCommands(Fault, Drive):
    """A remote frame with identifier 0 and two bytes resets the node."""

    violates = ("C-NMT-10", "C-NMT-13")

    def command(self, frame: Frame) -> NmtCommand | None:
        if frame.remote and frame.dlc == 2:
            return NmtCommand.RESET_NODE
        return super().command(frame)


class HearsExtendedFrames(Fault, Drive):
    """A frame with a 29-bit identifier counts as one with the same number in 11 bits."""

    violates = ("C-NMT-10", "C-RP-08")

    def _route(self) -> None:
        super()._route()
        self.listens_to = None if self.bit_rate else frozenset()

    def receive(self, frame: Frame, now: int) -> Frames:
        short = frame.extended and frame.can_id < 0x800
        return super().receive(replace(frame, extended=False) if short else frame, now)


class StopIsPreOperational(Fault, Drive):
    """The command stop leads to pre-operational."""

    violates = ("C-NMT-04", "C-NMT-05", "C-NMT-06", "C-NMT-16", "C-NMT-22")

    def target(self, command: NmtCommand) -> NmtState:
        found = super().target(command)
        return NmtState.PRE_OPERATIONAL if found is NmtState.STOPPED else found


class StartWorksOnce(Fault, Drive):
    """The command start in operational leads to pre-operational."""

    violates = ("C-NMT-05", "C-NMT-04")

    def target(self, command: NmtCommand) -> NmtState:
        found = super().target(command)
        again = found is self.state is NmtState.OPERATIONAL
        return NmtState.PRE_OPERATIONAL if again else found


class NoWayFromStoppedToOperational(Fault, Drive):
    """The command start in stopped is ignored."""

    violates = ("C-NMT-05", "C-NMT-04", "C-NMT-22")

    def target(self, command: NmtCommand) -> NmtState:
        found = super().target(command)
        stuck = self.state is NmtState.STOPPED and found is NmtState.OPERATIONAL
        return self.state if stuck else found


class ReadsCommandsLate(Fault, Slow):
    """An NMT command takes effect after 60 ms."""

    violates = ("C-NMT-21",)

    def picks(self, frame: Frame) -> bool:
        return frame.can_id == NMT_COB_ID


class ServesSdoInStopped(Fault, SdoServer):
    """SDO requests are answered in stopped."""

    violates = ("C-NMT-16",)

    def enter(self, state: NmtState, now: int) -> Frames:
        return super().enter(NmtState.PRE_OPERATIONAL, now)


class ServesSdoInPreOperationalOnly(Fault, SdoServer):
    """SDO requests are not answered in operational."""

    violates = ("C-NMT-15",)

    def enter(self, state: NmtState, now: int) -> Frames:
        silent = state is NmtState.OPERATIONAL
        return super().enter(NmtState.STOPPED if silent else state, now)


class ResumesTransfersAfterStopped(Fault, SdoServer):
    """An SDO transfer that stopped cut off goes on afterwards."""

    violates = ("C-NMT-17",)

    def _forget(self) -> None:
        pass


FAULTS: tuple[type[Fault], ...] = (
    BootsByItselfIntoOperational,
    AnnouncesItselfTwice,
    AnnouncesItselfWithItsState,
    NeverAnnouncesItself,
    BootsSlowly,
    ResetsSlowly,
    DeafToResetCommunication,
    ResetNodeKeepsTheApplication,
    ResetCommunicationRestoresAll,
    IgnoresCommandsToAll,
    ObeysCommandsToOthers,
    ObeysAnUnknownCommand,
    ObeysRemoteCommands,
    HearsExtendedFrames,
    StopIsPreOperational,
    StartWorksOnce,
    NoWayFromStoppedToOperational,
    ReadsCommandsLate,
    ServesSdoInStopped,
    ServesSdoInPreOperationalOnly,
    ResumesTransfersAfterStopped,
)
