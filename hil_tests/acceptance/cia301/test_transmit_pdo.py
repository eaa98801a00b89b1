"""TPDOs of any device that lets them be set up (CiA 301 4.2.0, 7.2.2 and 7.5.2.37)."""

from __future__ import annotations

from itertools import pairwise

import pytest

from hil_tests.acceptance.cia301.pdo_steps import (
    EVENT,
    INVALID,
    NO_RTR,
    SENT,
    SYNCHRONOUS,
    answered,
    change,
    expect_default_ids,
    find,
    mappable,
    one_mappable,
    quiet_others,
    sending,
    set_up,
    sync,
    timed,
    wrong_in,
)
from hil_tests.acceptance.cia301.steps import TPDO, go, needs_writable
from hil_tests.api import (
    MS,
    Abort,
    Cia301Bench,
    EdsObject,
    Frame,
    Limits,
    NotApplicable,
    Sdo,
    Sheet,
    State,
    accepted,
    judge_periodic,
    matchers,
    u8,
    u16,
    u32,
)

RESERVED_TYPES = (241, 245, 251)
DEFAULT_IDS = {0x1800: 0x180, 0x1801: 0x280, 0x1802: 0x380, 0x1803: 0x480}


@pytest.mark.requirement("C-TP-01")
def test_default_identifiers_are_those_of_the_node(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet
) -> None:
    """180h, 280h, 380h and 480h + node id, unless somebody stored others."""
    bench.start()
    expect_default_ids(bench, sdo, sheet, DEFAULT_IDS, "C-TP-01")


@pytest.mark.requirement("C-TP-01", "C-NMT-14", "C-NMT-16")
def test_it_is_sent_in_operational_alone(bench: Cia301Bench, sdo: Sdo, sheet: Sheet) -> None:
    """SYNC brings it there, and in no other state."""
    _, _, can_id = sending(bench, sdo, sheet, SYNCHRONOUS)
    matcher = matchers.cob(can_id, f"TPDO {can_id:03X}h")
    bench.never(matcher, after=sync(bench), for_ns=50 * MS)
    go(bench, State.OPERATIONAL)
    answered(bench, can_id, sync(bench), "C-TP-04")
    go(bench, State.STOPPED)
    bench.never(matcher, after=sync(bench), for_ns=50 * MS)


@pytest.mark.requirement("C-TP-01", "C-PC-12")
def test_bit_31_makes_it_invalid(bench: Cia301Bench, sdo: Sdo, sheet: Sheet) -> None:
    """At once, and valid again at once."""
    index, _, can_id = sending(bench, sdo, sheet, SYNCHRONOUS)
    go(bench, State.OPERATIONAL)
    answered(bench, can_id, sync(bench), "C-TP-04")
    value = sdo.number(index, 1)
    sdo.write(index, 1, u32(value | INVALID))
    matcher = matchers.cob(can_id, f"TPDO {can_id:03X}h")
    bench.never(matcher, after=sync(bench), for_ns=50 * MS)
    sdo.write(index, 1, u32(value))
    answered(bench, can_id, sync(bench), "C-PC-12")


def small(sheet: Sheet) -> list[EdsObject]:
    """Objects of different sizes that fit together into eight bytes."""
    chosen: list[EdsObject] = []
    sizes: set[int] = set()
    for one in mappable(sheet, SENT):
        room = 8 - sum(each.kind.size for each in chosen)
        if one.kind.size not in sizes and one.kind.size <= room and len(chosen) < 4:
            chosen.append(one)
            sizes.add(one.kind.size)
    if not chosen:
        raise NotApplicable("the device has no object that can be mapped and written")
    return chosen


