"""The suite's own manager and the device (MGR): whatever the node sends, the manager knows it."""

from __future__ import annotations

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from hil_tests.acceptance.cia301.steps import (
    GUARD_TIME,
    LIFE_FACTOR,
    LIFE_GUARD_CODE,
    PRODUCER,
    beats,
    guarded,
    needs_writable,
    quick,
    rule_of_missing,
)
from hil_tests.acceptance.nmt_steps import RUNNING_STATES, name_of
from hil_tests.api import (
    MS,
    Cia301Bench,
    Event,
    Frame,
    Manager,
    Master,
    Nmt,
    NotApplicable,
    Sdo,
    Sheet,
    State,
    What,
    matchers,
    nmt_frame,
    u16,
)

TELLS = {
    State.OPERATIONAL: Manager.start,
    State.STOPPED: Manager.stop,
    State.PRE_OPERATIONAL: Manager.pre_operational,
}
SETTLED_NS = 350 * MS
"""Command, its effect, and a heartbeat of 100 ms that shows it."""
GUARD_MS, FACTOR = 100, 3


def managed(bench: Cia301Bench, sdo: Sdo, sheet: Sheet, manager: Master) -> None:
    """A device with a quick heartbeat, and a manager that watches it."""
    manager.meet()
    quick(bench, sdo, sheet)
    manager.heartbeat(300 * MS, written=True)
    manager.wait(SETTLED_NS)
    expect_no_reason(bench, manager)


