"""TIME: six bytes, sent and heard."""

from __future__ import annotations

import pytest

from node_model.frame import Frame
from node_model.nmt import NmtState
from node_model.node import MS, NOTHING, S
from node_model.od import AbortCode, ObjectDictionary
from node_model.time_of_day import DAY_MS, TimeOfDay
from tests.node_model.services import feed, passing, refused, told, u32, write

CONSUME = 1 << 31
PRODUCE = 1 << 30
NOON = Frame(0x100, bytes.fromhex("002E9302 1027"))
"""12:00:00, 10 000 days after 1984-01-01."""


def clock(value: int = 0x100, period_ns: int = 0) -> TimeOfDay:
    """A TIME service that started at 0."""
    service = TimeOfDay(ObjectDictionary([u32(0x1012, 0, value)]), period_ns)
    service.start(0)
    return service


def test_a_consumer_takes_the_time_and_goes_on_from_it() -> None:
    """Bit 31 of 1012h; 28 bits of ms and 16 bits of days, little-endian."""
    service = clock(CONSUME | 0x100)
    assert service.listens_to() == {0x100}
    assert feed(service, 5 * S, NOON) == []
    assert service.time(5 * S) == (43_200_000, 10_000)
    assert service.time(6 * S) == (43_201_000, 10_000)


def test_the_day_changes_at_midnight() -> None:
    """After 86 399 999 ms comes 0 of the next day; day 65535 is followed by 0."""
    service = clock()
    service.set(DAY_MS - 1, 0xFFFF, 0)
    assert service.time(0) == (DAY_MS - 1, 0xFFFF)
    assert service.time(MS) == (0, 0)


def test_the_four_bits_above_the_milliseconds_mean_nothing() -> None:
    """They are reserved."""
    service = clock(CONSUME | 0x100)
    feed(service, 0, Frame(0x100, bytes.fromhex("010000F0 0200")))
    assert service.time(0) == (1, 2)


@pytest.mark.parametrize(
    "frame",
    [Frame(0x100, bytes(5)), Frame(0x100, bytes(7)), Frame(0x100, remote=True, dlc=6)],
)
def test_other_frames_are_no_time(frame: Frame) -> None:
    """Five bytes, seven, a remote frame."""
    service = clock(CONSUME | 0x100)
    service.set(1, 1, 0)
    feed(service, 0, frame)
    assert service.time(0) == (1, 1)


def test_without_bit_31_no_time_is_heard() -> None:
    """Nor listened to."""
    service = clock()
    assert service.listens_to() == frozenset()
    feed(service, 0, NOON)
    assert service.time(0) == (0, 0)


def test_in_stopped_no_time_is_heard() -> None:
    """In pre-operational and operational it is."""
    service = clock(CONSUME | 0x100)
    service.enter(NmtState.STOPPED, 0)
    feed(service, 0, NOON)
    assert service.time(0) == (0, 0)


def test_a_producer_sends_each_period() -> None:
    """Its own time, on a grid."""
    service = clock(PRODUCE | 0x100, 1 * S)
    service.set(43_200_000, 10_000, 0)
    assert passing(service, 2 * S) == [(1 * S, "100#E83193021027"), (2 * S, "100#D03593021027")]
    assert len(service.advance(4 * S)) == 2


def test_a_producer_sends_when_asked() -> None:
    """Without a period it only does so then."""
    service = clock(PRODUCE | 0x100)
    assert service.deadline() is None
    service.set(43_200_000, 10_000, 0)
    assert told(service.announce(0)) == [str(NOON)]


def test_stopped_interrupts_the_production() -> None:
    """Neither by itself nor when asked; afterwards one period passes first."""
    service = clock(PRODUCE | 0x100, 1 * S)
    service.enter(NmtState.OPERATIONAL, 100)
    assert service.deadline() == 1 * S
    service.enter(NmtState.STOPPED, 500 * MS)
    assert service.deadline() is None
    assert service.announce(600 * MS) == NOTHING
    service.enter(NmtState.OPERATIONAL, 700 * MS)
    assert service.deadline() == 1700 * MS


def test_bit_30_starts_and_ends_the_production() -> None:
    """At once."""
    od = ObjectDictionary([u32(0x1012, 0, 0x100)])
    service = TimeOfDay(od, 1 * S)
    service.start(0)
    assert service.deadline() is None
    write(od, 0x1012, 0, PRODUCE | 0x100, 5)
    assert service.deadline() == 1 * S + 5
    write(od, 0x1012, 0, 0x100, 6)
    assert service.deadline() is None
    assert service.announce(7) == NOTHING


def test_a_device_without_supply_sends_no_time() -> None:
    """Not when asked either."""
    service = clock(PRODUCE | 0x100, 1 * S)
    service.stop()
    assert service.deadline() is None
    assert service.announce(7) == NOTHING


def test_the_identifier_changes_only_while_the_service_is_not_used() -> None:
    """0609 0030h; so are restricted ones and 29-bit ones."""
    od = ObjectDictionary([u32(0x1012, 0, CONSUME | 0x100)])
    TimeOfDay(od)
    assert refused(od, 0x1012, 0, CONSUME | 0x200) is AbortCode.VALUE
    write(od, 0x1012, 0, 0x100)
    assert refused(od, 0x1012, 0, 0x601) is AbortCode.VALUE
    assert refused(od, 0x1012, 0, 1 << 29 | 0x100) is AbortCode.VALUE
    write(od, 0x1012, 0, CONSUME | 0x200)


def test_without_the_object_there_is_no_time() -> None:
    """1012h is optional."""
    service = TimeOfDay(ObjectDictionary([]), 1 * S)
    service.start(0)
    assert (service.listens_to(), service.deadline()) == (frozenset(), None)
