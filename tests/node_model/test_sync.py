"""SYNC: what counts as one, the producer's grid and counter, the window, what may be written."""

from __future__ import annotations

import pytest

from node_model.frame import Frame
from node_model.nmt import NmtState
from node_model.node import MS, NOTHING, US, Frames
from node_model.od import AbortCode, ObjectDictionary
from node_model.sync import SyncService
from tests.node_model.services import Reports, feed, passing, refused, told, u8, u32, write

SYNC = Frame(0x080)
PRODUCER = 1 << 30


class Bus:
    """A SYNC service that started at 0, and the SYNCs that its listener saw."""

    def __init__(
        self,
        cob_id: int = 0x80,
        period_us: int = 0,
        window: int = 0,
        overflow: int = 0,
        unit_ns: int = US,
        produces: bool = True,
    ) -> None:
        self.od = ObjectDictionary(
            [
                u32(0x1005, 0, cob_id),
                u32(0x1006, 0, period_us),
                u32(0x1007, 0, window),
                u8(0x1019, 0, overflow),
            ]
        )
        self.reports = Reports()
        self.seen: list[tuple[int, int | None]] = []
        self.service = SyncService(self.od, self.reports, unit_ns, produces)
        self.service.tell(self.hear)
        self.service.start(0)

    def hear(self, counter: int | None, now: int) -> Frames:
        """The listener; its answer shows that answers are sent."""
        self.seen.append((now, counter))
        return (Frame(0x185),)


# Consumer


def test_a_sync_is_told_and_the_answer_sent() -> None:
    """Without counter: no byte."""
    bus = Bus()
    assert bus.service.listens_to() == {0x80}
    assert feed(bus.service, 7, SYNC) == ["185#"]
    assert bus.seen == [(7, None)]
    assert bus.service.synced_at == 7


def test_a_counter_is_told() -> None:
    """1019h is not 0: one byte."""
    bus = Bus(overflow=10)
    feed(bus.service, 7, Frame(0x80, b"\x03"))
    assert bus.seen == [(7, 3)]


@pytest.mark.parametrize(("overflow", "size"), [(0, 1), (0, 8), (10, 0), (10, 2)])
def test_a_sync_of_the_wrong_length_is_an_error_and_no_sync(overflow: int, size: int) -> None:
    """8240h with bit 4, which the next right one ends; it does not move the state."""
    bus = Bus(overflow=overflow)
    assert feed(bus.service, 7, *[Frame(0x80, bytes(size))] * 2) == ["085#4082"]
    assert bus.seen == []
    right = Frame(0x80, b"\x01" if overflow else b"")
    assert feed(bus.service, 9, right) == ["085#0000", "185#"]
    assert bus.reports.codes == [(7, 0x8240), (9, 0)]
    fault = bus.reports.seen[0][2]
    assert fault is not None
    assert (fault.register, fault.communication) == (0x10, False)


def test_a_remote_frame_is_no_sync() -> None:
    """Nor an error."""
    bus = Bus()
    assert feed(bus.service, 7, Frame(0x80, remote=True)) == []
    assert (bus.seen, bus.reports.seen) == ([], [])


def test_in_stopped_no_sync_is_heard() -> None:
    """Nor is a wrong one an error; in the other states both are."""
    bus = Bus()
    bus.service.enter(NmtState.STOPPED, 1)
    assert feed(bus.service, 7, SYNC, Frame(0x80, bytes(8))) == []
    assert (bus.seen, bus.reports.seen) == ([], [])
    bus.service.enter(NmtState.OPERATIONAL, 8)
    feed(bus.service, 9, SYNC)
    assert bus.seen == [(9, None)]


def test_another_identifier_is_listened_to_at_once() -> None:
    """1005h, bits 0 to 10."""
    bus = Bus()
    write(bus.od, 0x1005, 0, 0x99)
    assert bus.service.listens_to() == {0x99}


def test_without_its_objects_a_device_hears_the_usual_sync() -> None:
    """COB-ID 080h, no counter, no window."""
    service = SyncService(ObjectDictionary([]), Reports())
    service.start(0)
    assert service.listens_to() == {0x80}
    assert feed(service, 7, SYNC) == []
    assert service.synced_at == 7
    assert service.deadline() is None


# Producer


def test_a_producer_keeps_its_grid() -> None:
    """1006h in us, from the start; its own SYNC counts for the device."""
    bus = Bus(PRODUCER | 0x80, 1000)
    assert passing(bus.service, 2 * MS) == [
        (1 * MS, "080#"),
        (1 * MS, "185#"),
        (2 * MS, "080#"),
        (2 * MS, "185#"),
    ]
    assert bus.seen == [(1 * MS, None), (2 * MS, None)]


def test_a_late_call_produces_every_sync_that_was_due() -> None:
    """Each at its own instant."""
    bus = Bus(PRODUCER | 0x80, 1000)
    bus.service.advance(3 * MS + 5)
    assert [now for now, _ in bus.seen] == [1 * MS, 2 * MS, 3 * MS]
    assert bus.service.deadline() == 4 * MS


def test_the_counter_goes_from_1_to_its_overflow_and_starts_again() -> None:
    """1019h = 3: 1, 2, 3, 1."""
    bus = Bus(PRODUCER | 0x80, 1000, overflow=3)
    sent = [text for _, text in passing(bus.service, 4 * MS) if text.startswith("080")]
    assert sent == ["080#01", "080#02", "080#03", "080#01"]
    assert [counter for _, counter in bus.seen] == [1, 2, 3, 1]


