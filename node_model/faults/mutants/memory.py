"""Faults of the parameters: kept wrongly or understood wrongly (requirements COM-06..26)."""

from __future__ import annotations

from dataclasses import replace

from node_model.faults.link import WrongRate
from node_model.faults.parts import Fault
from node_model.frame import Frame
from node_model.keypad import Keypad, Parameters
from node_model.keypad.operation import Operation
from node_model.keypad.parameters import DEBOUNCE_STEP_NS, SIZE
from node_model.node import MS, Frames
from node_model.storage import MARK, RecordStore

_RECORD_AT = 3
"""Where the record begins in a slot: after the mark and the sequence number."""


# Kept wrongly.


class StoresNothing(RecordStore, Fault):
    """The parameters are echoed, but never stored."""

    violates = ("COM-06", "COM-07", "COM-08")

    def save(self, record: bytes, now: int) -> None:
        """Forgotten at once."""


class StoresSlowly(RecordStore, Fault):
    """Storing takes 504 ms."""

    violates = ("COM-06", "COM-07", "COM-08")

    def __init__(self, size: int, image: bytes = b"") -> None:
        super().__init__(size, image, 42 * MS)


class StoresOnce(RecordStore, Fault):
    """Only the first parameters of its life are stored."""

    violates = ("COM-06", "COM-07", "COM-08")

    def save(self, record: bytes, now: int) -> None:
        """Written once, read for ever."""
        if self.load() is None:
            super().save(record, now)


class StoresInPlace(RecordStore, Fault):
    """New parameters overwrite the old ones byte by byte: a power cut leaves a mixture."""

    violates = ("COM-26",)

    def save(self, record: bytes, now: int) -> None:
        """One slot, no check; slow enough to be cut."""
        self._byte_ns = 40 * MS
        self._queue = [*enumerate(record, _RECORD_AT), (0, MARK)]
        self.due_at = now + self._byte_ns

    def load(self) -> bytes | None:
        """What stands there, whole or not."""
        whole = bytes(self.memory[_RECORD_AT : _RECORD_AT + SIZE])
        return whole if self.memory[0] == MARK else None


class ErasesBeforeStoring(RecordStore, Fault):
    """Old parameters are erased before new ones are stored: a power cut leaves the factory's."""

    violates = ("COM-26",)

    def save(self, record: bytes, now: int) -> None:
        """First wipe everything, then go about it slowly."""
        self._byte_ns = 20 * MS
        self.memory[:] = bytes(len(self.memory))
        super().save(record, now)


class _Keeps(Keypad):
    """One of the parameters stays what the factory set."""

    keeps: str

    def stored(self) -> Parameters:
        """All parameters but that one."""
        old = getattr(self.profile.factory, self.keeps)
        return replace(super().stored(), **{self.keeps: old})


class KeepsNodeId(_Keeps, Fault):
    """A new node id is not used."""

    violates = ("COM-06", "COM-08")
    keeps = "node_id"


class KeepsBitRate(_Keeps, Fault):
    """A new bit rate is not used."""

    violates = ("COM-06", "COM-07")
    keeps = "bit_rate_code"


class KeepsHeartbeat(_Keeps, Fault):
    """A new heartbeat time is not used."""

    violates = ("COM-06", "COM-09", "HB-01", "HB-05", "HB-06")
    keeps = "heartbeat_ms"


class KeepsDebounce(_Keeps, Fault):
    """A new debounce time is not used."""

    violates = ("COM-06", "COM-10", "COM-23", "KEY-04", "KEY-05")
    keeps = "debounce"


# Understood wrongly: bit rate.


class _OtherRate(Operation):
    """One bit-rate code means another bit rate."""

    code: int
    means: int

    def line_rate(self) -> int:
        """The wrong one for that code."""
        mistaken = self.parameters.bit_rate_code == self.code
        return self.means if mistaken else super().line_rate()


class CodeOneIsOneMegabit(_OtherRate, Fault):
    """Bit-rate code 1 means 1000 kbit/s."""

    violates = ("COM-07",)
    code, means = 1, 1_000_000


class CodeTwoIsDefaultOfCia(_OtherRate, Fault):
    """Bit-rate code 2 means 125 kbit/s."""

    violates = ("COM-07",)
    code, means = 2, 125_000


class CodeThreeIsHundred(_OtherRate, Fault):
    """Bit-rate code 3 means 100 kbit/s: the table without 125."""

    violates = ("COM-07", "COM-06")
    code, means = 3, 100_000


class CodeFourIsFifty(_OtherRate, Fault):
    """Bit-rate code 4 means 50 kbit/s."""

    violates = ("COM-07",)
    code, means = 4, 50_000


class CodeFiveIsTwenty(_OtherRate, Fault):
    """Bit-rate code 5 means 20 kbit/s: the doubled line of the source counted once."""

    violates = ("COM-07",)
    code, means = 5, 20_000


class CodeSixIsTen(_OtherRate, Fault):
    """Bit-rate code 6 means 10 kbit/s."""

    violates = ("COM-07",)
    code, means = 6, 10_000


