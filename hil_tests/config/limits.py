"""The limits that a board is judged by, as exact integers.

Defaults: the shipped profiles. A tolerance that is a share of a period is rounded
down to a whole ns, so that the limits are never wider than the profile says.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Annotated

import attrs

from hil_tests.clock import MS, US, S
from hil_tests.config.report import Problem, Wrong, near_miss
from hil_tests.config.rules import PPM_PER_PERCENT, Share, Span

ECHO_PERIOD_NS = 100 * MS
"""Period of 3F8h. Keypad specification, "Inizializzazione": "ogni 100ms"."""

SHORTEST_HEARTBEATS = MappingProxyType(
    {
        500_000: 10 * MS,
        250_000: 10 * MS,
        125_000: 10 * MS,
        100_000: 20 * MS,
        50_000: 20 * MS,
        20_000: 50 * MS,
    }
)
"""Default: ns by bit/s."""

_PPM = 1_000_000
_NAMES = {f"{rate // 1000}k": rate for rate in SHORTEST_HEARTBEATS}

Time = Annotated[int, Span(US, 3600 * S)]
Tolerance = Annotated[int, Span(0, 3600 * S)]
Part = Annotated[int, Share(100 * PPM_PER_PERCENT)]


@attrs.frozen
class DeviceLimits:
    """The limits that every kind of device has: spans in ns, shares in parts per million."""

    boot_up_ns: Time = 1 * S
    """Power-on or reset to boot-up, at most."""
    power_off_ns: Time = 200 * MS
    """Supply off between two cycles, at least."""
    command_ns: Time = 50 * MS
    """NMT command to its effect, at most."""
    sdo_ns: Time = 50 * MS
    """SDO request to its answer, at most; where the device has an SDO server."""
    heartbeat_each_ppm: Part = 5 * PPM_PER_PERCENT
    """Each interval; or `heartbeat_floor_ns`, whichever is more."""
    heartbeat_floor_ns: Tolerance = 5 * MS
    heartbeat_mean_ppm: Part = 2 * PPM_PER_PERCENT
    """Mean of 20 intervals or more."""

    def heartbeat_each_ns(self, period_ns: int) -> tuple[int, int]:
        """Least and most of one heartbeat interval, in ns."""
        tolerance = max(_share(period_ns, self.heartbeat_each_ppm), self.heartbeat_floor_ns)
        return _around(period_ns, tolerance)

    def heartbeat_ns(self, period_ns: int) -> tuple[tuple[int, int], tuple[int, int]]:
        """Least and most of one interval, and of the mean of many, in ns."""
        return self.heartbeat_each_ns(period_ns), self.heartbeat_mean_ns(period_ns)

    def heartbeat_mean_ns(self, period_ns: int) -> tuple[int, int]:
        """Least and most of the mean of 20 heartbeat intervals or more, in ns."""
        return _around(period_ns, _share(period_ns, self.heartbeat_mean_ppm))


@attrs.frozen
class KeypadLimits(DeviceLimits):
    """The table [limits] of a keypad."""

    emcy_ns: Time = 100 * MS
    """Boot-up to EMCY, at most."""
    store_ns: Time = 500 * MS
    """First 3F8h to parameters safe, at most."""
    echo_each_ns: Tolerance = 10 * MS
    """Each interval of 3F8h around 100 ms."""
    echo_mean_ppm: Part = 2 * PPM_PER_PERCENT
    scan_ns: Time = 10 * MS
    """How often the board reads its keys, at most."""
    key_frame_ns: Time = 20 * MS
    """Debounced change to request of the key frame, at most."""
    led_ns: Time = 50 * MS
    """LED frame to light, at most."""

    def echo_each(self, period_ns: int = ECHO_PERIOD_NS) -> tuple[int, int]:
        """Least and most of one interval of 3F8h, in ns."""
        return _around(period_ns, self.echo_each_ns)

    def echo_mean(self, period_ns: int = ECHO_PERIOD_NS) -> tuple[int, int]:
        """Least and most of the mean interval of 3F8h, in ns."""
        return _around(period_ns, _share(period_ns, self.echo_mean_ppm))


@attrs.frozen
class Cia301Limits(DeviceLimits):
    """The table [limits] of a drive, or of a generic device."""

    emcy_ns: Time = 20 * MS
    """Error or its end to the EMCY, at most."""
    guard_answer_ns: Time = 10 * MS
    """Guarding request to its answer, at most."""
    life_ns: Time = 20 * MS
    """End of a life time or consumer time to the event, at most."""
    sync_pdo_ns: Time = 2 * MS
    """SYNC to the request of a synchronous TPDO, at most."""
    event_pdo_ns: Time = 20 * MS
    """Event to the request of an event-driven TPDO, at most."""
    store_ns: Time = 1 * S
    """1010h accepted to everything safe, at most."""


def _share(period_ns: int, ppm: int) -> int:
    return period_ns * ppm // _PPM


def _around(period_ns: int, tolerance_ns: int) -> tuple[int, int]:
    """Both ends.

    Raises:
        ValueError: a period of 0 or less has no interval to judge.
    """
    if period_ns <= 0:
        raise ValueError(f"a period of {period_ns} ns has no intervals to judge")
    return max(0, period_ns - tolerance_ns), period_ns + tolerance_ns


@dataclass(frozen=True, slots=True)
class HeartbeatTable:
    """The table [shortest_heartbeat]: whole milliseconds by the name of a bit rate.

    A rate that the file leaves out keeps its default.
    """

    def read(self, value: object) -> Mapping[int, int]:
        """See `rules.Rule`; ns by bit/s."""
        if not isinstance(value, dict):
            raise Wrong.one(value, 'write a table, e.g. { 125k = "10 ms" }')
        table = dict(SHORTEST_HEARTBEATS)
        problems: list[Problem] = []
        for name, text in value.items():
            if name not in _NAMES:
                problems.append(Problem((name,), f"unknown bit rate; {near_miss(name, _NAMES)}"))
                continue
            try:
                table[_NAMES[name]] = _whole_ms(text)
            except Wrong as wrong:
                problems += (Problem((name,), one.what, one.value) for one in wrong.problems)
        if problems:
            raise Wrong(problems)
        return MappingProxyType(table)


def _whole_ms(text: object) -> int:
    """A heartbeat period: the wire carries it in whole milliseconds."""
    span_ns = Span(1 * MS, 65535 * MS).read(text)
    if span_ns % MS:
        raise Wrong.one(text, "heartbeat periods are whole milliseconds; round it")
    return span_ns
