"""The pre-defined error field 1003h: a list that pushes its oldest entry out."""

from __future__ import annotations

import pytest

from hil_tests.acceptance.drive.error_steps import (
    ERROR_FIELD,
    MOST,
    QUICK,
    change,
    count_of,
    emcy,
    expect_field,
    field,
    messages_after,
    register,
    shown,
    start_proven,
)
from hil_tests.api import MS, Cia301Bench, Faults, Sdo, accepted, number, u8


def cleared(bench: Cia301Bench, sdo: Sdo) -> None:
    """A start, with an empty error field."""
    bench.start(QUICK)
    sdo.write(ERROR_FIELD, 0, u8(0), requirement="EM-05")


def come_and_go(bench: Cia301Bench, faults: Faults, name: str) -> None:
    """An error occurs and goes; what is told of it is another test's business."""
    messages_after(bench, faults.occur(name))
    messages_after(bench, faults.heal())


@pytest.mark.requirement("EM-04", "EM-05")
def test_the_newest_error_comes_first(bench: Cia301Bench, sdo: Sdo, faults: Faults) -> None:
    """Each error enters as 1003h:01 with its code; the others move down."""
    cleared(bench, sdo)
    right = list[int]()
    for name in (*faults.names[:4], faults.names[0]):
        come_and_go(bench, faults, name)
        right.insert(0, faults.known[name].code)
        expect_field(bench, sdo, right, name)


@pytest.mark.requirement("EM-04", "EM-05")
def test_errors_that_last_enter_as_well(bench: Cia301Bench, sdo: Sdo, faults: Faults) -> None:
    """Whether the ones before have gone or not."""
    cleared(bench, sdo)
    right = list[int]()
    for name in faults.names[:4]:
        messages_after(bench, faults.occur(name))
        right.insert(0, faults.known[name].code)
    expect_field(bench, sdo, right)


@pytest.mark.requirement("EM-04", "EM-05")
def test_the_oldest_error_falls_out(bench: Cia301Bench, sdo: Sdo, faults: Faults) -> None:
    """More errors than there is room for: the newest are there, in order, and no more."""
    cleared(bench, sdo)
    right = list[int]()
    room = 0
    for turn in range(MOST + 3):
        name = faults.names[turn % len(faults.names)]
        come_and_go(bench, faults, name)
        right.insert(0, faults.known[name].code)
        full = len(right) > room + 3
        room = room if full else min(len(field(sdo)), len(right))
        expect_field(bench, sdo, right[:room] if room else right, name)
        if full:
            break
    bench.characteristic("EM-04", f"the error field has room for {room} errors")


@pytest.mark.requirement("EM-04")
def test_an_entry_has_four_bytes(bench: Cia301Bench, sdo: Sdo, faults: Faults) -> None:
    """Code in the lower half; what the maker puts into the upper half is noted."""
    cleared(bench, sdo)
    name = faults.names[0]
    come_and_go(bench, faults, name)
    entry = sdo.read(ERROR_FIELD, 1, requirement="EM-04")
    bench.check(len(entry) == 4, f"1003h:01 has 4 bytes; it has {len(entry)}")
    code, found = faults.known[name].code, number(entry) & 0xFFFF
    bench.check(found == code, f"1003h:01 holds the code {code:04X}h; it holds {found:04X}h")
    bench.characteristic("EM-04", f"upper half of 1003h:01 for {name}: {number(entry) >> 16:04X}h")


@pytest.mark.requirement("EM-05", "C-EM-12")
def test_writing_0_clears_the_field(bench: Cia301Bench, sdo: Sdo, faults: Faults) -> None:
    """The list is empty, 1001h is what it was, and nothing is told."""
    start_proven(bench, sdo, faults)
    sdo.write(ERROR_FIELD, 0, u8(0), requirement="EM-05")
    count = count_of(sdo)
    bench.check(count == 0, f"1003h:00 is 0; it is {count}")
    for name in faults.names[:3]:
        messages_after(bench, faults.occur(name))
    before, began_at = register(sdo), bench.now()
    sdo.write(ERROR_FIELD, 0, u8(0), requirement="EM-05")
    count = count_of(sdo)
    bench.check(count == 0, f"1003h:00 is 0 once it is cleared; it is {count}")
    bench.never(emcy(bench), after=began_at, for_ns=300 * MS, requirement="C-EM-12")
    found = register(sdo)
    text = f"1001h stays {before:02X}h; it is {found:02X}h"
    bench.check(found == before, text, requirement="C-EM-12")
    change(bench, sdo, faults, frozenset())


@pytest.mark.requirement("EM-05")
def test_an_empty_field_has_nothing_to_read(bench: Cia301Bench, sdo: Sdo) -> None:
    """1003h:01 is refused while the list is empty."""
    cleared(bench, sdo)
    outcome = sdo.try_read(ERROR_FIELD, 1)
    sdo.expect_abort(outcome, accepted.HISTORY_EMPTY, "read of 1003h:01 while it is empty")


@pytest.mark.requirement("EM-05")
@pytest.mark.parametrize("value", [1, 2, 128, 255])
def test_writing_anything_else_is_refused(
    bench: Cia301Bench, sdo: Sdo, faults: Faults, value: int
) -> None:
    """And the list is what it was."""
    cleared(bench, sdo)
    for name in faults.names[:2]:
        messages_after(bench, faults.occur(name))
    before = field(sdo)
    outcome = sdo.try_write(ERROR_FIELD, 0, u8(value))
    sdo.expect_abort(outcome, accepted.HISTORY_COUNT, f"write of {value} to 1003h:00")
    after, count = field(sdo), count_of(sdo)
    bench.check(after == before, f"1003h holds {shown(before)} as before; it holds {shown(after)}")
    bench.check(count == len(before), f"1003h:00 is still {len(before)}; it is {count}")