class CodeZeroIsFiveHundred(_OtherRate, Fault):
    """Bit-rate code 0 means 500 kbit/s: the table counted from 0."""

    violates = ("COM-07",)
    code, means = 0, 500_000


class CodeSevenIsTwenty(_OtherRate, Fault):
    """Bit-rate code 7 means 20 kbit/s: the doubled line of the source counted twice."""

    violates = ("COM-07",)
    code, means = 7, 20_000


class BlankCodeIsHundredTwentyFive(_OtherRate, Fault):
    """Bit-rate code 255 means 125 kbit/s, like a blank memory."""

    violates = ("COM-07",)
    code, means = 255, 125_000


class CodesBeyondTableMeanHundredTwentyFive(Operation, Fault):
    """Every bit-rate code outside 1..6 means 125 kbit/s."""

    violates = ("COM-07",)

    def line_rate(self) -> int:
        """The bit rate of commissioning as the default."""
        known = self.parameters.bit_rate_code in range(1, 7)
        return super().line_rate() if known else 125_000


# Understood wrongly: the rest.


class NodeIdOfThreeBits(Keypad, Fault):
    """Of the node id only the lowest three bits are used."""

    violates = ("COM-08", "COM-06")

    def stored(self) -> Parameters:
        """9 becomes 1; 8 stays."""
        found = super().stored()
        return replace(found, node_id=found.node_id & 7 or found.node_id)


class HeartbeatLittleEndian(Operation, Fault):
    """The heartbeat time is taken as little-endian."""

    violates = ("COM-09", "HB-01", "HB-06")

    def heartbeat_ns(self) -> int:
        """The bytes swapped."""
        swapped = self.parameters.heartbeat_ms.to_bytes(2, "little")
        return int.from_bytes(swapped, "big") * MS


class HeartbeatOfOneByte(Operation, Fault):
    """Of the heartbeat time only the low byte is used."""

    violates = ("COM-09", "HB-01", "HB-06")

    def heartbeat_ns(self) -> int:
        """At most 255 ms."""
        return (self.parameters.heartbeat_ms & 0xFF) * MS


class HeartbeatSigned(Operation, Fault):
    """Heartbeat times above 32767 ms count as none."""

    violates = ("COM-09", "HB-01", "HB-06")

    def heartbeat_ns(self) -> int:
        """Negative is nothing."""
        period = super().heartbeat_ns()
        return period if period < 0x8000 * MS else 0


class DebounceInTens(Operation, Fault):
    """The debounce time counts in steps of 10 ms, like the sync time."""

    violates = ("COM-10", "KEY-04", "KEY-05")

    def debounce_ns(self) -> int:
        """A tenth."""
        return super().debounce_ns() // 10


class DebounceCapped(Operation, Fault):
    """Debounce times above 1 s are taken as 1 s."""

    violates = ("COM-10",)

    def debounce_ns(self) -> int:
        """Ten steps at most."""
        return min(super().debounce_ns(), 10 * DEBOUNCE_STEP_NS)


class DebounceZeroIsOneStep(Operation, Fault):
    """Debounce time 0 is taken as 100 ms."""

    violates = ("COM-23",)

    def debounce_ns(self) -> int:
        """Never without a filter."""
        return super().debounce_ns() or DEBOUNCE_STEP_NS


class SyncTimeAddsToDebounce(Operation, Fault):
    """The sync time is added to the debounce time."""

    violates = ("COM-11", "KEY-05")

    def debounce_ns(self) -> int:
        """An effect where there should be none."""
        return super().debounce_ns() + self.parameters.sync_time * 10 * MS


class SyncTimeSendsSync(Operation, Fault):
    """With a sync time the node sends SYNC with each heartbeat."""

    violates = ("COM-11", "ROB-02")

    def beat_frames(self) -> Frames:
        """It plays the SYNC producer."""
        frames = super().beat_frames()
        return (*frames, Frame(0x080)) if self.parameters.sync_time else frames


class WrongOscillator(WrongRate, Fault):
    """The node runs at twice every bit rate."""

    violates = ("COM-07", "COM-02", "NMT-02", "COM-06")


FAULTS: tuple[type[Fault], ...] = (
    StoresNothing,
    StoresSlowly,
    StoresOnce,
    StoresInPlace,
    ErasesBeforeStoring,
    KeepsNodeId,
    KeepsBitRate,
    KeepsHeartbeat,
    KeepsDebounce,
    CodeOneIsOneMegabit,
    CodeTwoIsDefaultOfCia,
    CodeThreeIsHundred,
    CodeFourIsFifty,
    CodeFiveIsTwenty,
    CodeSixIsTen,
    CodeZeroIsFiveHundred,
    CodeSevenIsTwenty,
    BlankCodeIsHundredTwentyFive,
    CodesBeyondTableMeanHundredTwentyFive,
    NodeIdOfThreeBits,
    HeartbeatLittleEndian,
    HeartbeatOfOneByte,
    HeartbeatSigned,
    DebounceInTens,
    DebounceCapped,
    DebounceZeroIsOneStep,
    SyncTimeAddsToDebounce,
    SyncTimeSendsSync,
    WrongOscillator,
)