def polled(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet, manager: Master, factor: int = FACTOR
) -> None:
    """A device without heartbeat, and a manager that guards it."""
    bench.needs_exclusive()
    needs_writable(sheet, (GUARD_TIME, 0), (LIFE_FACTOR, 0))
    manager.meet()
    bench.start()
    guarded(sdo, sheet, GUARD_MS, factor)
    manager.guard(GUARD_MS * MS, factor)
    since = bench.now()
    manager.wait(GUARD_MS * MS // 2)
    answer = matchers.cob(0x700 + bench.node_id, "a guarding answer")
    heard = bench.collect(answer, after=since, until=bench.now())
    bench.check(bool(heard), "guarding requests are answered", requirement="C-NG-02")
    manager.wait(FACTOR * GUARD_MS * MS)
    expect_no_reason(bench, manager)


def expect_no_reason(bench: Cia301Bench, manager: Master, missing: str = "C-HB-03") -> None:
    """The device has given no reason for an event; `missing` says that heartbeats come."""
    events = [event for event in manager.take_events() if event.what is not What.RESTART]
    told = [event.text for event in events]
    rule = rule_of(bench, events, missing)
    bench.check(not events, f"the device gives no reason for an event; {told}", requirement=rule)


def rule_of(bench: Cia301Bench, events: list[Event], missing: str = "C-HB-03") -> str:
    """What a device breaks that gives a reason for these events: a rule for the node (EC, C)."""
    if not events or events[0].what is not What.HEARTBEAT:
        return "EC-02" if events and events[0].what is What.LIFE_GUARDING else "EC-01"
    beats_seen = bench.collect(matchers.cob(0x700 + bench.node_id), after=0, until=bench.now())
    ill_formed = any(len(seen.frame.data) != 1 for seen in beats_seen)
    return "C-HB-02" if ill_formed or "bit 7" in events[0].text else missing


def expect_one_boot_up(bench: Cia301Bench, since: int) -> None:
    """A reset was followed by one boot-up (C-NMT-13)."""
    bench.wait(300 * MS)
    boots = bench.collect(matchers.boot_up(bench.node_id), after=since, until=bench.now())
    text = f"one boot-up follows a reset; there were {len(boots)}"
    bench.check(len(boots) == 1, text, requirement="C-NMT-13")


def kinds(manager: Master) -> list[tuple[What, bool]]:
    """What has happened since this was last asked."""
    return [(event.what, event.over) for event in manager.take_events()]


@pytest.mark.requirement("MGR-01", "MGR-02")
@pytest.mark.parametrize("state", RUNNING_STATES, ids=name_of)
def test_commands_of_the_manager_are_obeyed(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet, manager: Master, state: State
) -> None:
    """Start, stop and pre-operational: the manager learns from the heartbeat where they led."""
    managed(bench, sdo, sheet, manager)
    manager.tell(TELLS[state])
    manager.wait(SETTLED_NS)
    text = f"the manager knows {state}; it knows {manager.state}"
    bench.check(manager.state is state, text, requirement="MGR-02")


@pytest.mark.requirement("MGR-01", "MGR-08")
@pytest.mark.parametrize("command", [Manager.reset, Manager.reset_communication])
def test_resets_of_the_manager_are_obeyed(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet, manager: Master, command: object
) -> None:
    """Both lead to a boot-up, which the manager tells as the restart that it asked for."""
    managed(bench, sdo, sheet, manager)
    manager.wait(SETTLED_NS)
    manager.take_events()
    since = bench.now()
    ask = Manager.reset if command is Manager.reset else Manager.reset_communication
    manager.tell(ask)
    manager.wait(bench.profile.limits.boot_up_ns)
    expect_one_boot_up(bench, since)
    restarts = [event for event in manager.take_events() if event.what is What.RESTART]
    text = f"one restart, as commanded; there were {restarts}"
    bench.check(len(restarts) == 1 and restarts[0].asked, text, requirement="MGR-01")


@pytest.mark.requirement("MGR-02")
def test_the_manager_learns_the_state_from_a_boot_up(bench: Cia301Bench, manager: Master) -> None:
    """Boot-up means pre-operational; before it nothing is known."""
    manager.meet()
    bench.fresh()
    bench.check(manager.state is None, "nothing is known of a node that said nothing")
    manager.meet()
    bench.boot()
    found = manager.state
    bench.check(found is State.PRE_OPERATIONAL, f"boot-up is pre-operational; it is {found}")


@pytest.mark.requirement("MGR-03", "MGR-02")
def test_commands_on_the_bus_are_no_states(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet, manager: Master
) -> None:
    """NMT frames for others and to nobody leave what the manager knows as it was."""
    bench.needs_exclusive()
    managed(bench, sdo, sheet, manager)
    manager.wait(SETTLED_NS)
    known = manager.state
    bench.check(known is not None, "the manager knows the state", requirement="MGR-02")
    other = bench.node_id % 127 + 1
    for frame in (
        nmt_frame(Nmt.START, other),
        nmt_frame(Nmt.STOP, other),
        Frame(0, bytes((0x05, other))),
        Frame(0, bytes((0x04, other))),
    ):
        bench.send(frame)
        manager.manager.update(frame, bench.now())
        found = manager.state
        text = f"{frame} is no state of the node; the manager knows {found}, not {known}"
        bench.check(found is known, text)


@pytest.mark.requirement("MGR-04", "C-HB-03")
def test_a_written_producer_time_starts_the_heartbeat_at_once(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet, manager: Master
) -> None:
    """The manager awaits the first beat one period after the write, and none is missing."""
    needs_writable(sheet, (PRODUCER, 0))
    manager.meet()
    bench.start()
    beats(sdo, 0)
    sdo.write(PRODUCER, 0, u16(100), requirement="C-HB-01")
    _, most = bench.profile.limits.heartbeat_each_ns(100 * MS)
    manager.heartbeat(most, written=True)
    manager.wait(1000 * MS)
    expect_no_reason(bench, manager)
    state = manager.state
    bench.check(
        state is not None, f"the manager hears the heartbeat; {state}", requirement="MGR-04"
    )


@pytest.mark.requirement("MGR-04", "C-HB-13")
def test_a_stored_producer_time_starts_with_the_boot_up(
    bench: Cia301Bench, sdo: Sdo, manager: Master
) -> None:
    """The boot-up counts as the first beat, and none is missing after it."""
    bench.start()
    period_ms = sdo.number(PRODUCER)
    if not period_ms:
        raise NotApplicable("1017h is 0 from the start")
    manager.meet()
    _, most = bench.profile.limits.heartbeat_each_ns(period_ms * MS)
    manager.heartbeat(most)
    since = bench.now()
    manager.tell(Manager.reset)
    manager.wait(bench.profile.limits.boot_up_ns)
    manager.wait(3 * period_ms * MS)
    expect_one_boot_up(bench, since)
    expect_no_reason(bench, manager, "C-HB-13")
    state = manager.state
    bench.check(
        state is not None, f"the manager hears the heartbeat; {state}", requirement="MGR-04"
    )


@pytest.mark.requirement("MGR-05", "EC-01")
def test_a_guarded_node_gives_no_reason_for_an_event(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet, manager: Master
) -> None:
    """Two seconds of polls through all states: toggle bits alternate, states are right."""
    polled(bench, sdo, sheet, manager)
    for state in (*RUNNING_STATES, State.PRE_OPERATIONAL):
        manager.tell(TELLS[state])
        manager.wait(500 * MS)
        expect_no_reason(bench, manager)
        text = f"the manager knows {state}; it knows {manager.state}"
        bench.check(manager.state is state, text)


@pytest.mark.requirement("MGR-06", "EC-02", "C-NG-06")
def test_both_sides_tell_of_a_silence(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet, manager: Master
) -> None:
    """No polls: the device has a life guarding event, which the manager sees by its EMCY."""
    polled(bench, sdo, sheet, manager)
    manager.wait(500 * MS)
    manager.guard(0, 0)
    since = bench.now()
    bench.wait(2 * GUARD_MS * FACTOR * MS)
    found = [kind for kind in kinds(manager) if kind[0] is What.LIFE_GUARDING]
    text = f"the device tells a life guarding event; {found}"
    rule = "EC-02" if found else rule_of_missing(bench, LIFE_GUARD_CODE, since, "EC-02")
    bench.check(found == [(What.LIFE_GUARDING, False)], text, requirement=rule)
    manager.guard(GUARD_MS * MS, FACTOR)
    manager.wait(300 * MS)
    found = kinds(manager)
    text = f"and its end; {found}"
    bench.check((What.LIFE_GUARDING, True) in found, text, requirement="EC-02")


@pytest.mark.requirement("MGR-06")
def test_a_node_that_falls_silent_is_a_node_guarding_event(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet, manager: Master
) -> None:
    """A heartbeat ends guarding in the device: polls go unanswered for a life time."""
    needs_writable(sheet, (PRODUCER, 0))
    polled(bench, sdo, sheet, manager)
    manager.wait(500 * MS)
    manager.take_events()
    beats(sdo, 60_000)
    manager.wait(GUARD_MS * MS)  # one beat may come at once
    manager.take_events()
    manager.wait(2 * GUARD_MS * FACTOR * MS)
    found = kinds(manager)
    text = f"no answer for a life time is a node guarding event; {found}"
    bench.check(found == [(What.NODE_GUARDING, False)], text)


@pytest.mark.requirement("MGR-07")
def test_another_state_than_expected_is_a_node_guarding_event(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet, manager: Master
) -> None:
    """Somebody else stops the node: its answers are not what the manager expects."""
    polled(bench, sdo, sheet, manager)
    manager.wait(300 * MS)
    manager.take_events()
    bench.nmt(Nmt.STOP)
    manager.wait(300 * MS)
    found = kinds(manager)
    text = f"a state that the manager did not ask for is an event; {found}"
    bench.check(found == [(What.NODE_GUARDING, False)], text)
    manager.tell(Manager.stop)
    manager.wait(300 * MS)
    found = kinds(manager)
    bench.check(found == [(What.NODE_GUARDING, True)], f"it ends once it is right; {found}")


@pytest.mark.requirement("MGR-07")
def test_a_toggle_bit_that_does_not_alternate_is_a_node_guarding_event(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet, manager: Master
) -> None:
    """Somebody else polls in between: the manager misses an answer and sees it by the bit."""
    polled(bench, sdo, sheet, manager)
    manager.wait(200 * MS)  # between two polls
    manager.take_events()
    before = manager.manager
    poll = bench.send(Frame(0x700 + bench.node_id, remote=True, dlc=1))
    answer = matchers.cob(0x700 + bench.node_id, "a guarding answer")
    within = bench.profile.limits.guard_answer_ns
    bench.expect(answer, after=poll, within=within, requirement="C-NG-02")
    manager.miss()
    manager.wait(100 * MS)
    texts = [event.text for event in before.take_events()]
    bench.check(any("toggle" in text for text in texts), f"a toggle bit is wrong; {texts}")


@pytest.mark.requirement("MGR-08")
def test_a_heartbeat_that_stays_away_and_comes_back(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet, manager: Master
) -> None:
    """Heartbeat off and on again: one event and its end."""
    managed(bench, sdo, sheet, manager)
    manager.wait(SETTLED_NS)
    manager.take_events()
    beats(sdo, 0)
    since = bench.now()
    manager.wait(1000 * MS)
    left = bench.collect(matchers.heartbeat(bench.node_id), after=since, until=bench.now())
    text = f"no heartbeat with 1017h = 0; there were {len(left)}"
    bench.check(not left, text, requirement="C-HB-06")
    found = kinds(manager)
    bench.check(found == [(What.HEARTBEAT, False)], f"one heartbeat event; {found}")
    beats(sdo, 100)
    manager.wait(SETTLED_NS)
    found = kinds(manager)
    bench.check(found == [(What.HEARTBEAT, True)], f"the next heartbeat ends it; {found}")


@pytest.mark.requirement("MGR-08", "C-NMT-13")
def test_a_restart_that_nobody_asked_for_is_told(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet, manager: Master
) -> None:
    """Somebody else resets the node: its boot-up is a restart."""
    managed(bench, sdo, sheet, manager)
    manager.wait(SETTLED_NS)
    manager.take_events()
    since = bench.now()
    bench.nmt(Nmt.RESET_NODE)
    manager.wait(bench.profile.limits.boot_up_ns)
    expect_one_boot_up(bench, since)
    restarts = [event for event in manager.take_events() if event.what is What.RESTART]
    text = f"one restart that was not asked for; {restarts}"
    bench.check([event.asked for event in restarts] == [False], text)


steps = st.lists(st.sampled_from(list(TELLS)), min_size=1, max_size=8)


@pytest.mark.requirement("MGR-02", "MGR-05", "MGR-07")
@given(script=steps)
@example(script=[State.STOPPED, State.OPERATIONAL, State.STOPPED])
def test_the_manager_follows_any_commands(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet, manager: Master, script: list[State]
) -> None:
    """Commands in any order under guarding: no event, and the last state is known."""
    bench.begin_example()
    polled(bench, sdo, sheet, manager)
    for state in script:
        manager.tell(TELLS[state])
        manager.wait(130 * MS)
    manager.wait(200 * MS)
    expect_no_reason(bench, manager)
    text = f"the manager knows {script[-1]}; it knows {manager.state}"
    bench.check(manager.state is script[-1], text, requirement="MGR-02")
    bench.check_monitors()
