"""What the judge is told about the device: identity, parameters and limits, all spans in ns."""

from __future__ import annotations

from dataclasses import dataclass

from hil_tests.judge.verdict import Limits


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
        key_bytes: length of a key frame.
        emcy_ns: from boot-up to its EMCY, at most.
        fade_ns: how long its capacitors may keep it alive once its supply is cut.
        exclusive: nobody else is on the bus, so every frame of others is the device's.
        neighbours: identifiers of stations that the bench itself put on the bus.
    """

    node_id: int | None
    heartbeat_ns: int | None
    heartbeat_each: Limits
    heartbeat_mean: Limits
    heartbeat_first: Limits
    bit_rate: int | None
    command_ns: int
    boot_up_ns: int
    key_bytes: int = 1
    emcy_ns: int = 0
    fade_ns: int = 0
    exclusive: bool = True
    neighbours: frozenset[int] = frozenset()
