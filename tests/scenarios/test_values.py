"""Special values: every byte of every field is among them, limits, and neutral checksums."""

from __future__ import annotations

from functools import reduce
from operator import xor

from hil_tests.clock import MS
from hil_tests.scenarios.memory import decoded
from hil_tests.scenarios.values import (
    LSS,
    MANY,
    TALLIES,
    VALUES,
    beats_span_ns,
    key_span_ns,
    value,
)
from hil_tests.scenarios.words import sent

ALL = [bytes.fromhex(value(number)) for number in range(VALUES)]
SETS = [decoded(data) for data in ALL]
EVERY = set(range(256))


def test_each_byte_of_each_field_is_tried() -> None:
    """No bit-rate code, sync time, debounce time or high byte of a heartbeat is left out."""
    assert {each.bit_rate_code for each in SETS} == EVERY
    assert {each.sync_time for each in SETS} == EVERY
    assert {each.debounce for each in SETS} == EVERY
    assert {each.heartbeat_ms >> 8 for each in SETS} == EVERY
    assert {each.node_id for each in SETS} == set(range(1, 16))


def test_heartbeat_times_stand_at_limits_and_powers_of_two() -> None:
    """None, the shortest, the longest, and what a byte or a sign bit would lose."""
    found = {each.heartbeat_ms for each in SETS}
    assert {0, 1, 2, 127, 128, 255, 256, 257, 4095, 4096, 4097, 32767, 32768, 65535} <= found


def test_some_sums_come_out_as_zero() -> None:
    """Of all bytes added, and of all bytes by exclusive or."""
    assert sum(not sum(data) % 256 for data in ALL) > 100
    assert sum(not reduce(xor, data) for data in ALL) > 100


def test_slow_wires_carry_the_heartbeat() -> None:
    """A beat of a few ms would fill the bus at 100 kbit/s and less."""
    for each in SETS:
        assert each.bit_rate >= 125_000 or each.heartbeat_ms >= 100


def test_the_same_number_is_the_same_value() -> None:
    """Any number stands for one."""
    assert value(3) == value(3 + VALUES)


def test_what_is_waited_for_shows_the_value() -> None:
    """Four beats, a mean where it is short, and the debounce time with its limits."""
    assert beats_span_ns("040210FF1001") == 4 * 4351 * MS
    assert beats_span_ns("040200640001") == 21 * 100 * MS
    assert beats_span_ns("040200FA0001") == 3000 * MS
    assert key_span_ns("0402006400FF") == 25_650 * MS


def test_lss_requests_are_whole_frames() -> None:
    """Eight bytes each, of the master's identifier."""
    frames = [sent(text.removeprefix("send ")).frame for text in LSS]
    assert {(frame.can_id, len(frame.data)) for frame in frames} == {(0x7E5, 8)}
    assert {0x04, 0x11, 0x4C, 0x51, 0x5E} <= {frame.data[0] for frame in frames}


def test_a_tally_does_not_end_as_it_began() -> None:
    """Odd, and more than eight bits count: what stands still at any count shows."""
    assert MANY % 2
    assert MANY > 256
    assert all(len(acts) in {1, 2} for acts in TALLIES)
