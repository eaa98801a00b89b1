"""TPDOs: when they are sent, by type, inhibit time, event timer, start value and remote frame."""

from __future__ import annotations

import itertools

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from node_model.frame import Frame
from node_model.nmt import NmtState
from node_model.node import MS, US
from node_model.od import ObjectDictionary
from node_model.pdo import PdoService
from node_model.sync import SyncService
from tests.node_model.pdo.axis import ACTUAL, CONTROL, NO_RTR, OFF, STATUS, Axis
from tests.node_model.services import Reports, feed, passing, write

REMOTE = Frame(0x185, remote=True, dlc=6)


def only(sent: list[tuple[int, str]], identifier: str = "185") -> list[tuple[int, str]]:
    """What was sent with one identifier."""
    return [(at, text) for at, text in sent if text.startswith(identifier)]


def set_while_off(axis: Axis, sub: int, value: int, now: int = 0) -> None:
    """Change a parameter of TPDO 1 that only changes while it is off; leave it off."""
    write(axis.od, 0x1800, 1, OFF | 0x185, now)
    write(axis.od, 0x1800, sub, value, now)


# Operational alone


@pytest.mark.parametrize("state", [NmtState.PRE_OPERATIONAL, NmtState.STOPPED])
@pytest.mark.parametrize("kind", [0, 1, 252, 253, 254, 255])
def test_nothing_is_sent_outside_operational(state: NmtState, kind: int) -> None:
    """Neither by event, nor by SYNC, nor by remote frame."""
    axis = Axis(tpdo=kind, state=state)
    axis.put(STATUS, 1, 1)
    assert axis.first == []
    assert axis.tick(2) == []
    assert feed(axis.pdos, 3, REMOTE) == []
    assert passing(axis.pdos, 1000 * MS) == []


def test_nothing_is_sent_before_the_start_and_after_the_stop() -> None:
    """What was due is dropped."""
    axis = Axis()
    axis.put(STATUS, 1, 1)
    axis.pdos.stop()
    assert axis.pdos.deadline() is None
    axis.put(STATUS, 2, 2)
    write(axis.od, 0x1800, 2, 254, 3)
    assert axis.pdos.deadline() is None


def test_leaving_operational_drops_what_was_due() -> None:
    """It does not come later either; entering again starts anew."""
    axis = Axis()
    axis.put(STATUS, 1, 1)
    assert axis.enter(NmtState.PRE_OPERATIONAL, 1) == []
    assert passing(axis.pdos, 1000 * MS) == []
    assert axis.enter(NmtState.OPERATIONAL, 5) == ["185#010000000000", "285#00000000"]


def test_a_command_to_the_same_state_changes_nothing() -> None:
    """No PDO is sent once more."""
    axis = Axis()
    assert axis.enter(NmtState.OPERATIONAL, 5) == []


def test_a_pdo_that_is_off_is_not_sent() -> None:
    """Bit 31 of its COB-ID; nor listened to."""
    axis = Axis()
    write(axis.od, 0x1800, 1, OFF | 0x185, 1)
    axis.put(STATUS, 1, 2)
    assert passing(axis.pdos, 1000 * MS) == []
    assert axis.pdos.listens_to() == {0x205}


def test_a_pdo_that_maps_nothing_is_not_sent() -> None:
    """It can be switched on."""
    axis = Axis()
    write(axis.od, 0x1802, 1, 0x385, 1)
    assert passing(axis.pdos, 1000 * MS) == []


# Events


@pytest.mark.parametrize("kind", [254, 255])
def test_an_event_driven_pdo_is_sent_on_entering_operational_and_on_change(kind: int) -> None:
    """Status and actual value, little-endian."""
    axis = Axis(tpdo=kind)
    assert axis.first == ["185#000000000000", "285#00000000"]
    axis.put(STATUS, 0x1234, 10)
    assert passing(axis.pdos, MS) == [(10, "185#341200000000")]


