"""SDO block transfers (CiA 301 4.2.0, 7.2.4.3.9 to 7.2.4.3.16)."""

from __future__ import annotations

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from hil_tests.acceptance.cia301.steps import long_object
from hil_tests.api import (
    Abort,
    Bench,
    BlockDownload,
    BlockUpload,
    EdsObject,
    NotApplicable,
    Sdo,
    Sheet,
    accepted,
    number,
    sdo_frames,
)

NO_BLOCKS = frozenset({0x0504_0001, 0x0601_0000})
"""What a server says that has no block transfer: CiA 301 leaves that to the maker."""

BEFORE = b"what was there before"


def filled(size: int) -> bytes:
    """Bytes without a period that segments or blocks could hide."""
    return bytes((step * 73 + step // 7 + 1) & 0xFF for step in range(size))


def prepared(
    bench: Bench,
    sdo: Sdo,
    sheet: Sheet,
    data: bytes = BEFORE,
    *,
    reads: bool = True,
    writes: bool = True,
) -> EdsObject:
    """An object that holds some bytes, on a device that has block transfers.

    Raises:
        NotApplicable: it refuses them, or answers a block read as an ordinary one.
    """
    bench.needs_writes("an application object is written")
    one = long_object(sheet)
    bench.start()
    sdo.write(one.index, one.sub, data, requirement="C-SD-05")
    if reads:
        answer = sdo.ask(sdo_frames.block_read(one.index, one.sub))
        has_blocks(answer, 0xC0, "read")
        sdo.abort(one.index, one.sub)
        sdo.serves("C-SD-08")
    if writes:
        answer = sdo.ask(sdo_frames.block_write(one.index, one.sub, len(data)))
        has_blocks(answer, 0xA0, "write")
        sdo.abort(one.index, one.sub)
        sdo.serves("C-SD-08")
    return one


def has_blocks(answer: bytes, command: int, verb: str) -> None:
    """Raise NotApplicable where a block transfer is not begun: CiA 301 leaves it to the maker."""
    if answer[0] & 0xF0 in {0x40, 0x60} or (answer[0] == 0x80 and number(answer[4:]) in NO_BLOCKS):
        raise NotApplicable(f"the device does not {verb} in blocks ({command:02X}h)")


def done(bench: Bench, outcome: bytes | Abort, what: str, requirement: str) -> bytes:
    """The transfer was served."""
    if isinstance(outcome, Abort):
        text = f"{what} is served; it was refused with {accepted.show_code(outcome.code)}"
        bench.fail(text, requirement=requirement)
    bench.check(True, f"{what} is served", requirement=requirement)
    return outcome


SIZES = (1, 4, 5, 7, 8, 14, 41, 42, 43, 888, 889, 890, 993, 994, 995)


@pytest.mark.requirement("C-SD-15", "C-SD-10", "C-SD-11", "C-SD-16")
@pytest.mark.parametrize("size", SIZES)
def test_a_block_transfer_brings_every_byte(
    bench: Bench, sdo: Sdo, sheet: Sheet, size: int
) -> None:
    """Written in blocks it reads the same in blocks and in segments, CRC included."""
    one = prepared(bench, sdo, sheet)
    data = filled(size)
    outcome = sdo.run(BlockDownload(one.index, one.sub, data))
    done(bench, outcome, f"a block write of {size} bytes", "C-SD-10")
    plain = sdo.read(one.index, one.sub, requirement="C-SD-04")
    bench.check(plain == data, f"{size} bytes read back in segments", requirement="C-SD-15")
    blocks = done(bench, sdo.run(BlockUpload(one.index, one.sub)), "a block read", "C-SD-10")
    bench.check(blocks == data, f"{size} bytes read the same in blocks", requirement="C-SD-16")


@pytest.mark.requirement("C-SD-10")
@pytest.mark.parametrize("lost", [1, 2, 30, 126, 127])
def test_a_segment_that_was_lost_when_reading_comes_again(
    bench: Bench, sdo: Sdo, sheet: Sheet, lost: int
) -> None:
    """The first, a middle or the last segment of a block; every byte arrives."""
    data = filled(1000)
    one = prepared(bench, sdo, sheet, data, writes=False)
    transfer = BlockUpload(one.index, one.sub, lose=frozenset({lost}))
    read = done(bench, sdo.run(transfer), "a block read with a loss", "C-SD-10")
    bench.check(read == data, f"every byte arrives though segment {lost} was lost")


@pytest.mark.requirement("C-SD-10")
@pytest.mark.parametrize("lost", [1, 2, 30, 126])
def test_a_segment_that_was_lost_when_writing_is_asked_for_again(
    bench: Bench, sdo: Sdo, sheet: Sheet, lost: int
) -> None:
    """The first or a middle segment of a block; the object holds every byte."""
    one = prepared(bench, sdo, sheet, reads=False)
    data = filled(1000)
    transfer = BlockDownload(one.index, one.sub, data, lose=frozenset({lost}))
    done(bench, sdo.run(transfer), "a block write with a loss", "C-SD-10")
    found = sdo.read(one.index, one.sub, requirement="C-SD-04")
    bench.check(found == data, f"every byte is there though segment {lost} was lost")


@pytest.mark.requirement("C-SD-11", "C-OD-13")
def test_a_wrong_crc_is_refused(bench: Bench, sdo: Sdo, sheet: Sheet) -> None:
    """And the object keeps its value; a server without CRC has nothing to compare."""
    one = prepared(bench, sdo, sheet, reads=False)
    answer = sdo.ask(sdo_frames.block_write(one.index, one.sub, 7))
    sdo.abort(one.index, one.sub)
    if not answer[0] & 0x04:
        raise NotApplicable("the device checks no CRC")
    transfer = BlockDownload(one.index, one.sub, filled(100), crc_error=0x0100)
    sdo.expect_abort(sdo.run(transfer), accepted.CRC, "a block write with a wrong CRC")
    expect_kept(bench, sdo, one)


def expect_kept(bench: Bench, sdo: Sdo, one: EdsObject) -> None:
    """The object holds what it held before."""
    found = sdo.read(one.index, one.sub)
    text = f"{one.place} keeps its value; it is {found[:20]!r}"
    bench.check(found == BEFORE, text, requirement="C-OD-13")


@pytest.mark.requirement("C-SD-14", "C-OD-13")
@pytest.mark.parametrize("told", [99, 101])
def test_another_size_than_announced_is_refused_in_blocks(
    bench: Bench, sdo: Sdo, sheet: Sheet, told: int
) -> None:
    """One byte too many or too few; the object keeps its value."""
    one = prepared(bench, sdo, sheet, reads=False)
    outcome = sdo.run(BlockDownload(one.index, one.sub, filled(100), size=told))
    what = f"a block write of 100 bytes announced as {told}"
    sdo.expect_abort(outcome, accepted.LENGTH, what)
    expect_kept(bench, sdo, one)


@pytest.mark.requirement("C-SD-09")
@pytest.mark.parametrize("block", [0, 128, 255])
def test_a_block_of_no_length_is_refused(bench: Bench, sdo: Sdo, sheet: Sheet, block: int) -> None:
    """0 segments and more than 127 are none."""
    one = prepared(bench, sdo, sheet, writes=False)
    answer = sdo.ask(sdo_frames.block_read(one.index, one.sub, block), "C-SD-09")
    code = number(answer[4:])
    text = f"a block of {block} segments is refused with {accepted.BLOCK_SIZE}"
    told = f"{text}; the answer was {answer.hex(' ')}"
    bench.check(answer[0] == 0x80 and code in accepted.BLOCK_SIZE, told)


@pytest.mark.requirement("C-SD-09", "C-SD-10")
@pytest.mark.parametrize("block", [1, 2, 127])
def test_a_block_of_any_length_works(bench: Bench, sdo: Sdo, sheet: Sheet, block: int) -> None:
    """One segment a block is the least, 127 the most."""
    data = filled(200)
    one = prepared(bench, sdo, sheet, data, writes=False)
    outcome = sdo.run(BlockUpload(one.index, one.sub, block=block))
    read = done(bench, outcome, f"a read in blocks of {block}", "C-SD-09")
    bench.check(read == data, f"every byte arrives in blocks of {block}")


@pytest.mark.requirement("C-SD-12")
def test_a_sequence_number_that_was_not_is_refused(bench: Bench, sdo: Sdo, sheet: Sheet) -> None:
    """More segments of a block confirmed than it has."""
    one = prepared(bench, sdo, sheet, filled(100), writes=False)
    sdo.ask(sdo_frames.block_read(one.index, one.sub, 4))
    sdo.post(sdo_frames.block_read_start())
    bench.wait(4 * bench_gap(bench))
    answer = sdo.ask(sdo_frames.block_read_acknowledge(5, 4), "C-SD-12")
    code = number(answer[4:])
    text = f"a number that was not is refused with {accepted.SEQUENCE}"
    told = f"{text}; the answer was {answer.hex(' ')}"
    bench.check(answer[0] == 0x80 and code in accepted.SEQUENCE, told)
    sdo.serves("C-SD-08")


@pytest.mark.requirement("C-SD-12")
def test_a_segment_without_a_number_is_refused(bench: Bench, sdo: Sdo, sheet: Sheet) -> None:
    """Segments are numbered from 1: one with the number 0 is none of a block write."""
    one = prepared(bench, sdo, sheet, reads=False)
    sdo.ask(sdo_frames.block_write(one.index, one.sub, 14))
    answer = sdo.offer(b"\x001234567") or b""
    code = number(answer[4:])
    text = f"a segment with the number 0 is refused with {accepted.SEQUENCE}"
    told = f"{text}; the answer was {answer.hex(' ') or 'none'}"
    bench.check(answer[:1] == b"\x80" and code in accepted.SEQUENCE, told)
    sdo.serves("C-SD-08")


def bench_gap(bench: Bench) -> int:
    """In which time a segment of a block surely comes, ns."""
    return bench.profile.limits.command_ns


@pytest.mark.requirement("C-SD-13")
def test_whether_it_switches_protocols_is_written_down(
    bench: Bench, sdo: Sdo, sheet: Sheet
) -> None:
    """A block read of few bytes with a threshold above; they arrive in both cases."""
    data = filled(10)
    one = prepared(bench, sdo, sheet, data, writes=False)
    transfer = BlockUpload(one.index, one.sub, threshold=20)
    read = done(bench, sdo.run(transfer), "a block read with a threshold", "C-SD-10")
    told = "switches to an ordinary read" if transfer.switched else "stays with blocks"
    bench.characteristic("C-SD-13", f"below the threshold the server {told}")
    bench.check(read == data, "every byte arrives", requirement="C-SD-16")


@pytest.mark.requirement("C-SD-16")
@given(data=st.binary(min_size=1, max_size=300))
@example(data=bytes(7))
@example(data=bytes(14))
def test_blocks_and_segments_bring_the_same(
    bench: Bench, sdo: Sdo, sheet: Sheet, data: bytes
) -> None:
    """Whatever the bytes are."""
    bench.begin_example()
    one = prepared(bench, sdo, sheet, data, writes=False)
    plain = sdo.read(one.index, one.sub, requirement="C-SD-04")
    outcome = sdo.run(BlockUpload(one.index, one.sub))
    blocks = done(bench, outcome, "a block read", "C-SD-10")
    bench.check(plain == blocks == data, "blocks and segments bring the same bytes")
    bench.check_monitors()
