"""Faults by a hair: a ms past a limit, one bit of a byte, one value of a range, one state."""

from __future__ import annotations

from dataclasses import replace

from node_model.emcy import EMCY_BASE, GENERIC_ERROR, HARDWARE_ERROR, emcy_frame
from node_model.faults.link import Delay, base_of
from node_model.faults.mutants.echo import OtherEcho
from node_model.faults.mutants.nmt import Deaf
from node_model.faults.mutants.start import OtherEmcy
from node_model.faults.parts import Fault
from node_model.frame import Frame
from node_model.heartbeat import HEARTBEAT_BASE
from node_model.keypad import Keypad, Profile
from node_model.keypad.lamps import Lamps
from node_model.keypad.operation import Operation
from node_model.nmt import ALL_NODES, NmtCommand, NmtState
from node_model.node import MS, Frames, S
from node_model.storage import RecordStore

# A ms past a limit.


class NeedsLongerPause(Keypad, Fault):
    """Switched on again after less than 201 ms the node does not start."""

    violates = ("NMT-02", "COM-06", "COM-02", "COM-27", "COM-29")
    off_at = -1 * S

    def power_off(self, now: int) -> Frames:
        """Note when the charge began to leave."""
        self.off_at = now
        return super().power_off(now)

    def power_on(self, now: int) -> Frames:
        """Too early it hangs."""
        frames = super().power_on(now)
        if now - self.off_at < 201 * MS:
            self._decide_at = None
        return frames


class BootUpLateAfterReset(Operation, Fault):
    """Boot-up comes 1001 ms after an NMT reset."""

    violates = ("NMT-06", "HB-05")

    def reset_ns(self) -> int:
        """Just past the profile's 1 s."""
        return 1001 * MS


class EmcyOneMsLate(Delay, Fault):
    """The EMCY comes 101 ms after boot-up."""

    violates = ("NMT-02", "ROB-02")
    span_ns = 101 * MS

    def picks(self, frame: Frame) -> bool:
        """EMCY only."""
        return base_of(frame) == EMCY_BASE


class _SlowBlink(Lamps):
    """A little more light."""

    def __init__(self, profile: Profile, now: int = 0) -> None:
        super().__init__(replace(profile, blink_on_ns=profile.blink_on_ns + 51 * MS), now)


class BlinkLightTooLong(Operation, Fault):
    """Blinking LEDs shine 51 ms longer than they should."""

    violates = ("LED-05",)
    lamps_type = _SlowBlink


# One bit.


class EmcyOfGroupAbove(OtherEmcy, Fault):
    """The EMCY has code 5100h, of the group above 50xxh."""

    violates = ("NMT-02", "NMT-20")
    code = HARDWARE_ERROR + 0x100


class EmcyOfGroupBelow(OtherEmcy, Fault):
    """The EMCY has code 4FFFh, of the group below 50xxh."""

    violates = ("NMT-02", "NMT-20")
    code = HARDWARE_ERROR - 1


class EmcyWithMakersBit(Operation, Fault):
    """The last byte of the EMCY, the maker's own, is 1 instead of 0."""

    violates = ("NMT-20",)

    def emcy(self) -> Frame:
        """One bit of forty."""
        return emcy_frame(self.node_id, HARDWARE_ERROR, GENERIC_ERROR, b"\0\0\0\0\1")


class BootUpOfOne(Operation, Fault):
    """The byte of boot-up is 01h."""

    violates = ("NMT-02", "NMT-06", "HB-05", "HB-02")

    def boot_frames(self, cause: NmtCommand) -> Frames:
        """One bit is set."""
        return (Frame(HEARTBEAT_BASE + self.node_id, b"\1"), *super().boot_frames(cause)[1:])


class HeartbeatWithoutData(Operation, Fault):
    """The heartbeat has no byte."""

    violates = ("HB-02", "ROB-02")

    def beat_frames(self) -> Frames:
        """An empty frame."""
        return (Frame(HEARTBEAT_BASE + self.node_id),)


class EchoLosesTopBit(OtherEcho, Fault):
    """The top bit of the debounce time is missing in the echo."""

    violates = ("COM-05",)

    def told(self, received: bytes) -> bytes:
        """Seven bits of the last byte."""
        return received[:5] + bytes((received[5] & 0x7F,))


class _LastNeverBlinks(Lamps):
    """One lamp has no blinker."""

    def set_blinking(self, data: bytes) -> None:
        super().set_blinking(data)
        self.blinking &= ~(1 << max(self._profile.leds.values()))


class LastLedNeverBlinks(Operation, Fault):
    """The LED of the highest bit cannot blink."""

    violates = ("LED-02",)
    lamps_type = _LastNeverBlinks


# One value of a range.


class HeartbeatNoFasterThanTwoMs(Operation, Fault):
    """A period of 1 ms is taken as 2 ms."""

    violates = ("HB-01", "COM-09")

    def heartbeat_ns(self) -> int:
        """Zero still means none."""
        period = super().heartbeat_ns()
        return max(period, 2 * MS) if period else 0


class HeartbeatOfBlankIsNone(Operation, Fault):
    """A heartbeat time of 65535 ms counts as none, like a blank memory."""

    violates = ("COM-09", "HB-01", "HB-06")

    def heartbeat_ns(self) -> int:
        """FFFFh is nothing."""
        return 0 if self.parameters.heartbeat_ms == 0xFFFF else super().heartbeat_ns()


