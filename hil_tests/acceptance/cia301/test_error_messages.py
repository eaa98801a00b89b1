"""EMCY, error register and error field, shown with a heartbeat that stays away (7.2.7)."""

from __future__ import annotations

import pytest

from hil_tests.acceptance.cia301.error_steps import trouble
from hil_tests.acceptance.cia301.steps import (
    EMCY_ID,
    ERROR_FIELD,
    ERROR_REGISTER,
    INHIBIT,
    LIFE_GUARD_CODE,
    RESTRICTED,
    expect_emcy,
    go,
    needs,
    needs_writable,
    reset,
)
from hil_tests.api import (
    MS,
    Cia301Bench,
    Frame,
    Limits,
    Sdo,
    Sheet,
    State,
    accepted,
    cobs,
    matchers,
    number,
    u8,
    u16,
    u32,
)

INVALID = 1 << 31


@pytest.mark.requirement("C-EM-01", "C-EM-03", "C-OD-02")
def test_an_emcy_has_its_identifier_and_eight_bytes(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet
) -> None:
    """On the identifier of 1014h, with the error register that SDO reads."""
    error = trouble(bench, sdo, sheet)
    value = sdo.number(EMCY_ID) if sheet.get(EMCY_ID) else 0x80 + bench.node_id
    began = error.arise()
    emcy = error.told(began, "C-EM-01")
    wanted = value & 0x7FF
    text = f"an EMCY on {wanted:03X}h; it came on {emcy.frame.can_id:03X}h"
    bench.check(emcy.frame.can_id == wanted, text)
    register = sdo.number(ERROR_REGISTER)
    text = f"the error register in {emcy.frame} is 1001h; that is {register:02X}h"
    bench.check(emcy.frame.data[2] == register, text, requirement="C-EM-03")
    in_order = bool(register & 0x01) and not register & 0x40
    text = f"1001h has bit 0 set with the others, and not bit 6; it is {register:02X}h"
    bench.check(in_order, text, requirement="C-OD-02")


@pytest.mark.requirement("C-EM-02", "C-EM-06")
def test_an_error_is_told_once_and_its_end_once(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet
) -> None:
    """No repetition while it lasts; its end is not told where it was not there."""
    error = trouble(bench, sdo, sheet)
    first = error.heal()
    no_error = matchers.emcy(bench.node_id, code=0)
    bench.never(no_error, after=first, for_ns=40 * MS, requirement="C-EM-06")
    began = error.arise()
    emcy = error.told(began, "C-EM-01")
    any_emcy = matchers.emcy(bench.node_id)
    bench.never(any_emcy, after=emcy, for_ns=2000 * MS, requirement="C-EM-02")


@pytest.mark.requirement("C-EM-04", "C-EM-21")
def test_the_end_of_the_last_error_is_told(bench: Cia301Bench, sdo: Sdo, sheet: Sheet) -> None:
    """EMCY 0000h with register 00h, and 1001h reads 00h."""
    error = trouble(bench, sdo, sheet)
    emcy = error.told(error.arise(), "C-EM-01")
    text = f"code 8130h goes with bit 4 of the register; it is {emcy.frame}"
    bench.check(bool(emcy.frame.data[2] & 0x10), text, requirement="C-EM-21")
    healed = error.heal()
    within = bench.profile.limits.emcy_ns + bench.profile.limits.life_ns
    over = expect_emcy(bench, 0, after=healed, within=within, requirement="C-EM-04")
    bench.check(over.frame.data[2] == 0, f"register 00h in it; it is {over.frame}")
    register = sdo.number(ERROR_REGISTER)
    bench.check(register == 0, f"1001h is 00h; it is {register:02X}h")


@pytest.mark.requirement("C-EM-06")
def test_a_reset_tells_no_end_of_errors(bench: Cia301Bench, sdo: Sdo, sheet: Sheet) -> None:
    """Reset while there is an error: EMCY 0000h neither before the boot-up nor after it."""
    error = trouble(bench, sdo, sheet)
    error.told(error.arise(), "C-EM-01")
    since = bench.now()
    reset(bench)
    no_error = matchers.emcy(bench.node_id, code=0)
    bench.never(no_error, after=since, for_ns=bench.now() - since + 500 * MS)


def history(sdo: Sdo) -> list[int]:
    """The entries of 1003h, newest first."""
    count = sdo.number(ERROR_FIELD, 0, requirement="C-EM-07")
    return [sdo.number(ERROR_FIELD, sub, requirement="C-EM-07") for sub in range(1, count + 1)]