@pytest.mark.requirement("C-TP-02", "C-TP-03", "C-PC-04")
def test_it_carries_what_is_mapped(bench: Cia301Bench, sdo: Sdo, sheet: Sheet) -> None:
    """Numbers of several sizes, one after the other, low bytes first, as SDO reads them."""
    bench.needs_exclusive()
    bench.needs_writes("application objects are written")
    index, objects = find(sheet, TPDO), small(sheet)
    bench.start()
    quiet_others(sdo, sheet, index)
    can_id = set_up(sdo, index, objects, SYNCHRONOUS)
    for turn, one in enumerate(objects):
        change(sdo, one, 0x12345678 * (turn + 1))
    go(bench, State.OPERATIONAL)
    seen = answered(bench, can_id, sync(bench), "C-TP-04")
    wanted = b"".join(sdo.read(one.index, one.sub) for one in objects)
    text = f"the TPDO carries {wanted.hex(' ')}; it was {seen.frame}"
    length = len(seen.frame.data) == len(wanted)
    bench.check(length, text, requirement="C-TP-02", since=seen)
    bench.check(seen.frame.data == wanted, text, requirement="C-TP-03", since=seen)


@pytest.mark.requirement("C-TP-04")
@pytest.mark.parametrize("every", [1, 2, 3, 240])
def test_type_n_sends_after_every_nth_sync(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet, every: int
) -> None:
    """n SYNCs apart, again and again; where the first comes is the device's choice."""
    _, _, can_id = sending(bench, sdo, sheet, every)
    go(bench, State.OPERATIONAL)
    rounds = 3 if every < 100 else 2
    counts: list[int] = []
    for count in range(1, rounds * every + 1):
        sent = sync(bench)
        until = sent.at + bench.profile.limits.sync_pdo_ns + 1 * MS
        seen = bench.first(matchers.cob(can_id), sent, until)
        if seen is not None:
            counts.append(count)
            answered(bench, can_id, sent, "C-TP-04")
    gaps = [later - sooner for sooner, later in pairwise(counts)]
    text = f"{rounds} TPDOs in {rounds * every} SYNCs, {every} apart; they came at {counts}"
    bench.check(len(counts) == rounds and set(gaps) <= {every}, text)


@pytest.mark.requirement("C-TP-05")
def test_type_0_sends_nothing_where_nothing_happened(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet
) -> None:
    """Five SYNCs without a change bring none; a change brings one at most."""
    _, one, can_id = sending(bench, sdo, sheet, 0)
    go(bench, State.OPERATIONAL)
    matcher = matchers.cob(can_id, f"TPDO {can_id:03X}h")
    for _ in range(2):
        sync(bench)
        bench.wait(20 * MS)
    for _ in range(5):
        bench.never(matcher, after=sync(bench), for_ns=20 * MS)
    since = bench.now()
    change(sdo, one, 0x5A)
    for _ in range(3):
        sync(bench)
        bench.wait(20 * MS)
    count = len(bench.collect(matcher, after=since, until=bench.now()))
    bench.check(count <= 1, f"one TPDO at most after a change; there were {count}")
    told = "an event" if count else "no event"
    bench.characteristic("C-TP-05", f"a write by SDO is {told} for type 0")


@pytest.mark.requirement("C-TP-06")
@pytest.mark.parametrize("kind", RESERVED_TYPES)
def test_reserved_types_are_refused(bench: Cia301Bench, sdo: Sdo, sheet: Sheet, kind: int) -> None:
    """241 to 251; the type is kept."""
    index = find(sheet, TPDO)
    bench.start()
    sdo.write(index, 1, u32(sdo.number(index, 1) | INVALID), requirement="C-PC-04")
    before = sdo.number(index, 2)
    outcome = sdo.try_write(index, 2, u8(kind))
    sdo.expect_abort(outcome, accepted.INVALID_VALUE, f"type {kind}")
    after = sdo.number(index, 2)
    text = f"the type is still {before}; it is {after}"
    bench.check(after == before, text, requirement="C-OD-13")


@pytest.mark.requirement("C-TP-07")
def test_what_it_sends_on_entering_operational_is_written_down(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet
) -> None:
    """An event-driven TPDO, when the device becomes operational."""
    _, _, can_id = sending(bench, sdo, sheet, EVENT)
    sent = go(bench, State.OPERATIONAL)
    seen = bench.first(matchers.cob(can_id), sent, bench.now() + 100 * MS)
    told = "is sent" if seen else "is not sent"
    bench.characteristic("C-TP-07", f"an event-driven TPDO {told} on entering operational")