def test_an_object_in_two_pdos_sends_both() -> None:
    """In the order of their numbers."""
    axis = Axis()
    axis.put(ACTUAL, -1, 10)
    assert passing(axis.pdos, MS) == [(10, "185#0000FFFFFFFF"), (10, "285#FFFFFFFF")]


def test_a_value_that_is_written_and_does_not_change_is_no_event() -> None:
    """Nor is an object that no TPDO maps."""
    axis = Axis()
    axis.put(STATUS, 0, 10)
    axis.put(CONTROL, 7, 11)
    assert axis.pdos.deadline() is None


def test_what_a_client_writes_into_a_mapped_object_is_an_event() -> None:
    """Seen without a word of the application."""
    axis = Axis()
    write(axis.od, 0x1800, 1, OFF | 0x185)
    write(axis.od, 0x1A00, 0, 0)
    write(axis.od, 0x1A00, 1, 0x20000218)
    write(axis.od, 0x1A00, 0, 1)
    write(axis.od, 0x1800, 1, 0x185, 5)
    passing(axis.pdos, 5)
    write(axis.od, 0x2000, 2, 0x010203, 7)
    assert passing(axis.pdos, MS) == [(7, "185#030201")]


def test_the_inhibit_time_keeps_events_apart_and_sends_the_last_value() -> None:
    """It counts in 100 us from one transmission to the next."""
    axis = Axis()
    set_while_off(axis, 3, 20)
    write(axis.od, 0x1800, 1, 0x185, 10 * MS)
    sent = passing(axis.pdos, 10 * MS)
    for value in range(1, 5):
        axis.put(STATUS, value, 10 * MS + value * 300 * US)
        sent += passing(axis.pdos, 10 * MS + value * 300 * US)
    sent += passing(axis.pdos, 13 * MS)
    assert only(sent) == [(10 * MS, "185#000000000000"), (12 * MS, "185#040000000000")]
    axis.put(STATUS, 9, 14 * MS)
    assert passing(axis.pdos, 14 * MS) == [(14 * MS, "185#090000000000")]


def test_the_inhibit_time_holds_over_a_change_of_state() -> None:
    """It is a distance of frames on the bus."""
    axis = Axis()
    set_while_off(axis, 3, 20)
    write(axis.od, 0x1800, 1, 0x185, 0)
    passing(axis.pdos, 0)
    axis.enter(NmtState.PRE_OPERATIONAL, 1)
    assert axis.enter(NmtState.OPERATIONAL, 2) == ["285#00000000"]
    assert passing(axis.pdos, 100 * MS) == [(2 * MS, "185#000000000000")]


def test_an_initialisation_forgets_the_inhibit_time() -> None:
    """Nothing was ever sent."""
    axis = Axis()
    set_while_off(axis, 3, 20)
    write(axis.od, 0x1800, 1, 0x185, 10 * MS)
    passing(axis.pdos, 10 * MS)
    axis.pdos.stop()
    axis.pdos.start(10 * MS)
    assert axis.pdos.state is NmtState.PRE_OPERATIONAL
    assert only([(0, text) for text in axis.enter(NmtState.OPERATIONAL, 11 * MS)]) != []


def test_the_event_timer_repeats_a_pdo() -> None:
    """In ms; each transmission restarts it."""
    axis = Axis()
    write(axis.od, 0x1800, 5, 10, 0)
    assert [at for at, _ in only(passing(axis.pdos, 25 * MS))] == [10 * MS, 20 * MS]
    axis.put(STATUS, 1, 25 * MS)
    assert [at for at, _ in only(passing(axis.pdos, 45 * MS))] == [25 * MS, 35 * MS, 45 * MS]


def test_a_new_event_timer_counts_from_its_writing() -> None:
    """0 ends it."""
    axis = Axis()
    write(axis.od, 0x1800, 5, 10, 3 * MS)
    assert axis.pdos.deadline() == 13 * MS
    write(axis.od, 0x1800, 5, 0, 4 * MS)
    assert axis.pdos.deadline() is None


