"""The object dictionary as its data sheet describes it (CiA 301 4.2.0, 7.4, 7.5.2)."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from hil_tests.acceptance.cia301.steps import (
    DEVICE_TYPE,
    ERROR_FIELD,
    ERROR_REGISTER,
    IDENTITY,
    RESTORE,
    STORE,
    go,
    needs,
    needs_writable,
    refused,
    reset,
    shown,
    writable_objects,
)
from hil_tests.api import (
    Abort,
    Bench,
    Download,
    EdsObject,
    Nmt,
    NotApplicable,
    Sdo,
    Sheet,
    State,
    abort_in,
    accepted,
    number,
    sdo_frames,
)

TELLS_NOTHING = frozenset({0x060A_0023, 0x0800_0020, 0x0800_0021, 0x0800_0022, 0x0800_0024})
"""Codes by which an object that can be read says that there is nothing to be read now."""

MUTE = frozenset({ERROR_FIELD, STORE, RESTORE})
"""Objects whose values mean something else when they are written back."""

PDO_SETTINGS = range(0x1400, 0x1C00)
STRINGS = (0x1008, 0x1009, 0x100A)
GENERIC, RESERVED_BIT = 0x01, 0x40
SPARSE = 37
"""Of the indices that are not listed every so many-th is asked for, and all beside one that is."""


def is_live(one: EdsObject) -> bool:
    """It may change by itself between two reads."""
    return one.pdo or one.index in {ERROR_REGISTER, ERROR_FIELD} or one.access == "ro"


@pytest.mark.requirement("C-OD-01")
def test_the_device_type_is_four_bytes(bench: Bench, sdo: Sdo) -> None:
    """1000h is read with one answer, 43h."""
    bench.start()
    answer = sdo.ask(sdo_frames.read(DEVICE_TYPE, 0))
    bench.check(answer[0] == 0x43, f"1000h is read with 43h; the answer was {answer.hex()}")


@pytest.mark.requirement("C-OD-01", "C-OD-05", "C-OD-13")
def test_nobody_writes_the_device_type(bench: Bench, sdo: Sdo) -> None:
    """A write is refused and changes nothing."""
    bench.start()
    before = sdo.read(DEVICE_TYPE)
    outcome = sdo.try_write(DEVICE_TYPE, 0, bytes(byte ^ 0xFF for byte in before))
    refused(bench, outcome, "a write to 1000h:00")
    sdo.expect_abort(outcome, accepted.READ_ONLY, "write to 1000h:00", requirement="C-OD-05")
    after = sdo.read(DEVICE_TYPE)
    bench.check(after == before, f"1000h is still {before.hex()}; it is {after.hex()}")


@pytest.mark.requirement("C-OD-02")
def test_the_error_register_is_one_byte_in_order(bench: Bench, sdo: Sdo) -> None:
    """In both states: bit 6 is 0, bit 0 is set with every other, and nobody writes it."""
    bench.start()
    for state in (State.PRE_OPERATIONAL, State.OPERATIONAL):
        go(bench, state)
        data = sdo.read(ERROR_REGISTER)
        bench.check(len(data) == 1, f"1001h is one byte; it was {data.hex()}")
        register = data[0]
        bench.check(not register & RESERVED_BIT, f"bit 6 of 1001h is 0; it is {register:02X}h")
        text = f"bit 0 of 1001h is set with every other; it is {register:02X}h"
        bench.check(not register or bool(register & GENERIC), text)
    refused(bench, sdo.try_write(ERROR_REGISTER, 0, b"\x00"), "a write to 1001h:00", "C-OD-04")


def identity(bench: Bench, sdo: Sdo) -> list[int]:
    """What 1018h says."""
    count = sdo.number(IDENTITY, 0, requirement="C-OD-03")
    bench.check(1 <= count <= 4, f"1018h:00 is 1 to 4; it is {count}")
    return [sdo.number(IDENTITY, sub, requirement="C-OD-03") for sub in range(1, count + 1)]


@pytest.mark.requirement("C-OD-03")
def test_the_identity_never_changes(bench: Bench, sdo: Sdo) -> None:
    """The same vendor and all the rest in two states and after both resets."""
    bench.start()
    known = identity(bench, sdo)
    bench.check(known[0] != 0, "the vendor id is not 0")
    go(bench, State.OPERATIONAL)
    places = {"operational": identity(bench, sdo)}
    for command in (Nmt.RESET_COMMUNICATION, Nmt.RESET_NODE):
        reset(bench, command)
        places[command.name] = identity(bench, sdo)
    for where, told in places.items():
        bench.check(told == known, f"1018h is the same in or after {where}; {told} / {known}")


@pytest.mark.requirement("C-OD-04")
def test_what_is_listed_as_readable_can_be_read(bench: Bench, sdo: Sdo, sheet: Sheet) -> None:
    """Every object of the data sheet, with the number of bytes of its type.

    An object may say that it has no data now; one that exists never says that it does not.
    """
    bench.start()
    for one in sheet:
        if not one.readable:
            continue
        outcome = sdo.try_read(one.index, one.sub)
        if isinstance(outcome, Abort):
            silent = outcome.code in TELLS_NOTHING or (
                outcome.code == accepted.GENERAL and one.index == ERROR_FIELD
            )
            text = f"{one.place} can be read; {accepted.show_code(outcome.code)}"
            bench.check(silent, text)
        elif one.kind.size:
            text = f"{one.place} is {one.kind.size} bytes; they were {outcome.hex(' ')}"
            bench.check(len(outcome) == one.kind.size, text)


@pytest.mark.requirement("C-OD-04")
def test_what_is_listed_as_writable_takes_its_own_value(
    bench: Bench, sdo: Sdo, sheet: Sheet
) -> None:
    """Every object of the data sheet that can be read and written, but for settings of PDOs."""
    bench.needs_writes("writing every object may write non-volatile memory")
    bench.start()
    for one in sheet:
        excused = one.index in MUTE or one.index in PDO_SETTINGS
        if excused or not (one.readable and one.writable):
            continue
        value = sdo.try_read(one.index, one.sub)
        if isinstance(value, Abort):
            continue  # it has nothing to give back now
        outcome = sdo.try_write(one.index, one.sub, value)
        told = f"{one.place} takes its own value {value[:8].hex()}"
        if isinstance(outcome, Abort):
            busy = outcome.code in TELLS_NOTHING
            bench.check(busy, f"{told}; {accepted.show_code(outcome.code)}")
        else:
            bench.check(True, told)


@pytest.mark.requirement("C-OD-05", "C-OD-04", "C-OD-13")
def test_what_is_listed_as_read_only_cannot_be_written(
    bench: Bench, sdo: Sdo, sheet: Sheet
) -> None:
    """Every such object refuses a value of its size, and keeps its own."""
    bench.needs_writes("an object that should be read-only might store what it is given")
    bench.start()
    for one in sheet:
        if one.writable or one.kind.size > 4:
            continue
        before = sdo.try_read(one.index, one.sub)
        if isinstance(before, Abort) or not before:
            continue
        size = one.kind.size or min(len(before), 4)
        outcome = sdo.try_write(one.index, one.sub, bytes(byte ^ 1 for byte in before[:size]))
        refused(bench, outcome, f"a write to {one.place}", "C-OD-04")
        sdo.expect_abort(outcome, accepted.READ_ONLY, f"write to {one.place}")
        if not is_live(one):
            after = sdo.read(one.index, one.sub)
            text = f"{one.place} keeps its value; {before.hex()} / {after.hex()}"
            bench.check(after == before, text, requirement="C-OD-13")


@pytest.mark.requirement("C-OD-06")
def test_what_is_listed_as_write_only_cannot_be_read(bench: Bench, sdo: Sdo, sheet: Sheet) -> None:
    """Every such object refuses a read."""
    secrets = [one for one in sheet if not one.readable]
    if not secrets:
        raise NotApplicable("the device has no write-only object")
    bench.start()
    for one in secrets:
        outcome = sdo.try_read(one.index, one.sub)
        sdo.expect_abort(outcome, accepted.WRITE_ONLY, f"read of {one.place}")


def absent_indices(sheet: Sheet) -> Iterator[int]:
    """Indices that the data sheet does not list, in every area of the dictionary."""
    known = {one.index for one in sheet}
    beside = {index + step for index in known for step in (-1, 1)}
    every = set(range(0x1000, 0xFFFF, SPARSE * 16)) | set(range(0x1000, 0x2000, SPARSE))
    return (index for index in sorted(every | beside) if index >= 0x1000 and index not in known)


@pytest.mark.requirement("C-OD-07")
def test_an_index_that_is_not_there_is_refused(bench: Bench, sdo: Sdo, sheet: Sheet) -> None:
    """For reading and for writing."""
    bench.start()
    index = next(index for index in absent_indices(sheet) if index >= 0x2000)
    read, write = sdo.try_read(index), sdo.try_write(index, 0, b"\x00")
    sdo.expect_abort(read, accepted.NO_OBJECT, f"read of {shown(index)}")
    sdo.expect_abort(write, accepted.NO_OBJECT, f"write to {shown(index)}")


@pytest.mark.requirement("C-OD-16")
def test_what_is_not_listed_is_not_there(bench: Bench, sdo: Sdo, sheet: Sheet) -> None:
    """Indices next to the listed ones, and some hundred others."""
    bench.start()
    for index in absent_indices(sheet):
        outcome = sdo.try_read(index)
        if not isinstance(outcome, Abort) or outcome.code not in accepted.NO_OBJECT:
            sdo.expect_abort(outcome, accepted.NO_OBJECT, f"read of {shown(index)}")
    bench.check(True, "indices that are not listed are refused")


@pytest.mark.requirement("C-OD-08")
def test_a_sub_index_that_is_not_there_is_refused(bench: Bench, sdo: Sdo, sheet: Sheet) -> None:
    """The one after the last of each structure, and sub-index 1 of each plain variable."""
    bench.start()
    last: dict[int, int] = {}
    for one in sheet:
        last[one.index] = max(last.get(one.index, 0), one.sub)
    for index, sub in last.items():
        if sub >= 254 or index == ERROR_FIELD:
            continue
        answer = sdo.ask(sdo_frames.read(index, sub + 1))
        outcome = abort_in(answer) or answer
        sdo.expect_abort(outcome, accepted.NO_SUB_INDEX, f"read of {shown(index, sub + 1)}")


def bounded(sheet: Sheet) -> list[EdsObject]:
    """Numbers of the application with a limit that their type could pass."""
    found = [
        one
        for one in writable_objects(sheet)
        if one.kind.is_number and (one.low is not None or one.high is not None)
    ]
    if not found:
        raise NotApplicable("the device has no writable number with limits")
    return found


def beyond(one: EdsObject, value: int) -> bytes | None:
    """A value in the bytes of an object's type; None where the type cannot hold it."""
    signed = one.kind.name.startswith("INTEGER")
    try:
        return value.to_bytes(one.kind.size, "little", signed=signed)
    except OverflowError:
        return None


