"""The six bytes of 4F8h, as the source states them."""

from __future__ import annotations

import pytest

from node_model.keypad import Parameters
from node_model.keypad.parameters import DEBOUNCE_STEP_NS
from node_model.node import MS


def test_the_bytes_of_the_source_in_their_order() -> None:
    """Byte 1 node id, 2 bit rate, 3 and 4 heartbeat (high, low), 5 sync time, 6 debounce."""
    told = Parameters.decode(b"\x0f\x03\x03\xe8\x14\x02")
    assert told == Parameters(
        node_id=15, bit_rate_code=3, heartbeat_ms=1000, sync_time=20, debounce=2
    )
    assert told.encode() == b"\x0f\x03\x03\xe8\x14\x02"


@pytest.mark.parametrize(
    ("code", "bit_rate"),
    [
        (0, 250_000),
        (1, 500_000),
        (2, 250_000),
        (3, 125_000),
        (4, 100_000),
        (5, 50_000),
        (6, 20_000),
        (7, 250_000),
        (255, 250_000),
    ],
)
def test_bit_rate_codes(code: int, bit_rate: int) -> None:
    """The table of the source; "in tutti gli altri casi" it is 250 kbit/s."""
    assert Parameters(bit_rate_code=code).bit_rate == bit_rate


@pytest.mark.parametrize("node_id", [1, 15])
def test_node_ids_from_1_to_15_are_taken(node_id: int) -> None:
    """Quoted: "Valore minimo 1, valore massimo 15 (0x0F)"."""
    told = Parameters.decode(bytes((node_id, 2, 0, 100, 0, 1)))
    assert told is not None
    assert told.node_id == node_id


@pytest.mark.parametrize("node_id", [0, 16, 255])
def test_other_node_ids_are_refused(node_id: int) -> None:
    """Just outside the range on both sides, and far outside."""
    assert Parameters.decode(bytes((node_id, 2, 0, 100, 0, 1))) is None


@pytest.mark.parametrize("milliseconds", [0, 1, 255, 256, 0x1234, 32767, 32768, 65535])
def test_heartbeat_time_is_big_endian(milliseconds: int) -> None:
    """Byte 3 is the high one."""
    data = bytes((1, 2, milliseconds >> 8, milliseconds & 0xFF, 0, 1))
    told = Parameters.decode(data)
    assert told is not None
    assert told.heartbeat_ms == milliseconds
    assert told.encode() == data


def test_five_bytes_are_too_few_and_more_than_six_mean_nothing() -> None:
    """The length decides before the content."""
    data = b"\x01\x02\x00\x64\x00\x01"
    assert Parameters.decode(data[:5]) is None
    assert Parameters.decode(data + b"\xff\xff") == Parameters.decode(data)


def test_the_source_counts_debounce_in_steps_of_100_ms() -> None:
    """Quoted: "In passi da 100 ms"."""
    assert DEBOUNCE_STEP_NS == 100 * MS
