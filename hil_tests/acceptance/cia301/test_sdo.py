"""Expedited and segmented SDO transfers, right and wrong ones (CiA 301 4.2.0, 7.2.4.3)."""

from __future__ import annotations

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from hil_tests.acceptance.cia301.steps import (
    DEVICE_TYPE,
    PRODUCER,
    long_object,
    needs_writable,
    plain_object,
    shown,
)
from hil_tests.api import (
    Abort,
    Bench,
    Download,
    NotApplicable,
    S,
    Sdo,
    Sheet,
    Upload,
    accepted,
    number,
    sdo_frames,
    u16,
)

COMMANDS = {1: 0x4F, 2: 0x4B, 3: 0x47, 4: 0x43}
"""Answer to an expedited read, by the number of bytes."""

UNKNOWN = bytes.fromhex("E000100000000000")
NAME = 0x1008
TEXT = b"a text that takes several segments to write"


def begin_reading_segments(bench: Bench, sdo: Sdo, sheet: Sheet) -> int:
    """A read in segments has begun; the index that is read."""
    for index in (NAME, 0x1009, 0x100A):
        if sheet.get(index) is None:
            continue
        answer = sdo.ask(sdo_frames.read(index, 0))
        if answer[0] & 0xF2 == 0x40:
            return index
    one = long_object(sheet)
    bench.needs_writes("an application object is written")
    sdo.write(one.index, one.sub, TEXT, requirement="C-SD-05")
    answer = sdo.ask(sdo_frames.read(one.index, one.sub))
    text = f"{one.place} of {len(TEXT)} bytes is read in segments; it was {answer.hex()}"
    bench.check(answer[0] & 0xF2 == 0x40, text, requirement="C-SD-04")
    return one.index


@pytest.mark.requirement("C-SD-01")
def test_an_abort_names_the_object_of_the_request(bench: Bench, sdo: Sdo, sheet: Sheet) -> None:
    """A read of something that is not there: 80h with its index and sub-index."""
    known = {one.index for one in sheet}
    absent = next(index for index in range(0x5FFF, 0x2000, -1) if index not in known)
    bench.start()
    answer = sdo.ask(sdo_frames.read(absent, 7))
    text = f"a read of {shown(absent, 7)} is refused; the answer was {answer.hex(' ')}"
    bench.check(answer[0] == 0x80, text, requirement="C-OD-07")
    named = answer[1:4] == sdo_frames.multiplexer(absent, 7)
    bench.check(named, f"the abort names {shown(absent, 7)}; it was {answer.hex(' ')}")


@pytest.mark.requirement("C-SD-02")
def test_an_expedited_read_tells_its_size(bench: Bench, sdo: Sdo, sheet: Sheet) -> None:
    """Every object of one to four bytes is answered with 4Fh, 4Bh, 47h or 43h."""
    bench.start()
    for one in sheet:
        if not one.readable or one.kind.size not in COMMANDS:
            continue
        answer = sdo.ask(sdo_frames.read(one.index, one.sub))
        wanted = COMMANDS[one.kind.size]
        if answer[0] == 0x80:
            continue  # what can be read is C-OD-04
        text = f"{one.place} is answered with {wanted:02X}h; the answer was {answer.hex(' ')}"
        bench.check(answer[0] == wanted, text)


@pytest.mark.requirement("C-SD-03")
@pytest.mark.parametrize("size", [1, 2, 4])
def test_an_expedited_write_is_confirmed(bench: Bench, sdo: Sdo, sheet: Sheet, size: int) -> None:
    """Numbers of one, two and four bytes, and what was written reads back."""
    bench.needs_writes("an application object is written")
    one = plain_object(sheet, size)
    bench.start()
    with sdo.kept((one.index, one.sub)):
        value = bytes(range(1, size + 1))
        answer = sdo.ask(sdo_frames.write(one.index, one.sub, value))
        wanted = b"\x60" + sdo_frames.multiplexer(one.index, one.sub)
        text = f"a write to {one.place} is confirmed; the answer was {answer.hex(' ')}"
        bench.check(answer[:4] == wanted, text)
        found = sdo.read(one.index, one.sub)
        bench.check(found == value, f"{one.place} reads back {value.hex()}; {found.hex()}")