def expect_kept(
    bench: Bench, sdo: Sdo, one: EdsObject, data: bytes, codes: accepted.Accepted, rule: str
) -> None:
    """This write is refused, and the object keeps its value."""
    before = sdo.read(one.index, one.sub)
    outcome = sdo.run(Download(one.index, one.sub, data))
    what = f"{data.hex(' ')} to {one.place}"
    sdo.expect_abort(outcome, codes, what, requirement=rule)
    after = sdo.read(one.index, one.sub)
    text = f"{one.place} is still {before.hex()} after {what} was refused; it is {after.hex()}"
    bench.check(after == before or is_live(one), text, requirement="C-OD-13")


@pytest.mark.requirement("C-OD-09", "C-OD-04", "C-OD-13")
def test_values_above_their_limits_are_refused(bench: Bench, sdo: Sdo, sheet: Sheet) -> None:
    """One above the upper limit; the limit itself is taken."""
    expect_limits(bench, sdo, bounded(sheet), "C-OD-09")


@pytest.mark.requirement("C-OD-10", "C-OD-04", "C-OD-13")
def test_values_below_their_limits_are_refused(bench: Bench, sdo: Sdo, sheet: Sheet) -> None:
    """One below the lower limit; the limit itself is taken."""
    expect_limits(bench, sdo, bounded(sheet), "C-OD-10")