@pytest.mark.requirement("C-EM-07", "C-EM-08", "C-EM-09", "C-EM-12")
def test_the_error_field_grows_and_can_be_emptied(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet
) -> None:
    """Each error is the newest entry, 0 empties the list, and nothing else comes of that."""
    needs(sheet, (ERROR_FIELD, 1))
    room = sum(one.index == ERROR_FIELD and one.sub > 0 for one in sheet)
    error = trouble(bench, sdo, sheet)
    sdo.write(ERROR_FIELD, 0, u8(0), requirement="C-EM-09")
    for turn in range(1, min(room, 3) + 2):
        error.told(error.arise(), "C-EM-01")
        entries = history(sdo)
        wanted = min(turn, room)
        text = f"{wanted} entries after {turn} errors; there are {len(entries)}"
        bench.check(len(entries) == wanted, text)
        codes = [f"{entry & 0xFFFF:04X}h" for entry in entries]
        same = all(entry & 0xFFFF == LIFE_GUARD_CODE for entry in entries)
        bench.check(same, f"each entry is 8130h in bits 0 to 15; {codes}", requirement="C-EM-08")
    register = sdo.number(ERROR_REGISTER)
    since = bench.now()
    sdo.write(ERROR_FIELD, 0, u8(0), requirement="C-EM-09")
    left = sdo.number(ERROR_FIELD, 0)
    bench.check(left == 0, f"1003h:00 is 0 once it was emptied; {left}", requirement="C-EM-09")
    after = sdo.number(ERROR_REGISTER)
    text = f"1001h is still {register:02X}h; it is {after:02X}h"
    bench.check(after == register, text, requirement="C-EM-12")
    emcy = matchers.emcy(bench.node_id)
    bench.never(emcy, after=since, for_ns=50 * MS, requirement="C-EM-12")


@pytest.mark.requirement("C-EM-10")
@pytest.mark.parametrize("value", [1, 2, 255])
def test_the_count_of_errors_takes_nothing_but_0(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet, value: int
) -> None:
    """And the list is kept."""
    needs(sheet, (ERROR_FIELD, 1))
    bench.start()
    before = history(sdo)
    outcome = sdo.try_write(ERROR_FIELD, 0, u8(value))
    sdo.expect_abort(outcome, accepted.HISTORY_COUNT, f"{value} to 1003h:00")
    bench.check(history(sdo) == before, "the list is kept")


@pytest.mark.requirement("C-EM-10", "C-OD-13")
def test_a_refused_count_leaves_the_errors_in_their_list(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet
) -> None:
    """A list with an error in it, and 1 to 1003h:00: it is refused, and the error is kept."""
    needs(sheet, (ERROR_FIELD, 1))
    error = trouble(bench, sdo, sheet)
    error.told(error.arise(), "C-EM-01")
    before = history(sdo)
    outcome = sdo.try_write(ERROR_FIELD, 0, u8(1))
    sdo.expect_abort(outcome, accepted.HISTORY_COUNT, "1 to 1003h:00")
    left = history(sdo)
    text = f"{len(before)} entries are kept after the refusal; there are {len(left)}"
    bench.check(left == before, text, requirement="C-OD-13")


@pytest.mark.requirement("C-EM-11")
def test_an_empty_error_field_has_no_entry(bench: Cia301Bench, sdo: Sdo, sheet: Sheet) -> None:
    """1003h:01 is refused while 1003h:00 is 0."""
    needs(sheet, (ERROR_FIELD, 1))
    bench.start()
    sdo.write(ERROR_FIELD, 0, u8(0), requirement="C-EM-09")
    outcome = sdo.try_read(ERROR_FIELD, 1)
    sdo.expect_abort(outcome, accepted.HISTORY_EMPTY, "read of 1003h:01 of an empty list")


@pytest.mark.requirement("C-EM-13")
def test_an_emcy_can_be_switched_off(bench: Cia301Bench, sdo: Sdo, sheet: Sheet) -> None:
    """With bit 31 of 1014h no EMCY is sent; 1001h and 1003h go on."""
    needs_writable(sheet, (EMCY_ID, 0))
    error = trouble(bench, sdo, sheet)
    with sdo.kept((EMCY_ID, 0)):
        sdo.write(EMCY_ID, 0, u32(sdo.number(EMCY_ID) | INVALID), requirement="C-EM-13")
        error.heal()  # SDO may have taken longer than the error takes to arise
        if sheet.get(ERROR_FIELD, 1):
            sdo.write(ERROR_FIELD, 0, u8(0), requirement="C-EM-09")
        began = error.arise()
        bench.never(matchers.emcy(bench.node_id), after=began, for_ns=300 * MS)
        register = sdo.number(ERROR_REGISTER)
        text = f"1001h shows the error nevertheless; it is {register:02X}h"
        bench.check(bool(register & 0x11), text)
        if sheet.get(ERROR_FIELD, 1):
            count = sdo.number(ERROR_FIELD, 0)
            bench.check(count == 1, f"1003h has the error nevertheless; {count} entries")
        error.heal()
        bench.wait(50 * MS)


