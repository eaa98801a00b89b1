"""Possible states over time, step by step."""

from __future__ import annotations

import pytest

from hil_tests.clock import Interval, exactly
from hil_tests.judge.cobs import Nmt, State
from hil_tests.judge.timeline import ANY_STATE, States, StateTimeline

COMMAND = 50
PRE: States = frozenset((State.PRE_OPERATIONAL,))
OP: States = frozenset((State.OPERATIONAL,))
STOPPED: States = frozenset((State.STOPPED,))
OFF: States = frozenset((State.OFF,))
BOOTING: States = frozenset((State.STARTING, State.PRE_OPERATIONAL))
WAITING: States = frozenset((State.STARTING, State.COMMISSIONING))


def at(timeline: StateTimeline, instant: int) -> States:
    """The states at an instant."""
    return timeline.possible(exactly(instant))


def test_nothing_is_known_at_first() -> None:
    """Before the first stimulus every state is possible."""
    timeline = StateTimeline(COMMAND)
    assert at(timeline, -1) == ANY_STATE
    assert timeline.sure(exactly(0)) is None


def test_a_command_may_act_until_its_limit() -> None:
    """Old and new state are both possible from its end to its limit."""
    timeline = StateTimeline(COMMAND, PRE)
    timeline.command(exactly(1000), Nmt.START)
    assert at(timeline, 999) == PRE
    assert at(timeline, 1000) == PRE | OP
    assert at(timeline, 1049) == PRE | OP
    assert at(timeline, 1050) == OP
    assert timeline.sure(Interval(1050, 2000)) is State.OPERATIONAL
    assert timeline.possible(Interval(999, 1050)) == PRE | OP


def test_a_command_of_doubtful_instant_acts_from_its_earliest_to_its_latest() -> None:
    """Its own doubt adds to the limit."""
    timeline = StateTimeline(COMMAND, PRE)
    timeline.command(Interval(1000, 1010), Nmt.STOP)
    assert at(timeline, 1059) == PRE | STOPPED
    assert at(timeline, 1060) == STOPPED


def test_a_command_into_the_same_state_changes_nothing() -> None:
    """Self transitions leave one state possible."""
    timeline = StateTimeline(COMMAND, PRE)
    timeline.command(exactly(1000), Nmt.PRE_OPERATIONAL)
    assert timeline.sure(Interval(0, 2000)) is State.PRE_OPERATIONAL


def test_two_commands_back_to_back() -> None:
    """The second may act before the first has; in the end it alone counts."""
    timeline = StateTimeline(COMMAND, PRE)
    timeline.command(exactly(1000), Nmt.START)
    timeline.command(exactly(1010), Nmt.STOP)
    assert at(timeline, 1005) == PRE | OP
    assert at(timeline, 1010) == PRE | OP | STOPPED
    assert at(timeline, 1059) == PRE | OP | STOPPED
    assert at(timeline, 1060) == STOPPED


def test_two_commands_at_the_same_instant() -> None:
    """Stamps may be equal; the later one still decides."""
    timeline = StateTimeline(COMMAND, PRE)
    timeline.command(exactly(1000), Nmt.START)
    timeline.command(exactly(1000), Nmt.STOP)
    assert at(timeline, 1000) == PRE | OP | STOPPED
    assert at(timeline, 1050) == STOPPED


@pytest.mark.parametrize("command", [Nmt.RESET_NODE, Nmt.RESET_COMMUNICATION])
def test_a_reset_leads_through_initialisation(command: Nmt) -> None:
    """Until boot-up the node starts or has just become pre-operational."""
    timeline = StateTimeline(COMMAND, OP)
    timeline.command(exactly(1000), command)
    assert at(timeline, 1020) == OP | BOOTING
    assert at(timeline, 1050) == BOOTING
    timeline.booted(exactly(1100))
    assert at(timeline, 1099) == BOOTING
    assert timeline.sure(exactly(1100)) is State.PRE_OPERATIONAL


def test_a_command_during_initialisation_may_be_lost() -> None:
    """After boot-up both what it commands and pre-operational are possible."""
    timeline = StateTimeline(COMMAND, PRE)
    timeline.command(exactly(1000), Nmt.RESET_NODE)
    timeline.command(exactly(1060), Nmt.START)
    timeline.booted(exactly(1100))
    assert at(timeline, 5000) == PRE | OP
    timeline.command(exactly(6000), Nmt.STOP)
    assert at(timeline, 6050) == STOPPED


def test_a_doubtful_command_may_be_obeyed_or_not() -> None:
    """Old and new state stay possible for ever."""
    timeline = StateTimeline(COMMAND, PRE)
    timeline.command(exactly(1000), Nmt.STOP, certain=False)
    assert at(timeline, 999) == PRE
    assert at(timeline, 9000) == PRE | STOPPED


@pytest.mark.parametrize("states", [OFF, frozenset((State.COMMISSIONING,))])
def test_without_a_listener_a_command_does_nothing(states: States) -> None:
    """A node without power, or in commissioning, obeys no NMT."""
    timeline = StateTimeline(COMMAND, states)
    timeline.command(exactly(1000), Nmt.START)
    assert at(timeline, 2000) == states


def test_power_off_forgets_what_was_planned() -> None:
    """A command that had not acted never will."""
    timeline = StateTimeline(COMMAND, PRE)
    timeline.command(exactly(1000), Nmt.START)
    timeline.power_off(Interval(1010, 1020))
    assert at(timeline, 1015) == PRE | OP | OFF
    assert at(timeline, 1020) == OFF
    assert at(timeline, 2000) == OFF


@pytest.mark.parametrize(
    ("commissioning", "states"),
    [(False, BOOTING), (True, WAITING), (None, WAITING | BOOTING)],
)
def test_power_on(commissioning: bool | None, states: States) -> None:
    """The keys held decide; where that is open, both are possible."""
    timeline = StateTimeline(COMMAND, OFF)
    timeline.power_on(Interval(1000, 1010), commissioning)
    assert at(timeline, 1005) == states | OFF
    assert at(timeline, 1010) == states


def test_boot_up_ends_commissioning_too() -> None:
    """Where both modes were possible, boot-up tells which it was."""
    timeline = StateTimeline(COMMAND, OFF)
    timeline.power_on(exactly(1000), None)
    timeline.booted(Interval(1090, 1100))
    assert at(timeline, 1100) == PRE


def test_an_interval_sees_every_step_in_it() -> None:
    """What was possible at some instant of it counts."""
    timeline = StateTimeline(COMMAND, PRE)
    timeline.command(exactly(1000), Nmt.START)
    timeline.command(exactly(2000), Nmt.STOP)
    assert timeline.possible(Interval(500, 2500)) == PRE | OP | STOPPED
    assert timeline.possible(Interval(1050, 1999)) == OP