def test_the_event_timer_waits_for_the_inhibit_time() -> None:
    """The inhibit time is a lower bound for both."""
    axis = Axis()
    set_while_off(axis, 3, 150)
    write(axis.od, 0x1800, 5, 10, 0)
    write(axis.od, 0x1800, 1, 0x185, 20 * MS)
    assert [at for at, _ in passing(axis.pdos, 60 * MS)] == [20 * MS, 35 * MS, 50 * MS]


def test_a_late_call_sends_all_that_was_due() -> None:
    """Each on the grid of the due instants."""
    axis = Axis()
    write(axis.od, 0x1800, 5, 10, 0)
    assert len(axis.pdos.advance(35 * MS)) == 3
    assert axis.pdos.deadline() == 40 * MS


@pytest.mark.slow
@settings(max_examples=60, deadline=None)
@given(
    gaps=st.lists(st.integers(0, 5_000), min_size=1, max_size=30),
    inhibit=st.integers(0, 30),
)
def test_after_any_burst_the_last_value_is_sent_and_gaps_are_kept(
    gaps: list[int], inhibit: int
) -> None:
    """Oracle: distances are at least the inhibit time; the last frame has the last value."""
    axis = Axis()
    set_while_off(axis, 3, inhibit)
    write(axis.od, 0x1800, 1, 0x185, 0)
    sent = passing(axis.pdos, 0)
    now = 0
    for value, gap in enumerate(gaps, start=1):
        now += gap * US
        sent += passing(axis.pdos, now)
        axis.put(STATUS, value, now)
    sent = only(sent + passing(axis.pdos, now + 10 * MS))
    instants = [at for at, _ in sent]
    distances = [b - a for a, b in itertools.pairwise(instants)]
    assert all(distance >= inhibit * 100 * US for distance in distances)
    assert sent[-1][1].startswith(f"185#{len(gaps):02X}00")
    assert sent[-1][0] <= now + inhibit * 100 * US


# SYNC


def test_an_event_does_not_send_a_synchronous_pdo() -> None:
    """Nor does entering operational."""
    axis = Axis(tpdo=1, second=0)
    axis.put(STATUS, 1, 5)
    assert axis.first == []
    assert axis.pdos.deadline() is None


@pytest.mark.parametrize("n", [1, 2, 3, 240])
def test_type_n_is_sent_with_every_nth_sync(n: int) -> None:
    """With the values of that instant; the count starts on entering operational."""
    axis = Axis(tpdo=n, second=0)
    axis.tick(0)
    axis.enter(NmtState.PRE_OPERATIONAL, 0)
    axis.enter(NmtState.OPERATIONAL, 0)
    sent = []
    for number in range(1, 3 * n + 1):
        axis.put(STATUS, number, number)
        sent += [(number, text) for text in axis.tick(number)]
    assert only(sent) == [
        (k * n, f"185#{(k * n) & 0xFF:02X}{(k * n) >> 8:02X}00000000") for k in (1, 2, 3)
    ]


def test_type_0_is_sent_with_the_next_sync_after_a_change() -> None:
    """Once."""
    axis = Axis(tpdo=0, second=254)
    assert axis.tick(1) == []
    axis.put(STATUS, 7, 2)
    axis.put(STATUS, 8, 3)
    assert axis.tick(4) == ["185#080000000000"]
    assert axis.tick(5) == []