@pytest.mark.requirement("C-SD-03")
def test_an_expedited_write_need_not_tell_its_size(bench: Bench, sdo: Sdo, sheet: Sheet) -> None:
    """22h is served, or refused for its length; nothing else is."""
    needs_writable(sheet, (PRODUCER, 0))
    bench.start()
    with sdo.kept((PRODUCER, 0)):
        answer = sdo.ask(sdo_frames.write_unsized(PRODUCER, 0, u16(500)))
        if answer[0] == 0x60:
            value = sdo.number(PRODUCER)
            bench.check(value == 500, f"1017h is 500 after 22h with 500; it is {value}")
            return
        code = number(answer[4:])
        told = f"22h is served or refused for its length; the answer was {answer.hex(' ')}"
        bench.check(answer[0] == 0x80 and code in accepted.NO_SIZE, told)


@pytest.mark.requirement("C-SD-04")
def test_a_segmented_read_adds_up(bench: Bench, sdo: Sdo, sheet: Sheet) -> None:
    """Strings and domains come with their size and in segments that add up to it."""
    bench.start()
    found = [one for one in sheet if one.readable and not one.kind.size]
    if not found:
        raise NotApplicable("the device has neither strings nor domains")
    for one in found:
        data = sdo.try_read(one.index, one.sub)
        told = f"{one.place} is read" if isinstance(data, bytes) else f"{one.place} has no data"
        bench.check(True, told)


@pytest.mark.requirement("C-SD-05")
@pytest.mark.parametrize("size", [1, 2, 4])
def test_a_short_value_can_be_written_in_segments(
    bench: Bench, sdo: Sdo, sheet: Sheet, size: int
) -> None:
    """One, two and four bytes in a single segment, and they read back."""
    bench.needs_writes("an application object is written")
    one = plain_object(sheet, size)
    bench.start()
    with sdo.kept((one.index, one.sub)):
        value = bytes(range(0x11, 0x11 + size))
        outcome = sdo.run(Download(one.index, one.sub, value, segmented=True))
        text = f"{one.place} is written in a segment"
        bench.check(not isinstance(outcome, Abort), text)
        found = sdo.read(one.index, one.sub)
        bench.check(found == value, f"{one.place} reads back {value.hex()}; {found.hex()}")


@pytest.mark.requirement("C-SD-06")
def test_a_wrong_toggle_bit_of_the_first_segment_is_refused(
    bench: Bench, sdo: Sdo, sheet: Sheet
) -> None:
    """1 in place of 0 when reading; afterwards the server serves."""
    bench.start()
    index = begin_reading_segments(bench, sdo, sheet)
    expect_toggle_abort(bench, sdo, sdo_frames.read_segment(1), index)


@pytest.mark.requirement("C-SD-06")
def test_a_wrong_toggle_bit_of_the_second_segment_is_refused(
    bench: Bench, sdo: Sdo, sheet: Sheet
) -> None:
    """0 a second time when reading."""
    bench.start()
    index = begin_reading_segments(bench, sdo, sheet)
    first = sdo.ask(sdo_frames.read_segment(0))
    if first[0] & 1:
        raise NotApplicable("the device has no string of more than seven bytes")
    expect_toggle_abort(bench, sdo, sdo_frames.read_segment(0), index)


@pytest.mark.requirement("C-SD-06", "C-OD-13")
def test_a_wrong_toggle_bit_when_writing_is_refused(bench: Bench, sdo: Sdo, sheet: Sheet) -> None:
    """And the object keeps its value."""
    bench.needs_writes("an application object is written")
    one = long_object(sheet)
    bench.start()
    sdo.write(one.index, one.sub, TEXT, requirement="C-SD-05")
    sdo.ask(sdo_frames.write_many(one.index, one.sub, 14))
    sdo.ask(sdo_frames.write_segment(0, b"1234567", last=False))
    wrong = sdo_frames.write_segment(0, b"1234567", last=True)
    expect_toggle_abort(bench, sdo, wrong, one.index)
    found = sdo.read(one.index, one.sub)
    text = f"{one.place} keeps its value"
    bench.check(found == TEXT, f"{text}; it is {found!r}", requirement="C-OD-13")


