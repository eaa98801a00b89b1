"""A record survives a power cut at every instant of storing."""

from __future__ import annotations

import pytest

from node_model.frame import crc15
from node_model.storage import MARK, LongRecordStore, RecordStore

OLD, NEW = b"older!", b"newer!"
BYTE_NS = 10


def stored(image: bytes, record: bytes, until: int | None = None) -> bytes:
    """The memory after `record` was stored into it from 0 on, cut off after `until` ns."""
    store = RecordStore(len(record), image, BYTE_NS)
    store.save(record, 0)
    while store.due_at is not None and (until is None or store.due_at <= until):
        store.advance(store.due_at)
    store.cut()
    assert store.due_at is None
    return bytes(store.memory)


def test_a_blank_memory_holds_no_record() -> None:
    """Neither fresh nor erased memory is mistaken for a record."""
    assert RecordStore(6).load() is None
    assert RecordStore(6, b"\xff" * 22).load() is None


def test_an_image_of_another_length_counts_as_blank() -> None:
    """A memory of another device is not read."""
    image = stored(b"", OLD)
    assert RecordStore(6, image[:-1]).load() is None


def test_a_record_is_there_once_its_last_byte_is_written() -> None:
    """Twelve bytes: the mark cleared, sequence 2, record 6, check 2, the mark set."""
    store = RecordStore(6, b"", BYTE_NS)
    store.save(OLD, 1000)
    store.advance(1009)
    assert not any(store.memory)
    store.advance(1119)
    assert store.load() is None
    store.advance(1120)
    assert (store.load(), store.due_at) == (OLD, None)
    assert store.memory[0] == MARK


@pytest.mark.parametrize("earlier", range(1, 5))
def test_a_power_cut_after_each_byte_leaves_old_or_new(earlier: int) -> None:
    """Whatever slot it falls into: the old record until the last byte, then the new one."""
    image = b""
    for _ in range(earlier):
        image = stored(image, OLD)

    for count in range(12):
        cut_off = stored(image, NEW, until=count * BYTE_NS)
        assert RecordStore(6, cut_off).load() == OLD, f"after {count} bytes"
        again = stored(cut_off, NEW)
        assert RecordStore(6, again).load() == NEW, f"stored again after {count} bytes"
    assert RecordStore(6, stored(image, NEW, until=12 * BYTE_NS)).load() == NEW


def test_a_power_cut_in_the_first_storing_leaves_nothing() -> None:
    """Without an old record there is none until the new one is complete."""
    for count in range(12):
        assert RecordStore(6, stored(b"", NEW, until=count * BYTE_NS)).load() is None


def test_one_wrong_bit_makes_a_slot_unreadable() -> None:
    """The check sequence finds it; the older record in the other slot is read."""
    image = bytearray(stored(stored(b"", OLD), NEW))
    assert RecordStore(6, bytes(image)).load() == NEW
    image[11 + 4] ^= 0x01
    assert RecordStore(6, bytes(image)).load() == OLD


def sealed(sequence: int, record: bytes) -> bytes:
    """A complete slot."""
    body = sequence.to_bytes(2, "big") + record
    return bytes((MARK,)) + body + crc15(int.from_bytes(body, "big"), 64).to_bytes(2, "big")


def test_the_newest_record_is_found_when_the_sequence_wraps() -> None:
    """After 65535 comes 0: still the newer one, and the next one goes over the other."""
    store = RecordStore(6, sealed(0xFFFF, OLD) + sealed(0, NEW), BYTE_NS)
    assert store.load() == NEW

    store.save(b"newest", 0)
    store.advance(1000)

    assert store.memory == sealed(1, b"newest") + sealed(0, NEW)
    assert store.load() == b"newest"


def test_saving_again_before_the_end_starts_over() -> None:
    """The second record is the one that stays."""
    store = RecordStore(6, b"", BYTE_NS)
    store.save(OLD, 0)
    store.advance(50)
    store.save(NEW, 55)
    store.advance(10_000)
    assert store.load() == NEW


# Records of any length


def long_stored(image: bytes, record: bytes, until: int | None = None) -> bytes:
    """The memory for 20 bytes after `record` was stored, cut off after `until` ns."""
    store = LongRecordStore(20, image, BYTE_NS)
    store.save(record, 0)
    store.advance(10_000 if until is None else until)
    store.cut()
    return bytes(store.memory)


@pytest.mark.parametrize("record", [b"", b"x", bytes(range(20))])
def test_a_long_record_comes_back_with_its_length(record: bytes) -> None:
    """From none to all of the bytes that fit."""
    assert LongRecordStore(20, long_stored(b"", record)).load() == record


def test_a_short_record_takes_the_time_of_its_own_bytes() -> None:
    """Two marks, sequence, length, record, check: not the whole slot."""
    store = LongRecordStore(20, b"", BYTE_NS)
    store.save(b"abc", 0)
    store.advance(13 * BYTE_NS - 1)
    assert store.load() is None
    store.advance(13 * BYTE_NS)
    assert (store.load(), store.due_at) == (b"abc", None)


@pytest.mark.parametrize(("old", "new"), [(b"older, longer", b"new"), (b"old", b"newer, longer")])
def test_a_power_cut_never_mixes_two_long_records(old: bytes, new: bytes) -> None:
    """After each byte of storing there is the old or the new one."""
    image = long_stored(long_stored(b"", old), old)
    last = (len(new) + 10) * BYTE_NS
    for until in range(0, last, BYTE_NS):
        assert LongRecordStore(20, long_stored(image, new, until)).load() == old
    assert LongRecordStore(20, long_stored(image, new, last)).load() == new


def test_a_record_that_does_not_fit_is_refused() -> None:
    """One byte more than the memory holds."""
    with pytest.raises(ValueError, match="21 bytes; this memory holds 20"):
        LongRecordStore(20).save(bytes(21), 0)


def test_a_length_beyond_the_slot_makes_it_unreadable() -> None:
    """No check can stand there."""
    image = bytearray(long_stored(b"", b"abc"))
    image[3] = 0xFF
    assert LongRecordStore(20, bytes(image)).load() is None


def test_what_is_being_stored_can_be_finished_at_once() -> None:
    """A reset waits for it; without anything to store it does nothing."""
    store = RecordStore(6, b"", BYTE_NS)
    store.finish()
    store.save(OLD, 0)
    store.advance(5 * BYTE_NS)
    store.finish()
    assert (store.load(), store.due_at) == (OLD, None)


def test_what_a_power_cut_has_ended_is_not_finished_later() -> None:
    """The record is lost."""
    store = RecordStore(6, b"", BYTE_NS)
    store.save(OLD, 0)
    store.cut()
    store.finish()
    assert store.load() is None