class HeartbeatSwappedWithoutLowByte(Operation, Fault):
    """Where the low byte of the heartbeat time is 0 the bytes are swapped: 256 ms become 1 ms."""

    violates = ("COM-09", "HB-01")

    def heartbeat_ns(self) -> int:
        """Right for all that were tried."""
        high, low = divmod(self.parameters.heartbeat_ms, 256)
        return super().heartbeat_ns() if low else high * MS


class HeartbeatLosesLowByteAboveFourSeconds(Operation, Fault):
    """Of heartbeat times above 4096 ms only the high byte is used."""

    violates = ("COM-09", "HB-01")

    def heartbeat_ns(self) -> int:
        """Reloaded in two halves, of which one is forgotten."""
        period_ms = self.parameters.heartbeat_ms
        return (period_ms & 0xFF00) * MS if period_ms > 0x1000 else super().heartbeat_ns()


class CodeTwoHundredIsHundredTwentyFive(Operation, Fault):
    """Bit-rate code 200 means 125 kbit/s."""

    violates = ("COM-07",)

    def line_rate(self) -> int:
        """One code of 250."""
        return 125_000 if self.parameters.bit_rate_code == 200 else super().line_rate()


class SyncTimeSeventySevenIsThePeriod(Operation, Fault):
    """A sync time of 77 is the period of the heartbeat, too: 770 ms."""

    violates = ("COM-11", "HB-01", "HB-06")

    def heartbeat_ns(self) -> int:
        """One sync time of 255."""
        return 770 * MS if self.parameters.sync_time == 77 else super().heartbeat_ns()


class EchoOfSyncTimeLosesBit(OtherEcho, Fault):
    """A sync time of 55h is echoed as 54h."""

    violates = ("COM-05", "COM-11")

    def told(self, received: bytes) -> bytes:
        """One value of one byte."""
        return received[:4] + bytes((0x54,)) + received[5:] if received[4] == 0x55 else received


class ParametersOfSumZeroNotStored(RecordStore, Fault):
    """Parameters whose bytes add up to zero are echoed, but not stored."""

    violates = ("COM-06", "COM-07")

    def save(self, record: bytes, now: int) -> None:
        """They look like a memory that was never written."""
        if sum(record) & 0xFF:
            super().save(record, now)


class DebounceOfBlankIsOneStep(Operation, Fault):
    """Debounce 255 is taken as 100 ms, like a blank memory."""

    violates = ("COM-10",)

    def debounce_ns(self) -> int:
        """FFh is the factory's."""
        return 100 * MS if self.parameters.debounce == 0xFF else super().debounce_ns()


class DebounceSigned(Operation, Fault):
    """Debounce times above 127 steps count as none."""

    violates = ("COM-10",)

    def debounce_ns(self) -> int:
        """Negative is nothing."""
        return super().debounce_ns() if self.parameters.debounce < 0x80 else 0


class FifteenDeafToItsId(Operation, Fault):
    """As node 15 it obeys NMT commands to all nodes only."""

    violates = ("NMT-04", "COM-08", "NMT-07", "KEY-01")

    def command(self, frame: Frame) -> NmtCommand | None:
        """Fifteen counts as not set."""
        own = frame.data[1:2] == b"\x0f"
        return None if own else super().command(frame)


# One state.


class IgnoresPreOperationalWhenStopped(Deaf, Fault):
    """Enter pre-operational (80h) is ignored in stopped."""

    violates = ("NMT-04", "NMT-07")
    ignores = NmtCommand.PRE_OPERATIONAL
    only_in = NmtState.STOPPED


class IgnoresResetCommunicationWhenOperational(Deaf, Fault):
    """Reset communication (82h) is ignored in operational."""

    violates = ("NMT-04", "NMT-06", "NMT-07", "KEY-07")
    ignores = NmtCommand.RESET_COMMUNICATION
    only_in = NmtState.OPERATIONAL


class IgnoresResetNodeToAllWhenStopped(Operation, Fault):
    """Reset node (81h) to all nodes is ignored in stopped."""

    violates = ("NMT-04", "NMT-06", "NMT-07")

    def command(self, frame: Frame) -> NmtCommand | None:
        """One cell of the matrix."""
        found = super().command(frame)
        here = self.state is NmtState.STOPPED and found is NmtCommand.RESET_NODE
        return None if here and frame.data[1] == ALL_NODES else found


FAULTS: tuple[type[Fault], ...] = (
    NeedsLongerPause,
    BootUpLateAfterReset,
    EmcyOneMsLate,
    BlinkLightTooLong,
    EmcyOfGroupAbove,
    EmcyOfGroupBelow,
    EmcyWithMakersBit,
    BootUpOfOne,
    HeartbeatWithoutData,
    EchoLosesTopBit,
    LastLedNeverBlinks,
    HeartbeatNoFasterThanTwoMs,
    HeartbeatOfBlankIsNone,
    HeartbeatSwappedWithoutLowByte,
    HeartbeatLosesLowByteAboveFourSeconds,
    CodeTwoHundredIsHundredTwentyFive,
    SyncTimeSeventySevenIsThePeriod,
    EchoOfSyncTimeLosesBit,
    ParametersOfSumZeroNotStored,
    DebounceOfBlankIsOneStep,
    DebounceSigned,
    FifteenDeafToItsId,
    IgnoresPreOperationalWhenStopped,
    IgnoresResetCommunicationWhenOperational,
    IgnoresResetNodeToAllWhenStopped,
)
