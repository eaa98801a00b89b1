"""The heartbeat producer keeps a grid; its frames are those of CiA 301."""

from __future__ import annotations

import pytest

from node_model.frame import Frame
from node_model.heartbeat import HeartbeatProducer, heartbeat_frame
from node_model.nmt import NmtState


@pytest.mark.parametrize(
    ("state", "data"),
    [
        (NmtState.INITIALISING, b"\x00"),
        (NmtState.STOPPED, b"\x04"),
        (NmtState.OPERATIONAL, b"\x05"),
        (NmtState.PRE_OPERATIONAL, b"\x7f"),
    ],
)
def test_one_byte_shows_the_state(state: NmtState, data: bytes) -> None:
    """COB-ID 700h + node id, one byte; boot-up is the one with 00h."""
    assert heartbeat_frame(0x0F, state) == Frame(0x70F, data)


def test_first_beat_is_one_period_after_the_start() -> None:
    """Boot-up counts as beat zero."""
    producer = HeartbeatProducer(100)
    assert producer.due_at is None

    producer.start(7)

    assert producer.due_at == 107


def test_a_late_caller_does_not_shift_the_grid() -> None:
    """The next beat is due one period after the last one was due, not after it was sent."""
    producer = HeartbeatProducer(100)
    producer.start(0)
    producer.beat()
    producer.beat()
    assert producer.due_at == 300


def test_period_zero_never_beats() -> None:
    """Producer time 0 means no heartbeat."""
    producer = HeartbeatProducer(0)
    producer.start(5)
    assert producer.due_at is None


def test_a_stopped_producer_stays_stopped() -> None:
    """After `stop` nothing is due, whoever calls."""
    producer = HeartbeatProducer(100)
    producer.start(0)
    producer.stop()
    producer.beat()
    assert producer.due_at is None
