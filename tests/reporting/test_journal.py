"""Notes among the frames: plain data in, the same data out, clear words where it is damaged."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from hil_tests.reporting import journal
from hil_tests.reporting import pcapng_layout as layout
from hil_tests.reporting.files import RecordUnreadable
from hil_tests.reporting.journal import describe, pack, unpack
from hil_tests.reporting.pcapng import read_pcapng
from hil_tests.trace import BusEvent, EventKind, Mark, Moment

GOOD = pack(Mark(1, "x"))
PREFIX = GOOD[: GOOD.index(b"{")]


@pytest.mark.parametrize(
    ("payload", "said"),
    [
        (b"", "Expecting value"),
        (b"{", "Expecting property name"),
        (b"[]", "no object"),
        (b"[" * 100_000, "nested too deeply"),
        (b"{}", "unknown kind, 'None'"),
        (b'{"kind":"later"}', "unknown kind, 'later'"),
        (b'{"kind":"mark","at":true,"text":"","data":{}}', "'at' is no whole number"),
        (b'{"kind":"mark","at":1,"text":2,"data":{}}', "'text' is no text"),
        (b'{"kind":"mark","at":1,"text":"","data":[]}', "'data' is no object"),
        (b'{"kind":"event","event":"PARTY","at":1,"text":"","lost":0}', "unknown kind, 'PARTY'"),
        (b'{"kind":"moment","what":"power"}', "'began_at' is no whole number"),
        (b"\xff\xff", "codec"),
    ],
)
def test_a_damaged_note_says_what_is_wrong(payload: bytes, said: str) -> None:
    """Each field is checked before anyone relies on it."""
    with pytest.raises(ValueError, match=said):
        unpack(PREFIX + payload)


def test_a_note_without_an_end_of_its_tags_is_refused() -> None:
    """However the tags are damaged, the search for the JSON ends."""
    for packet in (b"", b"\0", PREFIX[:-4], b"\0\x0c\xff\xff"):
        with pytest.raises(ValueError, match="tags have no end"):
            unpack(packet)


def test_a_damaged_note_in_a_recording_is_told_with_file_and_offset(tmp_path: Path) -> None:
    """What stands before it was read."""
    head = layout.section() + layout.interface(layout.UPPER_PDU, journal.INTERFACE, "")
    good = layout.packet(0, 1, GOOD)
    path = tmp_path / "t.pcapng"
    path.write_bytes(head + good + layout.packet(0, 2, PREFIX + b"{}"))
    entries = read_pcapng(path)
    assert next(entries) == Mark(1, "x")
    with pytest.raises(RecordUnreadable, match=rf"offset {len(head + good)}: .*no note of ours"):
        next(entries)


def test_a_journal_of_a_later_form_is_refused(tmp_path: Path) -> None:
    """Better no verdict than one on half of the stimuli."""
    path = tmp_path / "t.pcapng"
    path.write_bytes(
        layout.section() + layout.interface(layout.UPPER_PDU, "nodeproof journal/2", "")
    )
    with pytest.raises(RecordUnreadable, match="newer nodeproof"):
        list(read_pcapng(path))


def test_payloads_of_other_programs_are_skipped(tmp_path: Path) -> None:
    """A capture may hold more than CAN."""
    path = tmp_path / "t.pcapng"
    ethernet = layout.interface(1, "eth0", "")
    path.write_bytes(layout.section() + ethernet + layout.packet(0, 1, bytes(60)))
    assert list(read_pcapng(path)) == []


def test_a_packet_without_a_stamp_is_refused(tmp_path: Path) -> None:
    """Nothing could be judged by it."""
    path = tmp_path / "t.pcapng"
    simple = layout.block(layout.SIMPLE_PACKET, bytes(12))
    path.write_bytes(layout.section() + layout.interface(227, "can0", "") + simple)
    with pytest.raises(RecordUnreadable, match="without a stamp"):
        list(read_pcapng(path))


def test_notes_are_one_line_for_people() -> None:
    """What happened, with its data, and how exactly the instant is known."""
    assert describe(Mark(1, "HB-01 passed")) == "HB-01 passed"
    assert describe(Moment("power", 5, 5, {"on": True})) == 'power {"on":true}'
    assert describe(Moment("mark", 5, 5)) == "mark"
    assert describe(Moment("send", 0, 3_000)) == "send, took effect within 3 us"
    assert describe(BusEvent(EventKind.STALL, 1)) == "host stalled"
    assert len(describe(Mark(1, "x" * 10_000))) == 2000


def test_whole_numbers_of_any_size_are_kept() -> None:
    """Stamps pass the 53 bits at which other languages begin to round."""
    data = {"at": (1 << 63) - 1, "list": [-(1 << 80)]}
    found = unpack(pack(Mark(1, "x", data)))
    assert isinstance(found, Mark)
    assert found.data == data
    assert json.loads(pack(Mark(1, "x", data))[len(PREFIX) :])["data"] == data
