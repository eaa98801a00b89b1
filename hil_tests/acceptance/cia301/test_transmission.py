"""When TPDOs of any device come, and when no more (CiA 301 4.2.0, 7.2.2.5 and 7.5.2.37)."""

from __future__ import annotations

import pytest

from hil_tests.acceptance.cia301.pdo_steps import (
    EVENT,
    INVALID,
    MAPPING,
    NO_RTR,
    SYNCHRONOUS,
    answered,
    change,
    find,
    sending,
    sync,
    timed,
)
from hil_tests.acceptance.cia301.steps import TPDO, go
from hil_tests.api import (
    MS,
    Abort,
    Cia301Bench,
    NotApplicable,
    Sdo,
    Sheet,
    State,
    accepted,
    exactly,
    matchers,
    show_span,
    u8,
    u16,
    u32,
)

TIMER_MS = 20
RESERVED = 4
"""The sub-index of a communication parameter that means nothing."""
SYNCS = 30


@pytest.mark.requirement("C-TP-12")
def test_sub_index_4_does_not_exist(bench: Cia301Bench, sdo: Sdo, sheet: Sheet) -> None:
    """Reading it is refused. Older devices list it as a compatibility entry."""
    index = next((i for i in range(TPDO, TPDO + 0x200) if sheet.get(i, 1)), None)
    if index is None:
        raise NotApplicable("the device has no TPDO")
    bench.start()
    if sheet.get(index, RESERVED) is not None:
        bench.characteristic("C-TP-12", f"{index:04X}h:04 is listed as a compatibility entry")
        return
    outcome = sdo.try_read(index, RESERVED)
    sdo.expect_abort(outcome, accepted.NO_SUB_INDEX, f"a read of {index:04X}h:04")


@pytest.mark.requirement("C-TP-14")
@pytest.mark.parametrize("state", [State.PRE_OPERATIONAL, State.STOPPED], ids=str)
def test_after_operational_no_tpdo_is_asked_for(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet, state: State
) -> None:
    """An event timer that runs brings one that waited for the bus, at most."""
    _, _, can_id = timed(bench, sdo, sheet, TIMER_MS)
    matcher = matchers.cob(can_id, f"TPDO {can_id:03X}h")
    bench.expect(matcher, after=bench.now(), within=4 * TIMER_MS * MS, requirement="C-TP-08")
    left = go(bench, state)
    settled = left.at + bench.profile.limits.command_ns
    bench.never(matcher, after=settled, for_ns=10 * TIMER_MS * MS)


@pytest.mark.requirement("C-TP-15")
def test_how_soon_after_a_sync_it_comes_is_written_down(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet
) -> None:
    """The shortest and the longest of thirty."""
    _, _, can_id = sending(bench, sdo, sheet, SYNCHRONOUS)
    go(bench, State.OPERATIONAL)
    spans = []
    for _ in range(SYNCS):
        sent = sync(bench)
        seen = answered(bench, can_id, sent, "C-TP-04")
        spans.append(bench.when(seen).since(exactly(sent.at)))
        bench.wait(5 * MS)
    least = show_span(min(span.earliest for span in spans))
    most = show_span(max(span.latest for span in spans))
    bench.characteristic("C-TP-15", f"{SYNCS} SYNCs: {least} to {most} until the TPDO")


@pytest.mark.requirement("C-TP-16")
@pytest.mark.parametrize("pause_ms", [0, 7, 19, 23])
def test_after_a_burst_of_changes_the_last_value_was_sent(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet, pause_ms: int
) -> None:
    """However fast they come, and whatever the inhibit time lets through of those between."""
    index = find(sheet, TPDO)
    quiet = [(3, u16(200))] if sheet.get(index, 3) else []
    timer = [(5, u16(0))] if sheet.get(index, 5) else []
    _, one, can_id = sending(bench, sdo, sheet, EVENT, extra=[*quiet, *timer])
    go(bench, State.OPERATIONAL)
    bench.wait(100 * MS)
    for count in (1, 2, 3, 7):
        since, data = bench.now(), b""
        for value in range(count):
            data = change(sdo, one, 0x10 * count + value)
            bench.wait(pause_ms * MS)
        bench.wait(20 * MS + bench.profile.limits.event_pdo_ns)
        found = bench.collect(matchers.cob(can_id), after=since, until=bench.now())
        if not found and count == 1:
            raise NotApplicable("a write by SDO is no event of this device")
        last = found[-1].frame if found else "none"
        text = f"the last of {count} values, {data.hex()}, is sent at last; it was {last}"
        bench.check(bool(found) and found[-1].frame.data.startswith(data), text)


@pytest.mark.requirement("C-PC-10")
def test_what_an_empty_mapping_means_is_written_down(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet
) -> None:
    """A TPDO without objects: it is refused, or sends nothing, or frames without data."""
    index, _, can_id = sending(bench, sdo, sheet, SYNCHRONOUS)
    rule = {"requirement": "C-PC-04"}
    sdo.write(index, 1, u32(INVALID | NO_RTR | can_id), **rule)
    sdo.write(index + MAPPING, 0, u8(0), **rule)
    if isinstance(sdo.try_write(index, 1, u32(NO_RTR | can_id)), Abort):
        bench.characteristic("C-PC-10", "a TPDO without objects cannot be made valid")
        return
    go(bench, State.OPERATIONAL)
    sent = sync(bench)
    seen = bench.first(matchers.cob(can_id), sent, sent.at + 50 * MS)
    told = "sends nothing" if seen is None else f"sends {seen.frame}"
    bench.characteristic("C-PC-10", f"a valid TPDO without objects {told}")


@pytest.mark.requirement("C-PC-11")
def test_a_mapping_that_is_fixed_cannot_be_written(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet
) -> None:
    """Count and entries that the sheet lists as read-only are refused, and kept."""
    areas = (range(0x1600, 0x1800), range(0x1A00, 0x1C00))
    fixed = [o for o in sheet if any(o.index in area for area in areas) and not o.writable]
    if not fixed:
        raise NotApplicable(f"no mapping of the device is fixed: {sheet.file} lets all be written")
    bench.start()
    for one in fixed:
        before = sdo.read(one.index, one.sub)
        outcome = sdo.try_write(one.index, one.sub, before)
        sdo.expect_abort(outcome, accepted.READ_ONLY, f"a write to {one.place}")
        found = sdo.read(one.index, one.sub)
        bench.check(found == before, f"{one.place} is kept", requirement="C-OD-13")
