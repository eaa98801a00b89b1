"""What the judge is told about the device: identity, parameters and limits, all spans in ns."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from hil_tests.clock import FOREVER
from hil_tests.judge import ids
from hil_tests.judge.verdict import Limits


class Family(Enum):
    """Devices that speak alike."""

    KEYPAD = "keypad"
    """A key frame, two LED frames, and a commissioning of its own."""
    CIA301 = "cia301"
    """An object dictionary and the services of CiA 301."""


_ANY = Limits(at_most_ns=FOREVER)
_IDS = {Family.KEYPAD: ids.KEYPAD, Family.CIA301: ids.CIA301}


@dataclass(frozen=True, slots=True)
class Expected:
    """The device as it should be now.

    Args:
        node_id: 1..127; None = not known.
        heartbeat_ns: producer time; 0 = none is sent; None = not known.
        heartbeat_each: limits of a single interval.
        heartbeat_mean: limits of the mean of 20 intervals or more.
        heartbeat_first: limits from boot-up to the first beat.
        bit_rate: at which it runs in operation, bit/s; None = not known.
        command_ns: an NMT command shows its effect within this.
        boot_up_ns: from power-on or reset to boot-up, at most.
        family: how it speaks.
        key_bytes: length of a key frame; of a keypad alone.
        emcy_ns: from boot-up to its EMCY, at most; of a keypad alone.
        fade_ns: how long its capacitors may keep it alive once its supply is cut.
        exclusive: nobody else is on the bus, so every frame of others is the device's.
        neighbours: identifiers of stations that the bench itself put on the bus.
    """

    node_id: int | None
    heartbeat_ns: int | None
    bit_rate: int | None
    command_ns: int
    boot_up_ns: int
    heartbeat_each: Limits = _ANY
    heartbeat_mean: Limits = _ANY
    heartbeat_first: Limits = _ANY
    family: Family = Family.KEYPAD
    key_bytes: int = 1
    emcy_ns: int = 0
    fade_ns: int = 0
    exclusive: bool = True
    neighbours: frozenset[int] = frozenset()

    @property
    def ids(self) -> ids.Ids:
        """Which requirement says what must hold at all times."""
        return _IDS[self.family]