def test_setting_bit_30_starts_within_one_cycle() -> None:
    """One period after the write; clearing it ends the production."""
    bus = Bus(0x80, 1000)
    assert bus.service.deadline() is None
    write(bus.od, 0x1005, 0, PRODUCER | 0x80, 5 * MS)
    assert bus.service.deadline() == 6 * MS
    write(bus.od, 0x1005, 0, 0x80, 6 * MS - 1)
    assert bus.service.deadline() is None


def test_period_0_ends_the_production_and_another_restarts_it() -> None:
    """A new 1006h acts at once."""
    bus = Bus(PRODUCER | 0x80, 1000)
    write(bus.od, 0x1006, 0, 0, 500 * US)
    assert bus.service.deadline() is None
    write(bus.od, 0x1006, 0, 200, 600 * US)
    assert bus.service.deadline() == 800 * US


def test_stopped_interrupts_the_production_and_resets_the_counter() -> None:
    """Pre-operational and operational both produce, and going between them changes nothing."""
    bus = Bus(PRODUCER | 0x80, 1000, overflow=5)
    passing(bus.service, 1 * MS)
    bus.service.enter(NmtState.OPERATIONAL, 1500 * US)
    sent = passing(bus.service, 2 * MS)
    bus.service.enter(NmtState.STOPPED, 2 * MS)
    assert bus.service.deadline() is None
    bus.service.enter(NmtState.PRE_OPERATIONAL, 10 * MS)
    sent += passing(bus.service, 11 * MS)
    assert [at for at in sent if at[1].startswith("080")] == [
        (2 * MS, "080#02"),
        (11 * MS, "080#01"),
    ]


def test_nothing_is_produced_in_stopped_whatever_is_written() -> None:
    """Nor before the start, nor after the stop."""
    bus = Bus(PRODUCER | 0x80, 1000)
    bus.service.enter(NmtState.STOPPED, 0)
    write(bus.od, 0x1006, 0, 500)
    assert bus.service.deadline() is None
    bus.service.enter(NmtState.OPERATIONAL, 0)
    bus.service.stop()
    assert bus.service.deadline() is None
    write(bus.od, 0x1006, 0, 1000)
    assert bus.service.deadline() is None


# Window


@pytest.mark.parametrize("unit_ns", [US, MS])
def test_the_window_closes_after_1007h_in_its_unit(unit_ns: int) -> None:
    """Its last instant still belongs to it."""
    bus = Bus(window=20, unit_ns=unit_ns)
    feed(bus.service, 1000, SYNC)
    end = 1000 + 20 * unit_ns
    assert bus.service.is_open(1000)
    assert bus.service.is_open(end)
    assert not bus.service.is_open(end + 1)
    feed(bus.service, 10 * end, SYNC)
    assert bus.service.is_open(10 * end + 1)


def test_without_a_window_everything_is_in_time() -> None:
    """1007h = 0."""
    bus = Bus()
    feed(bus.service, 0, SYNC)
    assert bus.service.is_open(3_600_000 * MS)


def test_before_the_first_sync_the_window_is_open() -> None:
    """Also after stopped, in which no SYNC is seen."""
    bus = Bus(window=20)
    assert bus.service.is_open(5 * MS)
    feed(bus.service, 5 * MS, SYNC)
    assert not bus.service.is_open(6 * MS)
    bus.service.enter(NmtState.STOPPED, 6 * MS)
    bus.service.enter(NmtState.OPERATIONAL, 7 * MS)
    assert bus.service.is_open(8 * MS)


# What may be written


def test_a_producer_keeps_its_identifier() -> None:
    """0609 0030h while bit 30 is and stays set."""
    bus = Bus(PRODUCER | 0x80, 1000)
    assert refused(bus.od, 0x1005, 0, PRODUCER | 0x81) is AbortCode.VALUE
    write(bus.od, 0x1005, 0, 0x80)
    write(bus.od, 0x1005, 0, 0x81)
    write(bus.od, 0x1005, 0, PRODUCER | 0x81)


@pytest.mark.parametrize("value", [0x601, 1 << 29 | 0x80, 1 << 11 | 0x80])
def test_restricted_and_long_identifiers_are_refused(value: int) -> None:
    """0609 0030h; bit 31 does not matter."""
    bus = Bus()
    assert refused(bus.od, 0x1005, 0, value) is AbortCode.VALUE
    write(bus.od, 0x1005, 0, 1 << 31 | 0x80)


def test_who_cannot_produce_refuses_bit_30() -> None:
    """0609 0030h."""
    assert refused(Bus(produces=False).od, 0x1005, 0, PRODUCER | 0x80) is AbortCode.VALUE


@pytest.mark.parametrize("value", [1, 241, 255])
def test_a_counter_overflow_of_1_or_above_240_is_refused(value: int) -> None:
    """0609 0030h; 0, 2 and 240 are right."""
    bus = Bus()
    assert refused(bus.od, 0x1019, 0, value) is AbortCode.VALUE
    for right in (2, 240, 0):
        write(bus.od, 0x1019, 0, right)


def test_the_counter_overflow_is_fixed_while_there_is_a_cycle() -> None:
    """0800 0022h while 1006h is not 0."""
    bus = Bus(period_us=1000)
    assert refused(bus.od, 0x1019, 0, 10) is AbortCode.DEVICE_STATE
    write(bus.od, 0x1006, 0, 0)
    write(bus.od, 0x1019, 0, 10)


def test_a_service_that_has_not_started_sends_nothing() -> None:
    """The verbs can be called at any time."""
    service = SyncService(ObjectDictionary([]), Reports())
    assert told(service.advance(MS)) == []
    assert service.advance(MS) == NOTHING
