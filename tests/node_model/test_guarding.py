"""Node guarding as the guarded device does it: toggle bit, life time, event and recovery."""

from __future__ import annotations

import itertools

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from node_model.frame import Frame
from node_model.guarding import NodeGuarding
from node_model.nmt import NmtState
from node_model.node import MS, NOTHING
from node_model.od import ObjectDictionary
from tests.node_model.services import Reports, feed, passing, u8, u16, write

POLL = Frame(0x705, remote=True, dlc=1)


class Guarded:
    """A guarded device that started at 0: life time 100 ms x 3."""

    def __init__(self, guard_ms: int = 100, factor: int = 3, beat_ms: int = 0) -> None:
        self.od = ObjectDictionary(
            [u16(0x100C, 0, guard_ms), u8(0x100D, 0, factor), u16(0x1017, 0, beat_ms)]
        )
        self.reports = Reports()
        self.service = NodeGuarding(self.od, 5, self.reports)
        self.service.start(0)

    def poll(self, now: int) -> list[str]:
        """Its answers to one poll."""
        return feed(self.service, now, POLL)


def test_the_toggle_bit_starts_at_0_and_alternates() -> None:
    """Pre-operational 7Fh, then FFh, then 7Fh."""
    guarded = Guarded()
    answers = [text for now in range(3) for text in guarded.poll(now)]
    assert answers == ["705#7F", "705#FF", "705#7F"]


@pytest.mark.parametrize(
    ("state", "data"),
    [(NmtState.OPERATIONAL, "85"), (NmtState.STOPPED, "84"), (NmtState.PRE_OPERATIONAL, "FF")],
)
def test_a_change_of_state_shows_and_does_not_reset_the_toggle(state: NmtState, data: str) -> None:
    """Bits 0 to 6 are the state, in each state."""
    guarded = Guarded()
    guarded.poll(0)
    guarded.service.enter(state, 1)
    assert guarded.poll(2) == [f"705#{data}"]


def test_an_initialisation_resets_the_toggle() -> None:
    """The first answer after it has 0."""
    guarded = Guarded()
    guarded.poll(0)
    guarded.service.stop()
    guarded.service.start(10)
    assert guarded.poll(11) == ["705#7F"]


def test_an_initialisation_forgets_polls_and_events() -> None:
    """Nothing is due before it, after it, and without supply."""
    guarded = Guarded()
    assert NodeGuarding(guarded.od, 5, guarded.reports).deadline() is None
    guarded.poll(0)
    guarded.service.start(10)
    assert guarded.service.deadline() is None
    guarded.poll(20)
    guarded.service.stop()
    assert guarded.service.deadline() is None


def test_the_length_that_a_poll_asks_for_does_not_matter() -> None:
    """The answer has one byte."""
    assert feed(Guarded().service, 0, Frame(0x705, remote=True, dlc=8)) == ["705#7F"]


def test_only_polls_are_answered() -> None:
    """A data frame with that identifier is none, and it listens to no other identifier."""
    guarded = Guarded()
    assert feed(guarded.service, 0, Frame(0x705, b"\x7f")) == []
    assert guarded.service.deadline() is None
    assert guarded.service.listens_to() == frozenset((0x705,))


def test_the_heartbeat_has_precedence() -> None:
    """1017h is not 0: no answer, and nobody is watched."""
    guarded = Guarded(beat_ms=100)
    assert guarded.poll(0) == []
    assert guarded.service.deadline() is None
    write(guarded.od, 0x1017, 0, 0, 1)
    assert guarded.poll(2) == ["705#7F"]


def test_life_guarding_starts_with_the_first_poll() -> None:
    """Before it there is no event, however long nobody polls."""
    guarded = Guarded()
    assert guarded.service.deadline() is None
    guarded.poll(1000 * MS)
    assert guarded.service.deadline() == 1300 * MS


