"""The phases of a SYNC: what is taken and sampled in which order, and the window."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from node_model.frame import Frame
from node_model.nmt import NmtState
from node_model.node import MS, US
from tests.node_model.pdo.axis import CONTROL, Axis
from tests.node_model.services import passing, write


def test_received_data_are_taken_before_the_answers_are_sampled() -> None:
    """Phase 1: the set-point of this SYNC is in the actual value of this SYNC."""
    axis = Axis(rpdo=1, tpdo=1, second=1)
    axis.bring("0000 05000000", 7)
    assert axis.tick(10) == ["185#000005000000", "285#05000000"]


def test_what_changes_after_the_sync_waits_for_the_next() -> None:
    """The data are those of the instant of the SYNC, though they are sent later."""
    axis = Axis(tpdo=1, second=0, turnaround_ns=100 * US)
    assert axis.tick(0) == []
    axis.put(0x6041, 9, 10 * US)
    assert passing(axis.pdos, MS) == [(100 * US, "185#000000000000")]


def test_synchronous_pdos_are_sent_one_after_the_other() -> None:
    """Phase 2: each needs one turnaround."""
    axis = Axis(tpdo=1, second=1, turnaround_ns=100 * US)
    axis.tick(0)
    assert passing(axis.pdos, MS) == [
        (100 * US, "185#000000000000"),
        (200 * US, "285#00000000"),
    ]


def test_a_synchronous_pdo_that_misses_the_window_is_dropped() -> None:
    """Phase 3: the first is just in time, the second is not, and not with the next SYNC."""
    axis = Axis(tpdo=1, second=2, turnaround_ns=100 * US)
    write(axis.od, 0x1007, 0, 100)
    axis.tick(0)
    axis.tick(MS)
    assert passing(axis.pdos, 2 * MS) == [(1100 * US, "185#000000000000")]


def test_the_next_sync_takes_the_place_of_what_was_not_yet_sent() -> None:
    """Only the newest sample counts."""
    axis = Axis(tpdo=1, second=0, turnaround_ns=100 * US)
    axis.tick(0)
    axis.put(0x6041, 9, 10 * US)
    axis.tick(50 * US)
    assert passing(axis.pdos, MS) == [(150 * US, "185#090000000000")]


def test_leaving_operational_drops_what_was_sampled() -> None:
    """No PDO follows the change of state."""
    axis = Axis(tpdo=1, second=0, turnaround_ns=100 * US)
    axis.tick(0)
    axis.enter(NmtState.PRE_OPERATIONAL, 50 * US)
    assert passing(axis.pdos, MS) == []


def test_a_synchronous_rpdo_after_the_window_is_ignored() -> None:
    """Also its length; one at the very end counts."""
    axis = Axis(rpdo=1)
    write(axis.od, 0x1007, 0, 100)
    axis.tick(0)
    axis.bring("0100 00000000", 100 * US)
    axis.bring("0200 00000000", 100 * US + 1)
    axis.bring("", 100 * US + 1)
    axis.tick(MS)
    assert axis.od.number(CONTROL) == 1
    assert axis.reports.seen == []


def test_the_window_does_not_concern_event_driven_pdos() -> None:
    """Both ways."""
    axis = Axis(rpdo=255, tpdo=255)
    write(axis.od, 0x1007, 0, 100)
    axis.tick(0)
    axis.bring("0200 07000000", 500 * US)
    assert axis.od.number(CONTROL) == 2
    assert passing(axis.pdos, MS) == [(500 * US, "185#000007000000"), (500 * US, "285#07000000")]


def test_a_sync_outside_operational_leads_to_no_pdo() -> None:
    """SYNC works in pre-operational, PDOs do not."""
    axis = Axis(tpdo=1, second=1, state=NmtState.PRE_OPERATIONAL)
    assert axis.tick(0) == []
    assert passing(axis.pdos, MS) == []


def test_a_producer_follows_its_own_sync() -> None:
    """The SYNC goes first, its PDOs behind it."""
    axis = Axis(tpdo=1, second=0)
    write(axis.od, 0x1006, 0, 1000)
    write(axis.od, 0x1005, 0, 1 << 30 | 0x80)
    assert passing(axis.sync, MS) == [(MS, "080#"), (MS, "185#000000000000")]


RPDOS = st.lists(st.tuples(st.booleans(), st.integers(0, 1500)), max_size=30)


@pytest.mark.slow
@settings(max_examples=150, deadline=None)
@given(window_us=st.integers(0, 1000), steps=RPDOS, turnaround_us=st.integers(0, 400))
def test_any_phase_of_syncs_and_rpdos_keeps_the_window(
    window_us: int, steps: list[tuple[bool, int]], turnaround_us: int
) -> None:
    """Oracle on instants: what each SYNC brings into effect, and which answers are in time."""
    axis = Axis(rpdo=1, tpdo=1, second=1, turnaround_ns=turnaround_us * US)
    write(axis.od, 0x1007, 0, window_us)
    sent: list[tuple[int, str]] = []
    now = 0
    brought: list[tuple[int, int]] = []
    syncs: list[tuple[int, int]] = []
    for number, (is_sync, gap_us) in enumerate(steps, start=1):
        now += (gap_us + 1) * US
        sent += passing(axis.pdos, now - 1)
        if is_sync:
            sent += [(now, text) for text in axis.tick(now)]
            syncs.append((now, axis.od.number(CONTROL)))
        else:
            axis.bring(f"{number:02X}00 00000000", now)
            brought.append((now, number))
    sent += passing(axis.pdos, now + 10 * MS)

    window = window_us * US
    last = None
    control = 0
    for at, seen in syncs:
        for came, number in brought:
            after_last = last is None or came > last
            in_time = last is None or not window or came <= last + window
            if came < at and after_last and in_time:
                control = number
        assert seen == control
        last = at

    answers = []
    ends = [at for at, _ in syncs[1:]] + [now + 100 * MS]
    for (at, _), end in zip(syncs, ends, strict=False):
        for place, text in ((1, "185#000000000000"), (2, "285#00000000")):
            due = at + place * turnaround_us * US
            if due < end and (not window or due <= at + window):
                answers.append((due, text))
    assert sent == answers


# On a busy bus


def test_a_synchronous_pdo_that_the_bus_holds_back_is_taken_back() -> None:
    """When the window has closed, or the next SYNC has come; event-driven ones never are."""
    axis = Axis(tpdo=1, second=255)
    write(axis.od, 0x1007, 0, 100)
    own, other = Frame(0x185, bytes(6)), Frame(0x285, bytes(4))
    axis.tick(0)
    assert not axis.pdos.withdraws(own, 0, 100 * US)
    assert axis.pdos.withdraws(own, 0, 100 * US + 1)
    assert not axis.pdos.withdraws(other, 0, 100 * US + 1)
    axis.tick(MS)
    assert axis.pdos.withdraws(own, 0, MS)
    assert not axis.pdos.withdraws(own, MS, MS)


def test_what_was_not_asked_for_in_the_window_is_not_taken_back() -> None:
    """A remote frame may be answered at any time."""
    axis = Axis(tpdo=1)
    write(axis.od, 0x1007, 0, 100)
    own = Frame(0x185, bytes(6))
    assert not axis.pdos.withdraws(own, 0, 500 * US)
    axis.tick(0)
    assert not axis.pdos.withdraws(own, 200 * US, 500 * US)


def test_without_a_window_nothing_is_taken_back() -> None:
    """However long it waits."""
    axis = Axis(tpdo=1)
    axis.tick(0)
    axis.tick(1000 * MS)
    assert not axis.pdos.withdraws(Frame(0x185, bytes(6)), 0, 1000 * MS)
