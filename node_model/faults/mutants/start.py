"""Faults of the start: boot-up, EMCY, first state (requirements NMT-01..03, NMT-20)."""

from __future__ import annotations

from node_model.emcy import EMCY_BASE, GENERIC_ERROR, HARDWARE_ERROR, emcy_frame
from node_model.faults.link import Delay, base_of
from node_model.faults.parts import Fault
from node_model.frame import Frame
from node_model.heartbeat import HEARTBEAT_BASE, heartbeat_frame
from node_model.keypad import Keypad
from node_model.keypad.operation import Operation
from node_model.nmt import NmtCommand, NmtState
from node_model.node import MS, NOTHING, Frames


class BootUpLate(Keypad, Fault):
    """Boot-up comes 1001 ms after power-on."""

    violates = ("NMT-02",)

    def start_ns(self) -> int:
        """Just past the profile's 1 s."""
        return 1001 * MS


class BootUpTwice(Operation, Fault):
    """Boot-up is sent twice."""

    violates = ("NMT-02", "NMT-06")

    def boot_frames(self, cause: NmtCommand) -> Frames:
        """Once more in front."""
        frames = super().boot_frames(cause)
        return (frames[0], *frames)


class BootUpMissing(Operation, Fault):
    """There is no boot-up."""

    violates = ("NMT-02", "NMT-06", "HB-05")

    def boot_frames(self, cause: NmtCommand) -> Frames:
        """All but the first."""
        return super().boot_frames(cause)[1:]


class BootUpOfWrongByte(Operation, Fault):
    """Boot-up shows 7Fh like a heartbeat."""

    violates = ("NMT-02", "NMT-06", "HB-05")

    def boot_frames(self, cause: NmtCommand) -> Frames:
        """A heartbeat in front."""
        first = heartbeat_frame(self.node_id, NmtState.PRE_OPERATIONAL)
        return (first, *super().boot_frames(cause)[1:])


class BootUpWithoutData(Operation, Fault):
    """Boot-up has no data byte."""

    violates = ("NMT-02", "ROB-02", "HB-05")

    def boot_frames(self, cause: NmtCommand) -> Frames:
        """An empty frame in front."""
        return (Frame(HEARTBEAT_BASE + self.node_id), *super().boot_frames(cause)[1:])


class EmcyBeforeBootUp(Operation, Fault):
    """The EMCY comes before boot-up."""

    violates = ("NMT-02",)

    def boot_frames(self, cause: NmtCommand) -> Frames:
        """The wrong way round."""
        return tuple(reversed(super().boot_frames(cause)))


class EmcyMissing(Operation, Fault):
    """There is no EMCY after boot-up."""

    violates = ("NMT-02",)

    def boot_frames(self, cause: NmtCommand) -> Frames:
        """Boot-up alone."""
        return super().boot_frames(cause)[:1]


class EmcyLate(Delay, Fault):
    """The EMCY comes 110 ms after boot-up."""

    violates = ("NMT-02", "ROB-02")
    span_ns = 110 * MS

    def picks(self, frame: Frame) -> bool:
        """EMCY only."""
        return base_of(frame) == EMCY_BASE


class OtherEmcy(Operation):
    """Another EMCY after boot-up."""

    code = HARDWARE_ERROR
    register = GENERIC_ERROR

    def emcy(self) -> Frame:
        """With these values."""
        return emcy_frame(self.node_id, self.code, self.register)


class EmcyOfCommunication(OtherEmcy, Fault):
    """The EMCY has code 8100h (communication) instead of 50xxh."""

    violates = ("NMT-02", "NMT-20")
    code = 0x8100


class EmcyOfNoError(OtherEmcy, Fault):
    """The EMCY has code 0000h (no error)."""

    violates = ("NMT-02", "NMT-20")
    code = 0


class EmcyBigEndian(OtherEmcy, Fault):
    """The error code of the EMCY is big-endian."""

    violates = ("NMT-02", "NMT-20")
    code = 0x0050


class EmcyWithoutRegister(OtherEmcy, Fault):
    """The error register in the EMCY is 0."""

    violates = ("NMT-20",)
    register = 0


class EmcyTooShort(Operation, Fault):
    """The EMCY has three bytes instead of eight."""

    violates = ("NMT-02", "ROB-02")

    def emcy(self) -> Frame:
        """Cut off after the register."""
        whole = super().emcy()
        return Frame(whole.can_id, whole.data[:3])


class StartsOperational(Operation, Fault):
    """The node becomes operational by itself after boot-up."""

    violates = (
        "NMT-01",
        "NMT-03",
        "NMT-07",
        "KEY-01",
        "KEY-07",
        "KEY-22",
        "LED-04",
        "NMT-06",
        "NMT-04",
    )

    def state_after_boot(self) -> NmtState:
        """Without being asked."""
        return NmtState.OPERATIONAL


class StartsStopped(Operation, Fault):
    """The node is stopped after boot-up."""

    violates = ("NMT-01", "NMT-06", "NMT-07", "NMT-04")

    def state_after_boot(self) -> NmtState:
        """Not pre-operational."""
        return NmtState.STOPPED


class OperationalByKeyPress(Operation, Fault):
    """A key press in pre-operational starts the node."""

    violates = ("NMT-03", "KEY-07", "NMT-07", "KEY-01")

    def settle(self, now: int) -> Frames:
        """A debounced change is taken for a start command."""
        if self.state is not NmtState.PRE_OPERATIONAL:
            return super().settle(now)
        return self.obey(NmtCommand.START, now) if self.keys.advance(now) else NOTHING


FAULTS: tuple[type[Fault], ...] = (
    BootUpLate,
    BootUpTwice,
    BootUpMissing,
    BootUpOfWrongByte,
    BootUpWithoutData,
    EmcyBeforeBootUp,
    EmcyMissing,
    EmcyLate,
    EmcyOfCommunication,
    EmcyOfNoError,
    EmcyBigEndian,
    EmcyWithoutRegister,
    EmcyTooShort,
    StartsOperational,
    StartsStopped,
    OperationalByKeyPress,
)