def expect_limits(bench: Bench, sdo: Sdo, objects: list[EdsObject], rule: str) -> None:
    """Values up to a limit are taken, the next one is refused."""
    bench.needs_writes("application objects are written")
    bench.start()
    for one in objects:
        limit, step, codes = (
            (one.high, 1, accepted.TOO_HIGH)
            if rule == "C-OD-09"
            else (one.low, -1, accepted.TOO_LOW)
        )
        if limit is None or not isinstance(limit.at(bench.node_id), int):
            continue
        edge = int(limit.at(bench.node_id))
        inside, outside = beyond(one, edge), beyond(one, edge + step)
        with sdo.kept((one.index, one.sub)):
            if inside is not None and not one.pdo:
                sdo.write(one.index, one.sub, inside)
            if outside is not None:
                expect_kept(bench, sdo, one, outside, codes, rule)


@pytest.mark.requirement("C-OD-11", "C-OD-13")
def test_values_that_are_too_long_are_refused(bench: Bench, sdo: Sdo, sheet: Sheet) -> None:
    """A byte more than each number of the application has."""
    bench.needs_writes("application objects are written")
    bench.start()
    for one in writable_objects(sheet):
        if one.kind.is_number:
            data = bytes(one.kind.size + 1)
            expect_kept(bench, sdo, one, data, accepted.TOO_LONG, "C-OD-11")


