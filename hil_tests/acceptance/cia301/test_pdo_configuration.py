"""How PDOs are set up, and what is refused (CiA 301 4.2.0, 7.5.2.35 to 7.5.2.38)."""

from __future__ import annotations

import pytest

from hil_tests.acceptance.cia301.pdo_steps import (
    INVALID,
    MAPPING,
    NO_RTR,
    RECEIVED,
    SENT,
    SYNCHRONOUS,
    entry,
    find,
    one_mappable,
    set_up,
)
from hil_tests.acceptance.cia301.steps import RESTRICTED, RPDO, TPDO, first
from hil_tests.api import (
    Abort,
    Cia301Bench,
    EdsObject,
    NotApplicable,
    Sdo,
    Sheet,
    accepted,
    u8,
    u32,
)

EXTENDED = 1 << 29
DIRECTIONS = {"receive": (RPDO, RECEIVED), "transmit": (TPDO, SENT)}


def prepared(bench: Cia301Bench, sdo: Sdo, sheet: Sheet, direction: str) -> tuple[int, EdsObject]:
    """A started device with a valid PDO that maps one object: its parameter, the object."""
    base, access = DIRECTIONS[direction]
    index, one = find(sheet, base), one_mappable(sheet, access)
    bench.start()
    set_up(sdo, index, [one], SYNCHRONOUS)
    return index, one


def unlocked(sdo: Sdo, index: int) -> int:
    """The PDO is made invalid and its mapping emptied; the COB-ID that it had."""
    value = sdo.number(index, 1)
    sdo.write(index, 1, u32(value | INVALID), requirement="C-PC-04")
    sdo.write(index + MAPPING, 0, u8(0), requirement="C-PC-04")
    return value


@pytest.mark.requirement("C-PC-01", "C-OD-13")
@pytest.mark.parametrize("direction", DIRECTIONS)
def test_the_identifier_is_not_changed_while_it_is_valid(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet, direction: str
) -> None:
    """Another one is refused, and the old one kept."""
    index, _ = prepared(bench, sdo, sheet, direction)
    before = sdo.number(index, 1)
    outcome = sdo.try_write(index, 1, u32(before ^ 0x80))
    sdo.expect_abort(outcome, accepted.INVALID_VALUE, "another identifier")
    after = sdo.number(index, 1)
    text = f"the COB-ID is still {before:08X}h; it is {after:08X}h"
    bench.check(after == before, text, requirement="C-OD-13")


@pytest.mark.requirement("C-PC-02")
@pytest.mark.parametrize("direction", DIRECTIONS)
def test_restricted_identifiers_are_refused(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet, direction: str
) -> None:
    """For a PDO that is invalid and would become valid with it."""
    index, _ = prepared(bench, sdo, sheet, direction)
    value = sdo.number(index, 1)
    flags = value & NO_RTR
    sdo.write(index, 1, u32(value | INVALID), requirement="C-PC-04")
    for can_id in RESTRICTED:
        outcome = sdo.try_write(index, 1, u32(flags | can_id))
        sdo.expect_abort(outcome, accepted.INVALID_VALUE, f"{can_id:03X}h")


@pytest.mark.requirement("C-PC-03")
@pytest.mark.parametrize("direction", DIRECTIONS)
def test_a_29_bit_identifier_is_refused_or_taken(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet, direction: str
) -> None:
    """Where it is refused, then as a value."""
    index, _ = prepared(bench, sdo, sheet, direction)
    value = sdo.number(index, 1)
    sdo.write(index, 1, u32(value | INVALID), requirement="C-PC-04")
    outcome = sdo.try_write(index, 1, u32(EXTENDED | value))
    if isinstance(outcome, Abort):
        sdo.expect_abort(outcome, accepted.INVALID_VALUE, "a 29-bit identifier")
        return
    bench.characteristic("C-PC-03", "29-bit identifiers are taken")
    sdo.write(index, 1, u32(value | INVALID), requirement="C-PC-04")


@pytest.mark.requirement("C-PC-04")
@pytest.mark.parametrize("direction", DIRECTIONS)
def test_five_steps_set_a_mapping(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet, direction: str
) -> None:
    """And it reads back."""
    index, one = prepared(bench, sdo, sheet, direction)
    count, found = sdo.number(index + MAPPING, 0), sdo.read(index + MAPPING, 1)
    bench.check(count == 1, f"one entry; there are {count}")
    text = f"the entry is {entry(one).hex()}; it is {found.hex()}"
    bench.check(found == entry(one), text)
    valid = not sdo.number(index, 1) & INVALID
    bench.check(valid, "the PDO is valid")


@pytest.mark.requirement("C-PC-05", "C-OD-13")
@pytest.mark.parametrize("direction", DIRECTIONS)
def test_an_entry_is_not_written_while_it_is_in_use(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet, direction: str
) -> None:
    """And the mapping is kept."""
    index, one = prepared(bench, sdo, sheet, direction)
    outcome = sdo.try_write(index + MAPPING, 1, entry(one))
    sdo.expect_abort(outcome, accepted.MAPPING_LOCKED, "an entry of a mapping in use")
    outcome = sdo.try_write(index + MAPPING, 1, u32(0))
    sdo.expect_abort(outcome, accepted.MAPPING_LOCKED, "an entry of a mapping in use")
    found = sdo.read(index + MAPPING, 1)
    text = f"the entry is still {entry(one).hex()}; it is {found.hex()}"
    bench.check(found == entry(one), text, requirement="C-OD-13")


