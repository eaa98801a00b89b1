"""The heartbeat consumer: who is watched, from when, what is an event, and what ends it."""

from __future__ import annotations

import pytest

from node_model.frame import Frame
from node_model.heartbeat_consumer import HeartbeatConsumer
from node_model.nmt import NmtState
from node_model.node import MS, NOTHING
from node_model.od import AbortCode, Access, ObjectDictionary
from tests.node_model.services import Reports, feed, passing, refused, u8, u32, write


def watching(node_id: int, time_ms: int) -> int:
    """Value of an entry of 1016h."""
    return node_id << 16 | time_ms


def beat(node_id: int, state: int = 0x05) -> Frame:
    """A heartbeat."""
    return Frame(0x700 + node_id, bytes((state,)))


class Consumer:
    """A consumer with three entries that started at 0."""

    def __init__(self, *values: int) -> None:
        subs = [*values, 0, 0, 0][:3]
        self.od = ObjectDictionary(
            [u8(0x1016, 0, 3, Access.CONST), *(u32(0x1016, n + 1, v) for n, v in enumerate(subs))]
        )
        self.reports = Reports()
        self.service = HeartbeatConsumer(self.od, self.reports)
        self.service.start(0)


def test_it_listens_to_the_nodes_that_it_watches() -> None:
    """Node id in bits 16 to 23, time in ms below."""
    consumer = Consumer(watching(3, 100), watching(0x7F, 1))
    assert consumer.service.listens_to() == {0x703, 0x77F}


@pytest.mark.parametrize(
    "value", [0, watching(0, 100), watching(128, 100), watching(255, 100), watching(3, 0)]
)
def test_node_0_nodes_above_127_and_time_0_are_unused(value: int) -> None:
    """They may be written, and watch nobody."""
    consumer = Consumer()
    write(consumer.od, 0x1016, 1, value, 5)
    assert consumer.service.listens_to() == frozenset()


def test_watching_begins_with_the_first_heartbeat() -> None:
    """Before it there is no event."""
    consumer = Consumer(watching(3, 100))
    assert consumer.service.deadline() is None
    assert feed(consumer.service, 500 * MS, beat(3)) == []
    assert consumer.service.deadline() == 600 * MS


def test_a_boot_up_does_not_begin_the_watching() -> None:
    """A node that has just started may not beat yet."""
    consumer = Consumer(watching(3, 100))
    feed(consumer.service, 0, beat(3, 0))
    assert consumer.service.deadline() is None


def test_a_boot_up_prolongs_the_watching() -> None:
    """A node that restarts and falls silent is missed."""
    consumer = Consumer(watching(3, 100))
    feed(consumer.service, 0, beat(3))
    feed(consumer.service, 50 * MS, beat(3, 0))
    assert consumer.service.deadline() == 150 * MS


def test_silence_is_an_event_once() -> None:
    """8130h with bit 4, a communication error, at the end of the consumer time."""
    consumer = Consumer(watching(3, 100))
    feed(consumer.service, 0, beat(3))
    feed(consumer.service, 99 * MS, beat(3))
    assert consumer.service.advance(199 * MS - 1) == NOTHING
    assert passing(consumer.service, 10_000 * MS) == [(199 * MS, "085#3081")]
    ((now, cause, fault),) = consumer.reports.seen
    assert fault is not None
    assert (now, cause) == (199 * MS, "heartbeat of node 3")
    assert (fault.code, fault.register, fault.communication) == (0x8130, 0x10, True)
    assert fault.manufacturer == b"\x03"


def test_the_next_heartbeat_ends_the_event() -> None:
    """A boot-up before it does not; watching goes on with the heartbeat."""
    consumer = Consumer(watching(3, 100))
    feed(consumer.service, 0, beat(3))
    passing(consumer.service, 100 * MS)
    feed(consumer.service, 200 * MS, beat(3, 0))
    assert consumer.service.deadline() is None
    assert feed(consumer.service, 250 * MS, beat(3, 0x7F)) == ["085#0000"]
    passing(consumer.service, 400 * MS)
    assert consumer.reports.codes == [(100 * MS, 0x8130), (250 * MS, 0), (350 * MS, 0x8130)]


def test_entries_work_independently() -> None:
    """Each node has its own time and its own error."""
    consumer = Consumer(watching(3, 100), 0, watching(4, 250))
    feed(consumer.service, 0, beat(3), beat(4))
    passing(consumer.service, 100 * MS)
    feed(consumer.service, 150 * MS, beat(3))
    passing(consumer.service, 250 * MS)
    told = [(now, cause[-1], bool(fault)) for now, cause, fault in consumer.reports.seen]
    assert told == [
        (100 * MS, "3", True),
        (150 * MS, "3", False),
        (250 * MS, "3", True),
        (250 * MS, "4", True),
    ]