@pytest.mark.requirement("C-EM-14")
def test_the_identifier_of_emcy_is_not_changed_while_it_is_valid(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet
) -> None:
    """Another one is refused, and the old one kept."""
    needs_writable(sheet, (EMCY_ID, 0))
    bench.start()
    before = sdo.number(EMCY_ID)
    if before & INVALID:
        sdo.write(EMCY_ID, 0, u32(0x80 + bench.node_id), requirement="C-EM-13")
        before = 0x80 + bench.node_id
    outcome = sdo.try_write(EMCY_ID, 0, u32((before & 0x7FF) ^ 0x01))
    sdo.expect_abort(outcome, accepted.EMCY_ID, "another identifier in 1014h")
    after = sdo.number(EMCY_ID)
    bench.check(after == before, f"1014h is still {before:08X}h; it is {after:08X}h")


@pytest.mark.requirement("C-EM-14")
def test_restricted_identifiers_are_refused_for_emcy(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet
) -> None:
    """While it is invalid, too."""
    needs_writable(sheet, (EMCY_ID, 0))
    bench.start()
    with sdo.kept((EMCY_ID, 0)):
        sdo.write(EMCY_ID, 0, u32(sdo.number(EMCY_ID) | INVALID), requirement="C-EM-13")
        for can_id in RESTRICTED:
            outcome = sdo.try_write(EMCY_ID, 0, u32(can_id))
            sdo.expect_abort(outcome, accepted.EMCY_ID, f"{can_id:03X}h in 1014h")


@pytest.mark.requirement("C-EM-15")
@pytest.mark.parametrize("inhibit", [500, 2000])
def test_the_inhibit_time_keeps_emcys_apart(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet, inhibit: int
) -> None:
    """An error and its end one after the other: the second EMCY waits, and comes."""
    needs_writable(sheet, (INHIBIT, 0))
    error = trouble(bench, sdo, sheet)
    sdo.write(INHIBIT, 0, u16(inhibit), requirement="C-EM-15")
    inhibit_ns = inhibit * 100_000
    error.keep_away(inhibit_ns)
    began = error.arise()
    emcy = error.told(began, "C-EM-01")
    error.heal()
    limits = bench.profile.limits
    least = limits.heartbeat_mean_ns(inhibit_ns)[0]
    most = inhibit_ns + limits.emcy_ns + limits.life_ns + 100 * MS
    matcher = matchers.emcy(bench.node_id, code=0)
    over = bench.first(matcher, emcy, emcy.at + most + 500 * MS)
    bench.check(over is not None, "the second EMCY comes", requirement="C-EM-04")
    assert over is not None
    text = f"EMCYs with 1015h = {inhibit}"
    bench.measure_between(emcy, over, Limits(least, most), text, since=emcy)


@pytest.mark.requirement("C-EM-17")
def test_no_emcy_is_sent_in_stopped(bench: Cia301Bench, sdo: Sdo, sheet: Sheet) -> None:
    """An error that arises there is not told there."""
    error = trouble(bench, sdo, sheet)
    began = error.heal()
    stopped = go(bench, State.STOPPED)
    matcher = matchers.any_of(frozenset((0x80 + bench.node_id,)), "an EMCY")
    bench.never(matcher, after=stopped, for_ns=500 * MS)
    go(bench, State.PRE_OPERATIONAL)
    bench.wait(50 * MS)
    told = bench.collect(matcher, after=began, until=bench.now())
    kept = "is told on leaving it" if told else "is not told later"
    bench.characteristic("C-EM-17", f"an error that arose in stopped {kept}")


@pytest.mark.requirement("C-EM-20", "C-SY-10")
def test_what_a_sync_of_a_wrong_length_leads_to_is_written_down(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet
) -> None:
    """Eight bytes where none are right: an EMCY, or nothing."""
    bench.needs_exclusive()
    bench.start()
    if sheet.get(0x1019) is not None and sdo.number(0x1019):
        sdo.write(0x1019, 0, u8(0), requirement="C-SY-03")
    go(bench, State.OPERATIONAL)
    sent = bench.send(Frame(cobs.SYNC, bytes(8)))
    emcy = matchers.emcy(bench.node_id)
    seen = bench.first(emcy, sent, bench.now() + 100 * MS)
    told = f"EMCY {number(seen.frame.data[:2]):04X}h" if seen else "no EMCY"
    bench.characteristic("C-EM-20", f"a SYNC of eight bytes leads to {told}")