def expect_toggle_abort(bench: Bench, sdo: Sdo, request: bytes, index: int) -> None:
    """A segment with a wrong toggle bit is refused, and the next transfer is served."""
    answer = sdo.ask(request)
    code = number(answer[4:])
    text = f"a wrong toggle bit is refused with 05030000h; the answer was {answer.hex(' ')}"
    bench.check(answer[0] == 0x80 and code == accepted.TOGGLE.preferred, text)
    named = number(answer[1:3])
    text = f"the abort names {shown(index)}; it was {answer.hex(' ')}"
    bench.check(named == index, text, requirement="C-SD-01")
    sdo.serves("C-SD-08")


@pytest.mark.requirement("C-SD-07")
def test_an_unknown_command_is_refused(bench: Bench, sdo: Sdo, sheet: Sheet) -> None:
    """E0h, by itself and in the middle of a transfer; which object is named is not judged."""
    bench.start()
    for where in ("by itself", "in the middle of a transfer"):
        if where != "by itself":
            begin_reading_segments(bench, sdo, sheet)
        answer = sdo.ask(UNKNOWN, "C-SD-07")
        code = number(answer[4:])
        text = f"E0h {where} is refused with {accepted.COMMAND}; it was {answer.hex(' ')}"
        bench.check(answer[0] == 0x80 and code in accepted.COMMAND, text)
        sdo.serves("C-SD-08")


@pytest.mark.requirement("C-SD-07")
def test_a_segment_of_no_transfer_is_refused(bench: Bench, sdo: Sdo) -> None:
    """Reading or writing on where nothing has begun."""
    bench.start()
    for request in (
        sdo_frames.read_segment(0),
        sdo_frames.write_segment(0, b"1", last=True),
    ):
        answer = sdo.ask(request, "C-SD-07")
        code = number(answer[4:])
        text = f"a segment of no transfer is refused; the answer was {answer.hex(' ')}"
        bench.check(answer[0] == 0x80 and code in accepted.NO_TRANSFER, text)


@pytest.mark.requirement("C-SD-08")
def test_a_new_transfer_takes_the_place_of_another(bench: Bench, sdo: Sdo, sheet: Sheet) -> None:
    """A read begun in segments is left for another read, and then done from the beginning."""
    bench.start()
    index = begin_reading_segments(bench, sdo, sheet)
    sdo.ask(sdo_frames.read_segment(0))
    sdo.serves("C-SD-08")
    sdo.serves("C-SD-08", index)


@pytest.mark.requirement("C-SD-08")
def test_an_abort_of_the_client_is_not_answered(bench: Bench, sdo: Sdo, sheet: Sheet) -> None:
    """In the middle of a transfer, which it ends, and without one; then the server serves."""
    bench.start()
    index = begin_reading_segments(bench, sdo, sheet)
    sdo.silence(sdo_frames.abort(index, 0, 0x0800_0000))
    segment = sdo.offer(sdo_frames.read_segment(0))
    text = f"no segment comes after the abort; {(segment or b'').hex(' ')} did"
    bench.check(segment is None or segment[0] == 0x80, text)
    sdo.silence(sdo_frames.abort(index, 0, 0x0800_0000))
    sdo.serves("C-SD-08")


@pytest.mark.requirement("C-SD-14", "C-OD-13")
@pytest.mark.parametrize("told", [len(TEXT) - 1, len(TEXT) + 1])
def test_another_size_than_announced_is_refused(
    bench: Bench, sdo: Sdo, sheet: Sheet, told: int
) -> None:
    """One byte too many or too few in a segmented write; the object keeps its value."""
    bench.needs_writes("an application object is written")
    one = long_object(sheet)
    bench.start()
    sdo.write(one.index, one.sub, b"before the lie", requirement="C-SD-05")
    outcome = sdo.run(Download(one.index, one.sub, TEXT, size=told))
    what = f"a write of {len(TEXT)} bytes announced as {told}"
    sdo.expect_abort(outcome, accepted.LENGTH, what)
    found = sdo.read(one.index, one.sub)
    text = f"{one.place} keeps its value; it is {found!r}"
    bench.check(found == b"before the lie", text, requirement="C-OD-13")


SIZES = (1, 4, 5, 7, 8, 14, 41, 42, 43, 888, 889, 890, 993, 994, 995)
"""On both sides of a segment, and of a block of 127 segments."""


