"""SYNC as a device produces and consumes it (CiA 301 4.2.0, 7.2.5 and 7.5.2.5)."""

from __future__ import annotations

import pytest

from hil_tests.acceptance.cia301.pdo_steps import SENT, SYNCHRONOUS, find, one_mappable, set_up
from hil_tests.acceptance.cia301.steps import (
    CYCLE,
    OVERFLOW,
    RESTRICTED,
    SYNC_ID,
    TIME_ID,
    TPDO,
    go,
    needs,
    needs_writable,
)
from hil_tests.api import (
    MS,
    Abort,
    Cia301Bench,
    Frame,
    Limits,
    NotApplicable,
    Sdo,
    Seen,
    Sheet,
    State,
    accepted,
    cobs,
    judge_periodic,
    matchers,
    u8,
    u32,
)

PRODUCES = 1 << 30
PERIOD_MS = 50
SYNC = matchers.cob(cobs.SYNC, "a SYNC")


def producing(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet, overflow: int = 0, period_ms: int = PERIOD_MS
) -> None:
    """The device produces SYNC.

    Raises:
        NotApplicable: it cannot.
    """
    bench.needs_exclusive()
    needs_writable(sheet, (SYNC_ID, 0), (CYCLE, 0))
    bench.start()
    if overflow:
        needs_writable(sheet, (OVERFLOW, 0))
        sdo.write(OVERFLOW, 0, u8(overflow), requirement="C-SY-03")
    sdo.write(CYCLE, 0, u32(period_ms * 1000), requirement="C-SY-02")
    outcome = sdo.try_write(SYNC_ID, 0, u32(PRODUCES | cobs.SYNC))
    if isinstance(outcome, Abort):
        raise NotApplicable("the device does not produce SYNC")


def row(
    bench: Cia301Bench, count: int, requirement: str, period_ms: int = PERIOD_MS
) -> list[Seen]:
    """SYNCs of the device, one after the other."""
    patience_ns = 2 * period_ms * MS + 100 * MS
    found = bench.beats(SYNC, count, after=bench.now(), patience_ns=patience_ns)
    text = f"{count} SYNCs in a row; there were {len(found)}"
    bench.check(len(found) == count, text, requirement=requirement)
    return found


@pytest.mark.requirement("C-SY-01")
def test_the_identifier_is_80h_by_default(bench: Cia301Bench, sdo: Sdo, sheet: Sheet) -> None:
    """And no bit but 30 is set besides."""
    needs(sheet, (SYNC_ID, 0))
    bench.start()
    value = sdo.number(SYNC_ID)
    text = f"1005h is 80h, with bit 30 at most; it is {value:08X}h"
    if not bench.stage.virtual and value & 0x7FF != cobs.SYNC:
        bench.characteristic("C-SY-01", text)
        return
    bench.check(value & ~(PRODUCES | 1 << 31) == cobs.SYNC, text)


@pytest.mark.requirement("C-SY-02", "C-SY-08", "C-SY-03")
@pytest.mark.parametrize("period_ms", [10, 50, 200])
def test_a_producer_keeps_its_period(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet, period_ms: int
) -> None:
    """Each interval and the mean; without a counter a SYNC has no data."""
    producing(bench, sdo, sheet, period_ms=period_ms)
    found = row(bench, 23, "C-SY-08", period_ms)
    limits, period_ns = bench.profile.limits, period_ms * MS
    verdict = judge_periodic(
        f"SYNC of {period_ms} ms",
        [bench.when(seen) for seen in found],
        Limits(*limits.heartbeat_each_ns(period_ns)),
        Limits(*limits.heartbeat_mean_ns(period_ns)),
        "C-SY-02",
    )
    bench.conclude(verdict)
    wrong = [str(seen.frame) for seen in found if seen.frame.data]
    bench.check(not wrong, f"a SYNC has no data; there was {wrong[:1]}", requirement="C-SY-03")


@pytest.mark.requirement("C-SY-03", "C-SY-04")
@pytest.mark.parametrize("overflow", [2, 5, 240])
def test_the_counter_goes_round(bench: Cia301Bench, sdo: Sdo, sheet: Sheet, overflow: int) -> None:
    """1, 2 and so on up to 1019h, then 1 again."""
    producing(bench, sdo, sheet, overflow, 5)
    found = row(bench, overflow + 3, "C-SY-08", 5)
    sizes = {len(seen.frame.data) for seen in found}
    text = f"a SYNC has one byte with 1019h = {overflow}; it has {sizes}"
    bench.check(sizes == {1}, text, requirement="C-SY-03")
    counters = [seen.frame.data[0] for seen in found]
    wanted = [(counters[0] - 1 + step) % overflow + 1 for step in range(len(counters))]
    text = f"counters go up to {overflow} and round; they were {counters[:8]}..."
    bench.check(counters == wanted, text, requirement="C-SY-04")


@pytest.mark.requirement("C-SY-05", "C-OD-13")
@pytest.mark.parametrize("overflow", [1, 241, 255])
def test_impossible_overflows_are_refused(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet, overflow: int
) -> None:
    """1 and 241 to 255; the value is kept."""
    needs_writable(sheet, (OVERFLOW, 0))
    bench.start()
    if sheet.get(CYCLE) is not None and sdo.number(CYCLE):
        sdo.write(CYCLE, 0, u32(0), requirement="C-SY-08")
    before = sdo.number(OVERFLOW)
    outcome = sdo.try_write(OVERFLOW, 0, u8(overflow))
    sdo.expect_abort(outcome, accepted.INVALID_VALUE, f"{overflow} in 1019h")
    after = sdo.number(OVERFLOW)
    text = f"1019h is still {before}; it is {after}"
    bench.check(after == before, text, requirement="C-OD-13")