@pytest.mark.requirement("C-TP-08", "C-PC-12")
@pytest.mark.parametrize("timer_ms", [20, 100])
def test_the_event_timer_sends_it_again_and_again(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet, timer_ms: int
) -> None:
    """In that period, each interval; 0 ends it."""
    index, _, can_id = timed(bench, sdo, sheet, timer_ms)
    matcher = matchers.cob(can_id, f"TPDO {can_id:03X}h")
    patience_ns = 2 * timer_ms * MS + 200 * MS
    found = bench.beats(matcher, 23, after=bench.now(), patience_ns=patience_ns)
    bench.check(len(found) == 23, f"23 TPDOs in a row; there were {len(found)}")
    limits, period_ns = bench.profile.limits, timer_ms * MS
    verdict = judge_periodic(
        f"TPDO with an event timer of {timer_ms} ms",
        [bench.when(seen) for seen in found],
        Limits(*limits.heartbeat_each_ns(period_ns)),
        Limits(*limits.heartbeat_mean_ns(period_ns)),
        "C-TP-08",
    )
    bench.conclude(verdict)
    sdo.write(index, 5, u16(0), requirement="C-PC-12")
    bench.wait(bench.profile.limits.event_pdo_ns)
    bench.never(matcher, after=bench.now(), for_ns=10 * timer_ms * MS)


@pytest.mark.requirement("C-TP-09", "C-TP-03")
def test_the_inhibit_time_keeps_events_apart(bench: Cia301Bench, sdo: Sdo, sheet: Sheet) -> None:
    """Ten changes in a row: TPDOs at least 50 ms apart, and the last value is sent at last."""
    index = find(sheet, TPDO)
    needs_writable(sheet, (index, 3))
    timer = [(5, u16(0))] if sheet.get(index, 5) else []
    _, one, can_id = sending(bench, sdo, sheet, EVENT, extra=[(3, u16(500)), *timer])
    go(bench, State.OPERATIONAL)
    bench.wait(200 * MS)
    since = bench.now()
    data, changed_at = b"", since
    for value in range(1, 11):
        changed_at = bench.now()
        data = change(sdo, one, value)
        bench.wait(3 * MS)
    bench.wait(50 * MS + bench.profile.limits.event_pdo_ns)
    found = bench.collect(matchers.cob(can_id), after=since, until=bench.now())
    if not found:
        raise NotApplicable("a write by SDO is no event of this device")
    least = bench.profile.limits.heartbeat_mean_ns(50 * MS)[0]
    for sooner, later in pairwise(found):
        text = "TPDOs with an inhibit time of 50 ms"
        bench.measure_between(sooner, later, Limits(least), text, since=sooner)
    last = found[-1].frame
    text = f"the last value {data.hex()} is sent at last; the last TPDO is {last}"
    bench.check(last.data == data, text, requirement=wrong_in(found[-1], changed_at, "C-TP-09"))


@pytest.mark.requirement("C-TP-10")
def test_the_inhibit_time_is_not_changed_while_it_is_valid(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet
) -> None:
    """It is refused, and kept."""
    index = find(sheet, TPDO)
    needs_writable(sheet, (index, 3))
    sending(bench, sdo, sheet, EVENT)
    before = sdo.number(index, 3)
    outcome = sdo.try_write(index, 3, u16(before + 10))
    sdo.expect_abort(outcome, accepted.VALUE_OR_STATE, "another inhibit time")
    after = sdo.number(index, 3)
    text = f"the inhibit time is still {before}; it is {after}"
    bench.check(after == before, text, requirement="C-OD-13")