@pytest.mark.requirement("C-SD-15", "C-SD-05", "C-SD-04")
@pytest.mark.parametrize("size", SIZES)
def test_what_was_written_in_segments_reads_back(
    bench: Bench, sdo: Sdo, sheet: Sheet, size: int
) -> None:
    """Whatever its size."""
    bench.needs_writes("an application object is written")
    one = long_object(sheet)
    bench.start()
    data = bytes(step * 31 + 7 & 0xFF for step in range(size))
    sdo.write(one.index, one.sub, data, requirement="C-SD-05")
    found = sdo.read(one.index, one.sub, requirement="C-SD-04")
    bench.check(found == data, f"{size} bytes of {one.place} read back as they were written")


@pytest.mark.requirement("C-SD-17")
def test_what_it_does_when_the_client_stays_away_is_written_down(
    bench: Bench, sdo: Sdo, sheet: Sheet
) -> None:
    """It aborts, or waits; a new transfer is served in both cases."""
    bench.start()
    began = bench.now()
    begin_reading_segments(bench, sdo, sheet)
    bench.wait(30 * S if bench.stage.virtual else 3 * S)
    said = [
        seen.frame.data
        for seen in bench.frames_seen()
        if not seen.own and seen.frame.can_id == sdo.answer_id and seen.at > began
    ]
    aborted = [data for data in said if data[0] == 0x80]
    told = f"aborts with {number(aborted[0][4:]):08X}h" if aborted else "waits in silence"
    bench.characteristic("C-SD-17", f"left alone in a transfer the server {told}")
    sdo.serves("C-SD-08")


@pytest.mark.requirement("C-SD-18")
@pytest.mark.parametrize("length", range(8))
def test_what_it_makes_of_a_short_request_is_written_down(
    bench: Bench, sdo: Sdo, length: int
) -> None:
    """Requests of zero to seven bytes; afterwards the server serves."""
    bench.start()
    answer = sdo.offer(sdo_frames.read(DEVICE_TYPE, 0)[:length])
    told = "is not answered" if answer is None else f"is answered with {answer.hex(' ')}"
    bench.characteristic("C-SD-18", f"a request of {length} bytes {told}")
    sdo.serves("C-SD-08")


@pytest.mark.requirement("C-SD-20")
def test_every_object_is_answered_in_time(bench: Bench, sdo: Sdo, sheet: Sheet) -> None:
    """Each object of the data sheet once; the client measures each answer."""
    bench.start()
    objects = [one for one in sheet if one.readable]
    sdo.repeat(lambda turn: Upload(objects[turn].index, objects[turn].sub), len(objects))


MANY = 2_000


@pytest.mark.requirement("C-RB-09")
def test_no_answer_is_lost(bench: Bench, sdo: Sdo) -> None:
    """Thousands of reads, one after the other, each with its answer."""
    bench.start()
    count = MANY if bench.stage.virtual else 200
    outcomes = sdo.repeat(lambda _: Upload(DEVICE_TYPE, 0), count, "C-RB-09")
    text = "every read gives the same device type"
    bench.check(len(set(map(str, outcomes))) == 1, text)


requests = st.lists(
    st.one_of(
        st.binary(min_size=8, max_size=8),
        st.sampled_from([0x40, 0x60, 0x70, 0xA0, 0xA3, 0xA2, 0xA1, 0x80, 0x00, 0x10]).map(
            lambda command: bytes((command, 0x08, 0x10, 0, 1, 0, 0, 0))
        ),
    ),
    min_size=1,
    max_size=12,
)


def is_harmless(data: bytes) -> bool:
    """It begins no write, which could change anything."""
    return data[0] >> 5 not in {1, 6}


@pytest.mark.requirement("C-SD-08")
@given(script=requests)
@example(script=[bytes.fromhex("4008100000000000"), bytes.fromhex("A008100001000000")])
@example(script=[bytes.fromhex("A008100001000000"), bytes.fromhex("A300000000000000")])
def test_after_any_requests_a_new_transfer_is_served(
    bench: Bench, sdo: Sdo, script: list[bytes]
) -> None:
    """Requests that write nothing, in any order, leave the server able to serve."""
    bench.begin_example()
    bench.start()
    for data in filter(is_harmless, script):
        sdo.offer(data)
    sdo.abort(DEVICE_TYPE, 0)
    sdo.serves("C-SD-08")
    bench.check_monitors()