@pytest.mark.requirement("C-PC-05", "C-OD-13")
@pytest.mark.parametrize("direction", DIRECTIONS)
def test_the_number_of_entries_is_not_written_while_it_is_in_use(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet, direction: str
) -> None:
    """0 is refused while the PDO is valid, and the number is kept."""
    index, _ = prepared(bench, sdo, sheet, direction)
    outcome = sdo.try_write(index + MAPPING, 0, u8(0))
    sdo.expect_abort(outcome, accepted.MAPPING_LOCKED, "0 entries for a mapping in use")
    found = sdo.number(index + MAPPING, 0)
    bench.check(found == 1, f"there is still 1 entry; there are {found}", requirement="C-OD-13")


def try_map(sdo: Sdo, index: int, entries: list[bytes]) -> bytes | Abort:
    """Write entries and their number, up to the first refusal."""
    for sub, value in enumerate(entries, 1):
        outcome = sdo.try_write(index + MAPPING, sub, value)
        if isinstance(outcome, Abort):
            return outcome
    return sdo.try_write(index + MAPPING, 0, u8(len(entries)))


@pytest.mark.requirement("C-PC-06", "C-PC-09")
@pytest.mark.parametrize("direction", DIRECTIONS)
def test_more_than_64_bits_are_refused(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet, direction: str
) -> None:
    """The same object mapped until it does not fit; then a mapping that fits is taken."""
    index, one = prepared(bench, sdo, sheet, direction)
    value = unlocked(sdo, index)
    room = sum(each.index == index + MAPPING for each in sheet) - 1
    wanted = 8 // one.kind.size + 1
    if wanted > room:
        wide = [each for each in sheet if each.pdo and each.kind.size == 8 and each.writable]
        if not wide or room < 2:
            raise NotApplicable("no mapping of the device can have more than 64 bits")
        one, wanted = wide[0], 2
    outcome = try_map(sdo, index, [entry(one)] * wanted)
    sdo.expect_abort(outcome, accepted.MAPPING_LENGTH, f"{wanted} x {one.place}")
    expect_mappable_again(sdo, index, value, direction, sheet)


def expect_mappable_again(sdo: Sdo, index: int, value: int, direction: str, sheet: Sheet) -> None:
    """After a refusal the mapping can be set, and the PDO made valid."""
    one = one_mappable(sheet, DIRECTIONS[direction][1])
    sdo.write(index + MAPPING, 0, u8(0), requirement="C-PC-09")
    sdo.write(index + MAPPING, 1, entry(one), requirement="C-PC-09")
    sdo.write(index + MAPPING, 0, u8(1), requirement="C-PC-09")
    sdo.write(index, 1, u32(value), requirement="C-PC-09")


@pytest.mark.requirement("C-PC-07", "C-PC-09")
@pytest.mark.parametrize("direction", DIRECTIONS)
def test_an_object_that_is_not_there_is_not_mapped(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet, direction: str
) -> None:
    """When it is written, or at the latest when the mapping is."""
    index, _ = prepared(bench, sdo, sheet, direction)
    value = unlocked(sdo, index)
    known = {one.index for one in sheet}
    absent = next(i for i in range(0x5FFF, 0x2000, -1) if i not in known)
    outcome = try_map(sdo, index, [u32(absent << 16 | 8)])
    sdo.expect_abort(outcome, accepted.NOT_MAPPABLE, f"{absent:04X}h in a mapping")
    expect_mappable_again(sdo, index, value, direction, sheet)


@pytest.mark.requirement("C-PC-07")
@pytest.mark.parametrize("direction", DIRECTIONS)
def test_an_object_that_cannot_be_mapped_is_refused(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet, direction: str
) -> None:
    """One that the data sheet does not let into PDOs."""
    index, _ = prepared(bench, sdo, sheet, direction)
    found = (
        one
        for one in sheet
        if not one.pdo and one.index < 0x1200 and one.kind.size in {1, 2, 4} and one.writable
    )
    one = first(found, "that cannot be mapped")
    unlocked(sdo, index)
    outcome = try_map(sdo, index, [entry(one)])
    sdo.expect_abort(outcome, accepted.NOT_MAPPABLE, f"{one.place} in a mapping")


@pytest.mark.requirement("C-PC-08")
@pytest.mark.parametrize("direction", DIRECTIONS)
def test_an_object_of_the_other_direction_is_refused(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet, direction: str
) -> None:
    """A read-only one in an RPDO, a write-only one in a TPDO."""
    index, _ = prepared(bench, sdo, sheet, direction)
    access = "ro" if direction == "receive" else "wo"
    found = (one for one in sheet if one.pdo and one.access == access and one.kind.size)
    one = first(found, f"that is {access} and can be mapped")
    unlocked(sdo, index)
    outcome = try_map(sdo, index, [entry(one)])
    sdo.expect_abort(outcome, accepted.NOT_MAPPABLE, f"{one.place} ({access}) in a mapping")


@pytest.mark.requirement("C-PC-06")
@pytest.mark.parametrize("count", [65, 253])
def test_too_many_entries_are_refused(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet, count: int
) -> None:
    """More than 64 entries there cannot be."""
    index, _ = prepared(bench, sdo, sheet, "transmit")
    unlocked(sdo, index)
    outcome = sdo.try_write(index + MAPPING, 0, u8(count))
    sdo.expect_abort(outcome, accepted.MAPPING_LENGTH, f"{count} entries")