def test_no_poll_within_the_life_time_is_an_event_once() -> None:
    """8130h with bit 4 of the register, a communication error, exactly at its end."""
    guarded = Guarded()
    guarded.poll(0)
    guarded.poll(200 * MS)
    assert guarded.service.advance(500 * MS - 1) == NOTHING
    assert guarded.reports.seen == []
    assert passing(guarded.service, 10_000 * MS) == [(500 * MS, "085#3081")]
    ((now, _, fault),) = guarded.reports.seen
    assert fault is not None
    assert (now, fault.code, fault.register, fault.communication) == (500 * MS, 0x8130, 0x10, True)


def test_the_next_poll_ends_the_event_and_watching_goes_on() -> None:
    """It is answered, with the toggle bit where it was."""
    guarded = Guarded()
    guarded.poll(0)
    passing(guarded.service, 300 * MS)
    assert guarded.poll(400 * MS) == ["705#FF", "085#0000"]
    passing(guarded.service, 700 * MS)
    assert guarded.reports.codes == [(300 * MS, 0x8130), (400 * MS, 0), (700 * MS, 0x8130)]


@pytest.mark.parametrize(("guard_ms", "factor"), [(0, 3), (100, 0), (0, 0)])
def test_a_life_time_of_0_watches_nobody(guard_ms: int, factor: int) -> None:
    """Polls are answered all the same."""
    guarded = Guarded(guard_ms, factor)
    assert guarded.poll(0) == ["705#7F"]
    assert guarded.service.deadline() is None


@pytest.mark.parametrize(("index", "value", "life_ms"), [(0x100C, 50, 150), (0x100D, 1, 100)])
def test_a_new_life_time_counts_from_its_writing(index: int, value: int, life_ms: int) -> None:
    """Both objects act without a reset."""
    guarded = Guarded()
    guarded.poll(0)
    write(guarded.od, index, 0, value, 20 * MS)
    assert guarded.service.deadline() == (20 + life_ms) * MS


@pytest.mark.parametrize(("index", "value"), [(0x100C, 0), (0x100D, 0), (0x1017, 100)])
def test_who_ends_the_watching_ends_its_event(index: int, value: int) -> None:
    """By a life time of 0 or a heartbeat: due at that instant, no later event."""
    guarded = Guarded()
    guarded.poll(0)
    passing(guarded.service, 300 * MS)
    write(guarded.od, index, 0, value, 350 * MS)
    assert guarded.service.deadline() == 350 * MS
    assert passing(guarded.service, 10_000 * MS) == [(350 * MS, "085#0000")]
    assert guarded.reports.codes == [(300 * MS, 0x8130), (350 * MS, 0)]


def test_who_ends_the_watching_in_time_prevents_the_event() -> None:
    """None comes, and none ends."""
    guarded = Guarded()
    guarded.poll(0)
    write(guarded.od, 0x1017, 0, 100, 200 * MS)
    assert passing(guarded.service, 10_000 * MS) == []
    assert guarded.service.deadline() is None


def test_a_new_life_time_after_the_event_waits_for_a_poll() -> None:
    """The event stays."""
    guarded = Guarded()
    guarded.poll(0)
    passing(guarded.service, 300 * MS)
    write(guarded.od, 0x100C, 0, 10, 350 * MS)
    assert guarded.service.deadline() is None
    assert len(guarded.reports.active) == 1


@pytest.mark.slow
@settings(max_examples=100, deadline=None)
@given(gaps=st.lists(st.integers(1, 700), max_size=20))
def test_events_are_exactly_the_gaps_of_a_life_time(gaps: list[int]) -> None:
    """Oracle on the instants of all polls; a poll at the very end of the life time is late."""
    guarded = Guarded()
    now, polls = 0, [0]
    guarded.poll(0)
    for gap in gaps:
        now += gap
        passing(guarded.service, now * MS)
        guarded.poll(now * MS)
        polls.append(now)
    expected = []
    for before, after in itertools.pairwise(polls):
        if after - before >= 300:
            expected += [((before + 300) * MS, 0x8130), (after * MS, 0)]
    assert guarded.reports.codes == expected