@pytest.mark.requirement("C-OD-12", "C-OD-13")
def test_values_that_are_too_short_are_refused(bench: Bench, sdo: Sdo, sheet: Sheet) -> None:
    """A byte less than each number of the application has."""
    bench.needs_writes("application objects are written")
    bench.start()
    for one in writable_objects(sheet):
        if one.kind.is_number and one.kind.size > 1:
            data = bytes(one.kind.size - 1)
            expect_kept(bench, sdo, one, data, accepted.TOO_SHORT, "C-OD-12")


@pytest.mark.requirement("C-OD-11", "C-OD-12", "C-OD-13")
def test_a_heartbeat_time_of_a_wrong_length_is_refused(
    bench: Bench, sdo: Sdo, sheet: Sheet
) -> None:
    """Four bytes and one byte for the two of 1017h."""
    needs_writable(sheet, (0x1017, 0))
    one = sheet.get(0x1017)
    assert one is not None
    bench.start()
    expect_kept(bench, sdo, one, b"\xe8\x03\x00\x00", accepted.TOO_LONG, "C-OD-11")
    expect_kept(bench, sdo, one, b"\x64", accepted.TOO_SHORT, "C-OD-12")


@pytest.mark.requirement("C-OD-14")
def test_defaults_are_those_of_the_data_sheet(bench: Bench, sdo: Sdo, sheet: Sheet) -> None:
    """After a start each setting that nobody stored reads its default.

    On a device of the user's a setting may have been stored: there a difference is noted.
    """
    bench.start()
    for one in sheet:
        is_setting = one.access in {"rw", "rwr", "rww", "const"} and not one.pdo
        if one.default is None or not is_setting or one.index in MUTE:
            continue
        value = sdo.try_read(one.index, one.sub)
        wanted = one.default.bytes_at(bench.node_id)
        text = f"{one.place} is {wanted.hex()} by default; it is {_shown(value)}"
        if value != wanted and not bench.stage.virtual and one.writable:
            bench.characteristic("C-OD-14", text)
        else:
            bench.check(value == wanted or one.index == 0x1017, text)


def _shown(value: bytes | Abort) -> str:
    return accepted.show_code(value.code) if isinstance(value, Abort) else value.hex()


@pytest.mark.requirement("C-OD-17")
def test_the_default_server_shows_its_identifiers(bench: Bench, sdo: Sdo, sheet: Sheet) -> None:
    """1200h:01 and :02 follow from the node id and cannot be written."""
    needs(sheet, (0x1200, 1), (0x1200, 2))
    bench.start()
    for sub, base in ((1, 0x600), (2, 0x580)):
        data = sdo.read(0x1200, sub)
        wanted = base + bench.node_id
        text = f"{shown(0x1200, sub)} is {wanted:X}h; it is {number(data):X}h"
        bench.check(number(data) == wanted, text)
        refused(
            bench, sdo.try_write(0x1200, sub, data), f"a write to {shown(0x1200, sub)}", "C-OD-04"
        )


@pytest.mark.requirement("C-OD-18")
def test_names_are_printable_and_constant(bench: Bench, sdo: Sdo, sheet: Sheet) -> None:
    """1008h, 1009h and 100Ah, read twice; the client counts the bytes against the size told."""
    names = [index for index in STRINGS if sheet.get(index) is not None]
    if not names:
        raise NotApplicable("the device has none of 1008h, 1009h and 100Ah")
    bench.start()
    for index in names:
        name = sdo.read(index)
        text = f"{shown(index)} is printable; it is {name!r}"
        bench.check(all(0x20 <= byte < 0x7F for byte in name.rstrip(b"\0")), text)
        again = sdo.read(index)
        bench.check(again == name, f"{shown(index)} reads the same; {name!r} / {again!r}")
