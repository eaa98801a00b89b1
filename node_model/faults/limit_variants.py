"""Keypads a hair inside a limit: the other side of each fault that lies just outside."""

from __future__ import annotations

from dataclasses import replace

from node_model.faults.parts import Deviation
from node_model.frame import Frame
from node_model.heartbeat import HeartbeatProducer
from node_model.keypad import Parameters, Profile
from node_model.keypad.commissioning import ECHO_ID, ECHO_PERIOD_NS, Commissioning
from node_model.keypad.lamps import Lamps
from node_model.keypad.operation import Operation
from node_model.node import MS, US
from node_model.storage import RecordStore


class HeartbeatSlowWithinLimits(Operation, Deviation):
    """The heartbeat period is 1.9 % too long."""

    allowed_by = "HB-01"

    def heartbeat_ns(self) -> int:
        """Within the limits of interval and mean."""
        return super().heartbeat_ns() * 1019 // 1000


class HeartbeatFastWithinLimits(Operation, Deviation):
    """The heartbeat period is 1.9 % too short."""

    allowed_by = "HB-01"

    def heartbeat_ns(self) -> int:
        """Within the limits of interval and mean."""
        return super().heartbeat_ns() * 981 // 1000


class _FirstAtLimit(HeartbeatProducer):
    """The first beat takes longer than the others."""

    __slots__ = ()

    def start(self, now: int) -> None:
        super().start(now + max(self.period_ns * 5 // 100, 5 * MS) - 1 * MS)


class FirstHeartbeatAtLimit(Operation, Deviation):
    """The first heartbeat comes 1 ms before a period and its limit have passed since boot-up."""

    allowed_by = "HB-06"
    heartbeat_type = _FirstAtLimit


class DebounceShortWithinLimits(Operation, Deviation):
    """The debounce time is 9 ms too short."""

    allowed_by = "KEY-05"

    def debounce_ns(self) -> int:
        """Within the scan of 10 ms."""
        return max(super().debounce_ns() - 9 * MS, 0)


class DebounceLongWithinLimits(Operation, Deviation):
    """The debounce time is 9 ms too long."""

    allowed_by = "KEY-05"

    def debounce_ns(self) -> int:
        """Within the scan of 10 ms."""
        return super().debounce_ns() + 9 * MS


class StoresJustInTime(RecordStore, Deviation):
    """Storing takes 492 ms."""

    allowed_by = "COM-06"

    def __init__(self, size: int, image: bytes = b"") -> None:
        super().__init__(size, image, 41 * MS)


class EchoSlightlyFast(Commissioning, Deviation):
    """The echo period is 98.1 ms."""

    allowed_by = "COM-05"

    def echo_period_ns(self) -> int:
        """Within the limits of interval and mean."""
        return ECHO_PERIOD_NS - 1900 * US


class EchoWithByteOfMaker(Commissioning, Deviation):
    """The echo has a seventh byte, AAh."""

    allowed_by = "COM-25"

    def echo_frame(self, parameters: Parameters) -> Frame:
        """One more."""
        return Frame(ECHO_ID, parameters.encode() + b"\xaa")


class _LongLight(Lamps):
    """A little more light, a little less dark."""

    def __init__(self, profile: Profile, now: int = 0) -> None:
        on_ns, off_ns = profile.blink_on_ns + 49 * MS, profile.blink_off_ns - 49 * MS
        super().__init__(replace(profile, blink_on_ns=on_ns, blink_off_ns=off_ns), now)


class BlinkUnevenWithinLimits(Operation, Deviation):
    """Blinking LEDs shine 49 ms too long and are dark 49 ms too short."""

    allowed_by = "LED-05"
    lamps_type = _LongLight


DEVIATIONS: tuple[type[Deviation], ...] = (
    HeartbeatSlowWithinLimits,
    HeartbeatFastWithinLimits,
    FirstHeartbeatAtLimit,
    DebounceShortWithinLimits,
    DebounceLongWithinLimits,
    StoresJustInTime,
    EchoSlightlyFast,
    EchoWithByteOfMaker,
    BlinkUnevenWithinLimits,
)