@pytest.mark.requirement("C-SY-06")
def test_the_overflow_is_not_changed_while_there_is_a_period(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet
) -> None:
    """1019h is refused while 1006h is not 0."""
    needs_writable(sheet, (OVERFLOW, 0), (CYCLE, 0))
    bench.start()
    sdo.write(CYCLE, 0, u32(100_000), requirement="C-SY-02")
    outcome = sdo.try_write(OVERFLOW, 0, u8(10))
    sdo.expect_abort(outcome, accepted.DEVICE_STATE, "1019h with a period in 1006h")


@pytest.mark.requirement("C-SY-07")
def test_the_identifier_is_not_changed_while_it_produces(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet
) -> None:
    """And goes on as before."""
    producing(bench, sdo, sheet)
    row(bench, 3, "C-SY-08")
    outcome = sdo.try_write(SYNC_ID, 0, u32(PRODUCES | 0x81))
    sdo.expect_abort(outcome, accepted.INVALID_VALUE, "another identifier in 1005h")
    row(bench, 3, "C-SY-07")


@pytest.mark.requirement("C-SY-08")
@pytest.mark.parametrize("by", ["bit 30", "1006h"])
def test_it_starts_within_a_cycle_and_ends_at_once(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet, by: str
) -> None:
    """Ended by clearing bit 30 or with a period of 0."""
    producing(bench, sdo, sheet)
    started = bench.now()
    most = bench.profile.limits.heartbeat_each_ns(PERIOD_MS * MS)[1]
    bench.expect(SYNC, after=started, within=most)
    if by == "bit 30":
        sdo.write(SYNC_ID, 0, u32(cobs.SYNC))
    else:
        sdo.write(CYCLE, 0, u32(0))
    bench.never(SYNC, after=bench.now(), for_ns=20 * PERIOD_MS * MS)


@pytest.mark.requirement("C-SY-09", "C-NMT-16")
def test_it_is_produced_in_two_states(bench: Cia301Bench, sdo: Sdo, sheet: Sheet) -> None:
    """Pre-operational and operational; not in stopped, after which the counter begins anew."""
    producing(bench, sdo, sheet, 100)
    row(bench, 5, "C-SY-09")
    go(bench, State.OPERATIONAL)
    row(bench, 5, "C-SY-09")
    stopped = go(bench, State.STOPPED)
    since = stopped.at + bench.profile.limits.command_ns
    bench.never(SYNC, after=since, for_ns=10 * PERIOD_MS * MS, requirement="C-NMT-16")
    go(bench, State.PRE_OPERATIONAL)
    left = bench.collect(SYNC, after=since, until=bench.now())
    found = left or row(bench, 1, "C-SY-09")
    told = found[0].frame
    bench.check(told.data == b"\x01", f"the counter begins with 1; it was {told}")


@pytest.mark.requirement("C-SY-10")
@pytest.mark.parametrize("wrong", [b"\x01", bytes(8)], ids=["one-byte", "eight-bytes"])
def test_a_sync_of_a_wrong_length_is_none(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet, wrong: bytes
) -> None:
    """A TPDO of type 1 does not follow it, and follows the next right one."""
    bench.needs_exclusive()
    bench.needs_writes("application objects are written")
    index, one = find(sheet, TPDO), one_mappable(sheet, SENT)
    bench.start()
    if sheet.get(OVERFLOW) is not None and sdo.number(OVERFLOW):
        sdo.write(OVERFLOW, 0, u8(0), requirement="C-SY-03")
    can_id = set_up(sdo, index, [one], SYNCHRONOUS)
    go(bench, State.OPERATIONAL)
    matcher = matchers.cob(can_id, f"TPDO {can_id:03X}h")
    bench.never(matcher, after=bench.send(Frame(cobs.SYNC, wrong)), for_ns=50 * MS)
    right = bench.send(Frame(cobs.SYNC))
    within = bench.profile.limits.sync_pdo_ns
    bench.expect(matcher, after=right, within=within, requirement="C-TP-04")


@pytest.mark.requirement("C-PC-02")
@pytest.mark.parametrize("index", [SYNC_ID, TIME_ID], ids=["sync", "time"])
def test_restricted_identifiers_are_refused_for_sync_and_time(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet, index: int
) -> None:
    """While the device neither produces nor consumes it, and another identifier could be set."""
    needs_writable(sheet, (index, 0))
    bench.start()
    before = sdo.number(index)
    sdo.write(index, 0, u32(before & 0x7FF))
    for can_id in RESTRICTED:
        outcome = sdo.try_write(index, 0, u32(can_id))
        what = f"{can_id:03X}h in {index:04X}h"
        sdo.expect_abort(outcome, accepted.INVALID_VALUE, what)
    after = sdo.number(index)
    text = f"{index:04X}h is still {before & 0x7FF:X}h; it is {after:X}h"
    bench.check(after == before & 0x7FF, text, requirement="C-OD-13")


@pytest.mark.requirement("C-TI-01")
def test_the_time_object_is_as_it_should_be(bench: Cia301Bench, sdo: Sdo, sheet: Sheet) -> None:
    """1012h: 100h by default, bits 30 and 31 alone besides."""
    needs(sheet, (TIME_ID, 0))
    bench.start()
    value = sdo.number(TIME_ID)
    text = f"1012h is 100h, with bits 30 and 31 at most; it is {value:08X}h"
    if not bench.stage.virtual and value & 0x7FF != 0x100:
        bench.characteristic("C-TI-01", text)
        return
    bench.check(value & 0x3FFF_FFFF == 0x100, text)