def test_two_nodes_that_are_missed_at_the_same_instant_are_two_events() -> None:
    """Both are told, in the order of their entries."""
    consumer = Consumer(watching(3, 100), watching(4, 100))
    feed(consumer.service, 0, beat(3), beat(4))
    consumer.service.advance(100 * MS)
    assert [cause[-1] for _, cause, _ in consumer.reports.seen] == ["3", "4"]
    assert consumer.service.deadline() is None


@pytest.mark.parametrize(
    "frame",
    [Frame(0x703, remote=True, dlc=1), Frame(0x703), Frame(0x703, bytes(2)), beat(4)],
)
def test_other_frames_are_no_heartbeat(frame: Frame) -> None:
    """A poll, no byte, two bytes, another node."""
    consumer = Consumer(watching(3, 100))
    feed(consumer.service, 0, frame)
    assert consumer.service.deadline() is None


def test_a_node_is_watched_in_every_state() -> None:
    """Error control works in stopped."""
    consumer = Consumer(watching(3, 100))
    consumer.service.enter(NmtState.STOPPED, 0)
    feed(consumer.service, 0, beat(3))
    passing(consumer.service, 100 * MS)
    assert consumer.reports.codes == [(100 * MS, 0x8130)]


def test_a_second_entry_for_a_node_is_refused() -> None:
    """0604 0043h; the same entry may be written again, and unused ones may repeat it."""
    consumer = Consumer(watching(3, 100))
    assert refused(consumer.od, 0x1016, 2, watching(3, 50)) is AbortCode.INCOMPATIBLE
    write(consumer.od, 0x1016, 1, watching(3, 70))
    write(consumer.od, 0x1016, 2, watching(3, 0))
    write(consumer.od, 0x1016, 2, watching(4, 50))


def test_reserved_bits_are_refused() -> None:
    """Bits 24 to 31 are 0: 0609 0030h."""
    assert refused(Consumer().od, 0x1016, 1, 1 << 24 | watching(3, 50)) is AbortCode.VALUE


def test_a_written_entry_waits_for_the_first_heartbeat() -> None:
    """Neither the old time nor the new one runs."""
    consumer = Consumer(watching(3, 100))
    feed(consumer.service, 0, beat(3))
    write(consumer.od, 0x1016, 1, watching(3, 50), 10 * MS)
    assert consumer.service.deadline() is None
    feed(consumer.service, 20 * MS, beat(3))
    assert consumer.service.deadline() == 70 * MS


def test_an_entry_written_0_ends_its_event() -> None:
    """Due at that instant; there is no late event."""
    consumer = Consumer(watching(3, 100))
    feed(consumer.service, 0, beat(3))
    passing(consumer.service, 100 * MS)
    write(consumer.od, 0x1016, 1, 0, 120 * MS)
    assert consumer.service.deadline() == 120 * MS
    assert passing(consumer.service, 10_000 * MS) == [(120 * MS, "085#0000")]
    assert consumer.reports.codes == [(100 * MS, 0x8130), (120 * MS, 0)]


def test_before_the_start_and_after_the_stop_nobody_is_watched() -> None:
    """An entry written then is read at the start."""
    consumer = Consumer(watching(3, 100))
    feed(consumer.service, 0, beat(3))
    consumer.service.stop()
    assert consumer.service.deadline() is None
    write(consumer.od, 0x1016, 1, watching(9, 50))
    assert consumer.service.listens_to() == frozenset()
    consumer.service.start(10)
    assert consumer.service.listens_to() == {0x709}


def test_two_entries_that_are_written_end_their_events_one_after_the_other() -> None:
    """Each at its own instant."""
    consumer = Consumer(watching(3, 100), watching(4, 100))
    feed(consumer.service, 0, beat(3), beat(4))
    passing(consumer.service, 100 * MS)
    write(consumer.od, 0x1016, 1, 0, 120 * MS)
    write(consumer.od, 0x1016, 2, 0, 130 * MS)
    ended = [(120 * MS, "085#0000"), (130 * MS, "085#0000")]
    assert passing(consumer.service, 1000 * MS) == ended


def test_an_entry_of_the_old_setting_sends_nothing_after_a_new_start() -> None:
    """The end of its event was due; the start has forgotten it."""
    consumer = Consumer(watching(3, 100))
    feed(consumer.service, 0, beat(3))
    passing(consumer.service, 100 * MS)
    write(consumer.od, 0x1016, 1, 0, 120 * MS)
    consumer.service.start(120 * MS)
    assert consumer.service.running
    assert consumer.service.deadline() is None


def test_the_count_of_entries_can_be_written_where_the_device_lets_it() -> None:
    """Sub-index 0 is no watch."""
    od = ObjectDictionary([u8(0x1016, 0, 1), u32(0x1016, 1)])
    service = HeartbeatConsumer(od, Reports())
    service.start(0)
    write(od, 0x1016, 0, 1, 5)
    assert service.deadline() is None
