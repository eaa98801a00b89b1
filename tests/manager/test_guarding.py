"""Node guarding: polls, toggle bit, life time, expected states (MGR-05 to MGR-07)."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from hil_tests.clock import MS
from hil_tests.judge.cobs import State
from hil_tests.manager import Event, Manager, What
from node_model.frame import Frame

GUARD_NS = 100 * MS
POLL = Frame(0x705, remote=True, dlc=1)


def guarding(factor: int = 3, *, booted: bool = True) -> Manager:
    """A manager that polls a node every 100 ms."""
    manager = Manager(5, settle_ns=50 * MS)
    if booted:
        manager.update(Frame(0x705, b"\x00"), 0)
    manager.guard(GUARD_NS, factor, 0)
    return manager


def reply(manager: Manager, byte: int, at: int) -> list[Event]:
    """The node replies; what the manager makes of it."""
    manager.update(Frame(0x705, bytes((byte,))), at)
    return manager.take_events()


def test_it_polls_at_once_and_then_every_guard_time() -> None:
    """With remote frames of one byte on 700h + id; too early a call changes nothing (MGR-05)."""
    manager = guarding()
    assert manager.deadline() == 0
    assert manager.advance(0) == (POLL,)
    assert manager.advance(GUARD_NS - 1) == ()
    assert manager.advance(GUARD_NS) == (POLL,)
    assert manager.deadline() == 2 * GUARD_NS


def test_a_late_host_delays_a_poll_and_never_the_schedule() -> None:
    """Polls that were missed altogether are left out."""
    manager = guarding(factor=0)
    manager.advance(0)
    assert manager.advance(3 * GUARD_NS + 5) == (POLL,)
    assert manager.deadline() == 4 * GUARD_NS


def test_replies_that_alternate_are_no_event() -> None:
    """Toggle bit 0 first after boot-up, then 1, then 0 (MGR-05)."""
    manager = guarding()
    for turn, byte in enumerate((0x7F, 0xFF, 0x7F, 0xFF)):
        manager.advance(turn * GUARD_NS)
        assert reply(manager, byte, turn * GUARD_NS + 1 * MS) == []
    assert manager.state is State.PRE_OPERATIONAL


def test_a_toggle_bit_that_does_not_alternate_is_an_event_each_time() -> None:
    """Also the very first, which is 0 after boot-up (MGR-07)."""
    manager = guarding()
    assert [event.what for event in reply(manager, 0xFF, 1)] == [What.NODE_GUARDING]
    assert [event.text for event in reply(manager, 0xFF, 2)] == [
        "toggle bit 1 in the reply, where 0 was due"
    ]
    assert reply(manager, 0x7F, 3) == []
    assert manager.lost == frozenset()


def test_the_first_reply_of_a_node_that_runs_already_may_have_either() -> None:
    """Nobody knows who polled it before; after a pause in guarding the same is true."""
    for byte in (0x7F, 0xFF):
        assert reply(guarding(booted=False), byte, 1) == []
    manager = guarding()
    reply(manager, 0x7F, 1)
    manager.guard(0, 0, 2)
    manager.guard(GUARD_NS, 3, 3)
    assert reply(manager, 0x7F, 4) == []


def test_a_boot_up_starts_the_toggle_bit_anew() -> None:
    """0 again, whatever it was (MGR-05); the boot-up itself is no reply."""
    manager = guarding()
    reply(manager, 0x7F, 1)
    assert [event.what for event in reply(manager, 0x00, 2)] == [What.RESTART]
    assert reply(manager, 0x7F, 3) == []


def test_no_reply_within_the_life_time_is_an_event() -> None:
    """From the first poll on, exactly then, once; the next reply ends it (MGR-06)."""
    manager = guarding(factor=3)
    for at in (0, 100 * MS, 200 * MS):
        manager.advance(at)
    manager.advance(300 * MS - 1)
    assert manager.take_events() == []
    assert manager.advance(300 * MS) == (POLL,)
    (event,) = manager.take_events()
    assert (event.what, event.at) == (What.NODE_GUARDING, 300 * MS)
    assert event.text == "no reply within the life time of 300 ms"
    for at in range(400 * MS, 900 * MS, 100 * MS):
        assert manager.advance(at) == (POLL,)
    assert manager.take_events() == []
    (over,) = reply(manager, 0x7F, 900 * MS)
    assert (over.what, over.over) == (What.NODE_GUARDING, True)


def test_every_reply_begins_the_life_time_anew() -> None:
    """Late replies are no event while they come within it (MGR-06)."""
    manager = guarding(factor=2)
    manager.advance(0)
    reply(manager, 0x7F, 190 * MS)
    manager.advance(389 * MS)
    assert manager.take_events() == []
    manager.advance(390 * MS)
    assert [event.at for event in manager.take_events()] == [390 * MS]


def test_without_a_factor_no_life_time_is_watched() -> None:
    """100Dh = 0 (MGR-06)."""
    manager = guarding(factor=0)
    for turn in range(100):
        manager.advance(turn * GUARD_NS)
    assert manager.take_events() == []
    assert reply(manager, 0x7F, 100 * GUARD_NS) == []


def test_another_state_than_expected_is_an_event_until_it_is_right() -> None:
    """From when the command had time to act; told once (MGR-07)."""
    manager = guarding()
    reply(manager, 0x7F, 10 * MS)
    manager.start(100 * MS)
    assert reply(manager, 0xFF, 149 * MS) == []
    (event,) = reply(manager, 0x7F, 150 * MS)
    assert event.what is What.NODE_GUARDING
    assert event.text == "the node shows pre-operational, expected was operational"
    assert reply(manager, 0xFF, 200 * MS) == []
    (over,) = reply(manager, 0x05, 300 * MS)
    assert (over.what, over.over) == (What.NODE_GUARDING, True)


def test_commands_in_a_row_leave_every_state_between_open_for_a_while() -> None:
    """A node that takes its time may still be where any of them led."""
    manager = guarding()
    manager.start(0)
    manager.stop(10 * MS)
    for byte in (0x7F, 0x85, 0x04):
        assert reply(manager, byte, 20 * MS) == []
    (event,) = reply(manager, 0x85, 60 * MS)
    assert "expected was stopped" in event.text


def test_before_anything_is_known_every_state_is_as_expected() -> None:
    """A node that is met while it runs, also shortly after its first command."""
    manager = guarding(booted=False)
    assert reply(manager, 0x05, 1) == []
    manager.stop(2)
    assert reply(manager, 0x85, 3) == []
    manager.reset(4)
    assert reply(manager, 0x04, 60 * MS) == []


def test_a_reply_that_shows_no_state_is_an_event() -> None:
    """06h is the state of nobody (MGR-07)."""
    manager = guarding()
    (event,) = reply(manager, 0x06, 1)
    assert event.text == "the node shows no state that there is, expected was pre-operational"


def test_heartbeat_and_guarding_exclude_each_other() -> None:
    """Whichever was asked for last counts (CiA 301, 7.2.8.3.2)."""
    manager = guarding()
    manager.heartbeat(100 * MS, 5)
    assert (manager.guarding, manager.deadline()) == (False, None)
    manager.guard(GUARD_NS, 3, 6)
    assert (manager.guarding, manager.deadline()) == (True, 6)
    reply(manager, 0x7F, 7)
    manager.advance(8)
    assert manager.deadline() == GUARD_NS + 6


lost_polls = st.lists(st.sampled_from(["heard", "poll lost", "reply lost", "late"]), max_size=40)


@given(lost_polls, st.integers(1, 5))
def test_the_events_are_those_that_the_bus_shows(fates: list[str], factor: int) -> None:
    """Whatever polls and replies are lost or late: one event for each broken promise, no other.

    A poll that is lost changes no toggle bit, a reply that is lost does; silence is told once
    it has lasted for the life time.
    """
    manager = guarding(factor)
    toggle = due = wrong = 0
    heard = [0]  # the first poll begins the life time
    for turn, fate in enumerate(fates):
        at = turn * GUARD_NS
        assert manager.advance(at) == (POLL,)
        if fate == "poll lost":
            continue
        byte, toggle = 0x7F | toggle << 7, 1 - toggle
        if fate == "reply lost":
            continue
        heard.append(at + (90 * MS if fate == "late" else 1 * MS))
        manager.advance(heard[-1])
        manager.update(Frame(0x705, bytes((byte,))), heard[-1])
        wrong += byte >> 7 != due
        due = 1 - (byte >> 7)
    ends = [*heard[1:], max(0, len(fates) - 1) * GUARD_NS]
    silent = sum(
        after - before >= factor * GUARD_NS for before, after in zip(heard, ends, strict=True)
    )
    events = [event for event in manager.take_events() if not event.over]
    assert sum("toggle" in event.text for event in events) == wrong
    assert sum("life time" in event.text for event in events) == silent
    assert len(events) == wrong + silent


@given(st.lists(st.integers(0, 500 * MS), max_size=30), st.integers(0, 3))
def test_it_keeps_the_laws_of_a_node(pauses: list[int], factor: int) -> None:
    """After advance(t) the deadline is later than t; before it nothing changes."""
    manager, now = guarding(factor), 0
    manager.heartbeat(70 * MS, 0, written=True)
    manager.guard(GUARD_NS, factor, 0)
    for pause in pauses:
        now += pause
        deadline = manager.deadline()
        assert deadline is not None
        if now < deadline:
            assert (manager.advance(now), manager.take_events()) == ((), [])
            assert manager.deadline() == deadline
            continue
        manager.advance(now)
        manager.take_events()
        later = manager.deadline()
        assert later is not None
        assert later > now
