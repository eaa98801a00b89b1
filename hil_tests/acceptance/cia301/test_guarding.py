"""Node guarding and life guarding of a device (CiA 301 4.2.0, 7.2.8.3.2.1)."""

from __future__ import annotations

from itertools import pairwise

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from hil_tests.acceptance.cia301.guarding_steps import (
    answer_to,
    expect_answer,
    expect_event,
    expect_no_event,
    expect_none_while_fed,
    expect_reaction,
    expect_recovery,
    expect_register,
    expect_shown,
    poll,
    prepare_reaction,
)
from hil_tests.acceptance.cia301.steps import (
    BEHAVIOUR,
    GUARD_TIME,
    LIFE_FACTOR,
    PRODUCER,
    beats,
    go,
    guarded,
    needs_writable,
    reset,
    rule_of_missing,
    without_heartbeat,
)
from hil_tests.acceptance.nmt_steps import RUNNING_STATES, name_of
from hil_tests.api import (
    MS,
    Cia301Bench,
    Frame,
    Nmt,
    S,
    Sdo,
    Sheet,
    State,
    cobs,
    matchers,
    u8,
    u16,
)

GUARD_MS, FACTOR = 100, 3
LIFE_NS = GUARD_MS * FACTOR * MS


def start_guarded(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet, guard_ms: int = GUARD_MS, factor: int = FACTOR
) -> None:
    """A regular start with a life time; nobody has polled yet."""
    bench.needs_exclusive()
    needs_writable(sheet, (GUARD_TIME, 0), (LIFE_FACTOR, 0))
    bench.start()
    guarded(sdo, sheet, guard_ms, factor)


@pytest.mark.requirement("C-NG-02", "EC-01", "C-NG-10", "C-NG-03")
@pytest.mark.parametrize("state", RUNNING_STATES, ids=name_of)
def test_polls_are_answered_in_every_state(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet, state: State
) -> None:
    """With the state and a toggle bit that begins with 0 and alternates."""
    start_guarded(bench, sdo, sheet)
    go(bench, state)
    for turn in range(6):
        expect_answer(bench, state, turn % 2)
        bench.wait(GUARD_MS * MS)


@pytest.mark.requirement("C-NG-04", "EC-01", "C-NG-03")
def test_a_change_of_state_keeps_the_toggle_bit(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet
) -> None:
    """It alternates through all states."""
    start_guarded(bench, sdo, sheet)
    for turn in range(4):
        expect_answer(bench, State.PRE_OPERATIONAL, turn % 2)
    states = (*RUNNING_STATES, State.PRE_OPERATIONAL, State.STOPPED)
    for turn, state in enumerate(states):
        go(bench, state)
        request = poll(bench)
        byte = answer_to(bench, request, "C-NG-02")
        text = f"toggle bit {turn % 2} after {turn} changes of state; {byte:02X}h came"
        bench.check(byte >> 7 == turn % 2, text, since=request)


@pytest.mark.requirement("C-NG-04", "EC-01", "C-NG-03")
@pytest.mark.parametrize("command", cobs.RESETS, ids=name_of)
def test_a_reset_sets_the_toggle_bit_back(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet, command: Nmt
) -> None:
    """After an odd number of polls the first answer has 0 again."""
    start_guarded(bench, sdo, sheet)
    for turn in range(3):
        expect_answer(bench, State.PRE_OPERATIONAL, turn % 2)
    reset(bench, command)
    guarded(sdo, sheet, GUARD_MS, FACTOR)
    request = poll(bench)
    byte = answer_to(bench, request, "C-NG-02")
    text = f"toggle bit 0 after {name_of(command)}; the answer was {byte:02X}h"
    bench.check(byte >> 7 == 0, text, since=request)


@pytest.mark.requirement("C-NG-05", "EC-02")
def test_before_the_first_poll_there_is_no_event(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet
) -> None:
    """However long nobody polls."""
    start_guarded(bench, sdo, sheet)
    expect_no_event(bench, bench.now(), 10 * LIFE_NS, "C-NG-05")


