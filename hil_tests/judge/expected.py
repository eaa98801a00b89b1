"""What the judge is told about the device: identity, parameters and limits, all spans in ns."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import Enum

from hil_tests.clock import FOREVER
from hil_tests.judge import ids
from hil_tests.judge.settings import Role
from hil_tests.judge.verdict import Limits


class Family(Enum):
    """Devices that speak alike."""

    KEYPAD = "keypad"
    """A key frame, two LED frames, and a commissioning of its own."""
    CIA301 = "cia301"
    """An object dictionary and the services of CiA 301."""

    # Members are singletons; hashing their names, as Enum does, is slow.
    __hash__ = object.__hash__


Spans = tuple[int, int]
"""Least and most, in ns."""

_ANY = Limits()


def _no_limits(_: int) -> tuple[Spans, Spans]:
    return (0, FOREVER), (0, FOREVER)


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
        tolerances: what one interval and the mean of many may be, for a heartbeat period.
        family: how it speaks.
        key_bytes: length of a key frame; of a keypad alone.
        emcy_ns: from boot-up to its EMCY, at most; of a keypad alone.
        fade_ns: how long its capacitors may keep it alive once its supply is cut.
        exclusive: nobody else is on the bus, so every frame of others is the device's.
        speaks: identifiers that its electronic data sheet gives it, and for what.
    """

    node_id: int | None
    heartbeat_ns: int | None
    bit_rate: int | None
    command_ns: int
    boot_up_ns: int
    heartbeat_each: Limits = _ANY
    heartbeat_mean: Limits = _ANY
    heartbeat_first: Limits = _ANY
    tolerances: Callable[[int], tuple[Spans, Spans]] = _no_limits
    family: Family = Family.KEYPAD
    key_bytes: int = 1
    emcy_ns: int = 0
    fade_ns: int = 0
    exclusive: bool = True
    speaks: tuple[tuple[int, Role], ...] = ()

    def beating(self, period_ns: int) -> Expected:
        """The same device with another heartbeat period; 0 = it sends none."""
        if not period_ns:
            return replace(self.of_unknown_beat(), heartbeat_ns=0)
        (least, most), mean = self.tolerances(period_ns)
        # A least distance of 0 asks nothing of beats that follow each other anyway.
        return replace(
            self,
            heartbeat_ns=period_ns,
            heartbeat_each=Limits(least or -FOREVER, most),
            heartbeat_mean=Limits(*mean),
            heartbeat_first=Limits(at_most_ns=most),
        )

    def of_unknown_beat(self) -> Expected:
        """The same device, where nobody can say how often it beats."""
        return replace(
            self,
            heartbeat_ns=None,
            heartbeat_each=_ANY,
            heartbeat_mean=_ANY,
            heartbeat_first=_ANY,
        )

    @property
    def ids(self) -> ids.Ids:
        """Which requirement says what must hold at all times."""
        return _IDS[self.family]