@pytest.mark.requirement("C-TP-11")
def test_a_sync_start_value_begins_with_its_counter(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet
) -> None:
    """With a start value of 5 the first TPDO follows the SYNC with counter 5, then each."""
    index = find(sheet, TPDO)
    needs_writable(sheet, (index, 6), (0x1019, 0))
    sending(bench, sdo, sheet, SYNCHRONOUS)
    if sheet.get(0x1006) is not None:
        sdo.write(0x1006, 0, u32(0), requirement="C-SY-08")
    sdo.write(0x1019, 0, u8(10), requirement="C-SY-03")
    value = sdo.number(index, 1)
    sdo.write(index, 1, u32(value | INVALID), requirement="C-PC-04")
    sdo.write(index, 6, u8(5))
    sdo.write(index, 1, u32(value), requirement="C-PC-04")
    go(bench, State.OPERATIONAL)
    matcher = matchers.cob(value & 0x7FF, f"TPDO {value & 0x7FF:03X}h")
    for counter in (3, 4):
        bench.never(matcher, after=sync(bench, bytes((counter,))), for_ns=10 * MS)
    for counter in (5, 6, 7):
        answered(bench, value & 0x7FF, sync(bench, bytes((counter,))), "C-TP-11")


@pytest.mark.requirement("C-TP-11", "C-OD-13")
def test_a_start_value_is_a_counter_and_set_while_it_is_invalid(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet
) -> None:
    """Another is refused while the PDO is valid, 241 while it is not; the old one is kept."""
    index = find(sheet, TPDO)
    needs_writable(sheet, (index, 6))
    sending(bench, sdo, sheet, SYNCHRONOUS)
    before = sdo.number(index, 6)
    outcome = sdo.try_write(index, 6, u8(before ^ 1))
    sdo.expect_abort(outcome, accepted.VALUE_OR_STATE, "another SYNC start value")
    sdo.write(index, 1, u32(sdo.number(index, 1) | INVALID), requirement="C-PC-04")
    outcome = sdo.try_write(index, 6, u8(241))
    sdo.expect_abort(outcome, accepted.INVALID_VALUE, "a SYNC start value of 241")
    after = sdo.number(index, 6)
    text = f"the SYNC start value is still {before}; it is {after}"
    bench.check(after == before, text, requirement="C-OD-13")


@pytest.mark.requirement("C-TP-13")
def test_remote_requests_are_answered_where_bit_30_allows_it(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet
) -> None:
    """In operational alone. A device may refuse to allow them."""
    bench.needs_exclusive()
    index, one = find(sheet, TPDO), one_mappable(sheet, SENT)
    default = sheet.get(index, 1)
    bench.start()
    quiet_others(sdo, sheet, index)
    can_id = set_up(sdo, index, [one], SYNCHRONOUS)
    sdo.write(index, 1, u32(INVALID | NO_RTR | can_id), requirement="C-PC-04")
    outcome = sdo.try_write(index, 1, u32(can_id))
    if isinstance(outcome, Abort):
        raise NotApplicable("the device allows no remote requests for its TPDOs")
    matcher = matchers.cob(can_id, f"TPDO {can_id:03X}h")
    ask = Frame(can_id, remote=True, dlc=one.kind.size)
    expect_no_answer(bench, ask, matcher)
    go(bench, State.OPERATIONAL)
    asked = bench.send(ask)
    seen = bench.first(matcher, asked, bench.now() + bench.profile.limits.event_pdo_ns)
    unsupported = default is not None and default.default is not None
    unsupported = unsupported and bool(int(default.default.number) & NO_RTR)  # type: ignore[union-attr]
    if seen is None and unsupported:
        bench.characteristic("C-TP-13", "remote requests for TPDOs are never answered")
        return
    within = bench.profile.limits.event_pdo_ns
    bench.expect(matcher, after=asked, within=within)
    sdo.write(index, 1, u32(INVALID | can_id), requirement="C-PC-04")
    sdo.write(index, 1, u32(NO_RTR | can_id), requirement="C-PC-04")
    expect_no_answer(bench, ask, matcher)


def expect_no_answer(bench: Cia301Bench, ask: Frame, matcher: matchers.Matcher) -> None:
    """A remote request brings no TPDO; nothing else could have made the device send it."""
    asked = bench.send(ask)
    seen = bench.first(matcher, asked, asked.at + 50 * MS)
    told = seen.frame if seen else "nothing"
    bench.check(seen is None, f"{ask} is not answered; {told} came", since=asked)