@pytest.mark.requirement("C-NG-06", "C-NG-07", "EC-02", "C-EM-03", "C-EM-21")
@pytest.mark.parametrize(("guard_ms", "factor"), [(100, 3), (50, 2), (250, 1), (40, 10)])
def test_a_life_time_without_a_poll_is_an_event(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet, guard_ms: int, factor: int
) -> None:
    """EMCY 8130h when the life time is over, counted from the last poll, and once."""
    start_guarded(bench, sdo, sheet, guard_ms, factor)
    for turn in range(2):
        expect_answer(bench, State.PRE_OPERATIONAL, turn % 2)
        bench.wait(guard_ms * MS // 2)
    last = expect_answer(bench, State.PRE_OPERATIONAL, 0)
    emcy = expect_event(bench, last, guard_ms * factor * MS, "C-NG-06", "C-NG-07")
    expect_register(bench, sdo, emcy, "C-EM-21")
    expect_no_event(bench, emcy, 5 * guard_ms * factor * MS, "C-EM-02")


@pytest.mark.requirement("C-NG-07", "EC-02")
def test_polls_just_within_the_life_time_are_enough(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet
) -> None:
    """Ten polls with 90 % of the life time between them lead to no event."""
    start_guarded(bench, sdo, sheet)
    pause_ns = LIFE_NS * 9 // 10
    expect_none_while_fed(bench, lambda: poll(bench), 10, pause_ns, LIFE_NS, "C-NG-07")


@pytest.mark.requirement("C-NG-08", "EC-02")
def test_the_next_poll_ends_the_event(bench: Cia301Bench, sdo: Sdo, sheet: Sheet) -> None:
    """EMCY 0000h, 1001h is 0, and the next silence is an event again."""
    start_guarded(bench, sdo, sheet)
    last = poll(bench)
    expect_event(bench, last, LIFE_NS, "C-NG-06", "C-NG-07")
    again = poll(bench)
    expect_recovery(bench, again, "C-NG-08")
    register = sdo.number(0x1001)
    text = f"1001h is 00h once no error is left; it is {register:02X}h"
    bench.check(register == 0, text, requirement="C-EM-04")
    expect_event(bench, again, LIFE_NS, "C-NG-06", "C-NG-07")


@pytest.mark.requirement("C-EM-22", "EC-02", "C-NG-06")
@pytest.mark.parametrize("behaviour", [0, 1, 2])
def test_a_life_guarding_event_leads_where_1029h_says(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet, behaviour: int
) -> None:
    """From operational: 0 to pre-operational, 1 nowhere, 2 to stopped."""
    needs_writable(sheet, (BEHAVIOUR, 1))
    start_guarded(bench, sdo, sheet)
    prepare_reaction(bench, sdo, behaviour)
    last = poll(bench)
    expect_event(bench, last, LIFE_NS, "C-NG-06", "C-NG-07")
    expect_reaction(bench, sdo, behaviour, "C-EM-22")
    expect_shown(bench, behaviour, "C-EM-22")


@pytest.mark.requirement("C-EM-22", "EC-02")
def test_reaction_0_leaves_a_stopped_device_stopped(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet
) -> None:
    """It leads to pre-operational from operational alone."""
    needs_writable(sheet, (BEHAVIOUR, 1))
    start_guarded(bench, sdo, sheet)
    sdo.write(BEHAVIOUR, 1, u8(0), requirement="C-EM-22")
    go(bench, State.STOPPED)
    expect_answer(bench, State.STOPPED, 0)
    bench.wait(2 * LIFE_NS)
    request = poll(bench)
    byte = answer_to(bench, request, "C-NG-02")
    text = f"it is still stopped; the answer was {byte:02X}h"
    bench.check(byte & 0x7F == State.STOPPED.value, text, since=request)


@pytest.mark.requirement("C-NG-09", "EC-01")
def test_polls_for_others_are_not_answered(bench: Cia301Bench, sdo: Sdo, sheet: Sheet) -> None:
    """Remote frames on 700h + other node ids: its neighbours, and those a bit away."""
    start_guarded(bench, sdo, sheet)
    node_id = bench.node_id
    since = bench.now()
    others = {node_id ^ 1 << bit for bit in range(7)} | {node_id - 1, node_id + 1}
    for other in sorted(others - {0, 128}):
        bench.send(Frame(cobs.ERROR_CONTROL + other, remote=True, dlc=1))
    bench.never(matchers.anything(), after=since, for_ns=100 * MS)


@pytest.mark.requirement("C-NG-01", "C-NG-12", "EC-02")
@pytest.mark.parametrize(("guard_ms", "factor"), [(0, 3), (100, 0)])
def test_a_life_time_of_0_watches_nobody(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet, guard_ms: int, factor: int
) -> None:
    """0 in either object: no event after a poll; whether the poll is answered is written down."""
    start_guarded(bench, sdo, sheet, guard_ms, factor)
    request = poll(bench)
    matcher = matchers.cob(cobs.ERROR_CONTROL + bench.node_id)
    seen = bench.first(matcher, request, bench.now() + bench.profile.limits.guard_answer_ns)
    told = "is answered" if seen else "is ignored"
    text = f"a poll with 100Ch = {guard_ms} and 100Dh = {factor} {told}"
    bench.characteristic("C-NG-12", text)
    expect_no_event(bench, request, 5 * S, "C-NG-01")


@pytest.mark.requirement("C-NG-11", "EC-02")
def test_a_new_life_time_acts_while_it_runs(bench: Cia301Bench, sdo: Sdo, sheet: Sheet) -> None:
    """A longer one from the next poll on, a shorter one too."""
    start_guarded(bench, sdo, sheet)
    expect_answer(bench, State.PRE_OPERATIONAL, 0)
    for guard_ms in (400, 60):
        sdo.write(GUARD_TIME, 0, u16(guard_ms))
        last = poll(bench)
        expect_event(bench, last, guard_ms * FACTOR * MS, "C-NG-06", "C-NG-11")
        expect_recovery(bench, poll(bench), "C-NG-08")


@pytest.mark.requirement("EC-03", "C-HB-10")
def test_the_heartbeat_ends_guarding(bench: Cia301Bench, sdo: Sdo, sheet: Sheet) -> None:
    """1017h other than 0 ends life guarding: no event comes, and polls get no answer."""
    needs_writable(sheet, (PRODUCER, 0))
    start_guarded(bench, sdo, sheet)
    expect_answer(bench, State.PRE_OPERATIONAL, 0)
    beats(sdo, 1000)
    since = bench.now()
    expect_no_event(bench, since, 5 * LIFE_NS, "EC-03")
    without_heartbeat(sdo, sheet)
    request = poll(bench)
    answer_to(bench, request, "EC-03")


fates = st.lists(st.sampled_from(["poll", "no poll", "late poll"]), min_size=1, max_size=12)


@pytest.mark.requirement("EC-01", "EC-02", "C-NG-03", "C-NG-07")
@given(script=fates, factor=st.integers(1, 3))
@example(script=["poll", "no poll", "no poll", "no poll", "poll"], factor=2)
@example(script=["no poll", "no poll", "no poll", "poll"], factor=1)
def test_lost_and_late_polls(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet, script: list[str], factor: int
) -> None:
    """Whichever polls come late or not at all: answers alternate, events come when they must."""
    bench.begin_example()
    start_guarded(bench, sdo, sheet, GUARD_MS, factor)
    count, began_at = 0, bench.now()
    for fate in script:
        due = bench.now() + GUARD_MS * MS
        if fate != "no poll":
            bench.wait(60 * MS if fate == "late poll" else 0)
            expect_answer(bench, State.PRE_OPERATIONAL, count % 2, "EC-01")
            count += 1
        bench.wait_until(due)
    expect_events_of(bench, GUARD_MS * factor * MS, began_at)
    bench.check_monitors()


def expect_events_of(bench: Cia301Bench, life_ns: int, began_at: int) -> None:
    """There were as many life guarding events as silences of a life time, no more."""
    tolerance = bench.profile.limits.life_ns + bench.profile.limits.emcy_ns
    polls = [
        seen.at
        for seen in bench.frames_seen(bench.trace.index_at(began_at))
        if seen.own and seen.frame.remote
    ]
    gaps = [after - before for before, after in pairwise([*polls, bench.now()])]
    sure = sum(gap > life_ns + tolerance for gap in gaps)
    perhaps = sum(gap >= life_ns for gap in gaps)
    matcher = matchers.emcy(bench.node_id, code=0x8130)
    emcys = bench.collect(matcher, after=began_at, until=bench.now())
    text = f"{sure} to {perhaps} life guarding events; there were {len(emcys)}"
    rule = "EC-02" if emcys else rule_of_missing(bench, 0x8130, began_at, "EC-02")
    bench.check(sure <= len(emcys) <= perhaps, text, requirement=rule)