@pytest.mark.parametrize(
    ("start", "counters", "places"),
    [(4, [1, 2, 3, 4, 5, 6, 7, 8, 1], [3, 5, 7]), (1, [6, 7, 8, 1, 2, 3, 4], [3, 5])],
)
def test_the_first_pdo_has_the_start_value_of_the_counter(
    start: int, counters: list[int], places: list[int]
) -> None:
    """Then every n-th SYNC; others pass until the counter has come to it."""
    axis = Axis(tpdo=1, second=0, overflow=8)
    set_while_off(axis, 6, start)
    write(axis.od, 0x1800, 2, 2)
    write(axis.od, 0x1800, 1, 0x185)
    assert [n for n, counter in enumerate(counters) if axis.tick(n, counter)] == places


def test_a_start_value_without_counter_has_no_effect() -> None:
    """1019h = 0."""
    axis = Axis(tpdo=1, second=0)
    set_while_off(axis, 6, 4)
    write(axis.od, 0x1800, 1, 0x185)
    assert axis.tick(1) == ["185#000000000000"]


def test_the_event_timer_has_no_effect_on_a_synchronous_pdo() -> None:
    """It belongs to types 254 and 255."""
    axis = Axis(tpdo=1, second=0)
    write(axis.od, 0x1800, 5, 10, 0)
    assert axis.pdos.deadline() is None


def test_a_new_type_acts_at_once() -> None:
    """From event-driven to synchronous and back."""
    axis = Axis()
    write(axis.od, 0x1800, 2, 1, 5)
    assert axis.tick(6) == ["185#000000000000"]
    write(axis.od, 0x1800, 2, 255, 7)
    assert axis.tick(8) == []
    assert passing(axis.pdos, 9) == [(7, "185#000000000000")]


# Remote frames


@pytest.mark.parametrize("kind", [253, 254, 255])
def test_a_remote_frame_is_answered_with_the_values_of_now(kind: int) -> None:
    """253 is sent for nothing else."""
    axis = Axis(tpdo=kind)
    assert 0x185 in axis.pdos.listens_to()
    axis.od.put_number(STATUS, 0, 7)
    assert feed(axis.pdos, 5, REMOTE) == ["185#070000000000"]


def test_type_253_is_sent_for_nothing_else() -> None:
    """Neither on entering operational, nor by event, nor by SYNC."""
    axis = Axis(tpdo=253, second=252)
    assert axis.first == []
    axis.put(STATUS, 7, 5)
    assert axis.tick(6) == []
    assert axis.pdos.deadline() is None


@pytest.mark.parametrize("kind", [1, 252])
def test_a_synchronous_pdo_answers_with_what_it_sampled(kind: int) -> None:
    """At the last SYNC; before the first one with the values of now."""
    axis = Axis(tpdo=kind, second=0)
    axis.od.put_number(STATUS, 0, 1)
    assert feed(axis.pdos, 1, REMOTE) == ["185#010000000000"]
    axis.od.put_number(STATUS, 0, 2)
    axis.tick(2)
    axis.od.put_number(STATUS, 0, 3)
    assert feed(axis.pdos, 3, REMOTE) == ["185#020000000000"]


def test_bit_30_forbids_remote_frames() -> None:
    """They are not listened to either."""
    axis = Axis(tpdo=253)
    assert feed(axis.pdos, 1, Frame(0x285, remote=True, dlc=4)) == []
    assert 0x285 not in axis.pdos.listens_to()
    write(axis.od, 0x1800, 1, NO_RTR | 0x185)
    assert axis.pdos.listens_to() == {0x205}


def test_a_remote_frame_for_a_pdo_that_is_off_is_not_answered() -> None:
    """Bit 31."""
    axis = Axis(tpdo=253)
    write(axis.od, 0x1800, 1, OFF | 0x185)
    assert feed(axis.pdos, 1, REMOTE) == []


def test_a_communication_parameter_without_a_mapping_is_no_pdo() -> None:
    """Nothing is made of it."""
    od = ObjectDictionary([each for each in Axis().od.entries.values() if each.index != 0x1A00])
    pdos = PdoService(od, Reports(), SyncService(od, Reports()))
    assert [tpdo.parameters.index for tpdo in pdos.tpdos] == [0x1801, 0x1802]
