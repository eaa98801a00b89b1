"""The heartbeat producer keeps a grid; its frames are those of CiA 301."""

from __future__ import annotations

import pytest

from node_model.frame import Frame
from node_model.heartbeat import HeartbeatProducer, HeartbeatService, heartbeat_frame
from node_model.nmt import NmtState
from node_model.node import MS, NOTHING
from node_model.od import ObjectDictionary
from tests.node_model.services import passing, u16, write


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


def test_beats_that_go_on_count_as_sent() -> None:
    """Those up to an instant, or so many of them; the grid goes on behind them."""
    producer = HeartbeatProducer(100)
    assert list(producer.go_on(1000, 9)) == []
    producer.start(0)
    assert list(producer.go_on(99, 9)) == []
    assert list(producer.go_on(300, 9)) == [100, 200, 300]
    assert producer.due_at == 400
    assert list(producer.go_on(1000, 2)) == [400, 500]
    assert producer.due_at == 600
    producer.period_ns = 0
    assert list(producer.go_on(1000, 9)) == []


def service(period_ms: int, node_id: int = 5) -> tuple[HeartbeatService, ObjectDictionary]:
    """A heartbeat service that started at 0."""
    od = ObjectDictionary([u16(0x1017, 0, period_ms)])
    beats = HeartbeatService(od, node_id)
    assert beats.start(0) == NOTHING
    return beats, od


def test_beats_show_the_state_of_the_moment() -> None:
    """One period after the boot-up the first; a change of state shows in the next."""
    beats, _ = service(10)
    sent = passing(beats, 15 * MS)
    beats.enter(NmtState.OPERATIONAL, 15 * MS)
    sent += passing(beats, 25 * MS)
    beats.enter(NmtState.STOPPED, 25 * MS)
    sent += passing(beats, 30 * MS)
    assert sent == [(10 * MS, "705#7F"), (20 * MS, "705#05"), (30 * MS, "705#04")]


def test_a_late_call_sends_every_beat_that_was_due() -> None:
    """The grid is that of the due instants."""
    beats, _ = service(10)
    assert len(beats.advance(35 * MS)) == 3
    assert beats.deadline() == 40 * MS


def test_a_written_time_acts_at_once() -> None:
    """The next beat is one new period away, and none of the old period follows."""
    beats, od = service(100)
    write(od, 0x1017, 0, 30, 90 * MS)
    assert passing(beats, 200 * MS) == [
        (120 * MS, "705#7F"),
        (150 * MS, "705#7F"),
        (180 * MS, "705#7F"),
    ]


def test_the_same_time_written_again_restarts_the_period() -> None:
    """No stale beat at the old instant."""
    beats, od = service(100)
    write(od, 0x1017, 0, 100, 60 * MS)
    assert beats.deadline() == 160 * MS


def test_time_0_ends_the_heartbeat() -> None:
    """No beat after it; another time starts it again."""
    beats, od = service(100)
    write(od, 0x1017, 0, 0, 99 * MS)
    assert beats.deadline() is None
    write(od, 0x1017, 0, 50, 200 * MS)
    assert beats.deadline() == 250 * MS


def test_nothing_beats_before_start_and_after_stop() -> None:
    """A time written then waits for the start."""
    beats, od = service(100)
    beats.stop()
    assert beats.deadline() is None
    write(od, 0x1017, 0, 50, 1 * MS)
    assert beats.deadline() is None
    beats.start(10 * MS)
    assert beats.deadline() == 60 * MS


def test_without_the_object_there_is_no_heartbeat() -> None:
    """1017h is optional."""
    beats = HeartbeatService(ObjectDictionary([]), 5)
    beats.start(0)
    assert beats.deadline() is None
    assert beats.listens_to() == frozenset()
