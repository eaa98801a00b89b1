"""The record on disk: everything comes back, nothing is lost, damage is told plainly."""

from __future__ import annotations

import random
import signal
import subprocess
import sys
import textwrap
from array import array
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hil_tests.errors import BenchError
from hil_tests.reporting import pcapng_layout as layout
from hil_tests.reporting.files import RecordUnreadable
from hil_tests.reporting.pcapng import PcapngSink, read_pcapng
from hil_tests.trace import OWN, BusEvent, Columns, Entry, EventKind, Mark, Moment, Sighting, Trace
from node_model.frame import MAX_BASE_ID, MAX_EXTENDED_ID, Frame

INT64 = (1 << 63) - 1
SAMPLE: list[Entry] = [
    Sighting(Frame(0x705, b"\x00"), 5),
    Moment("power", 100, 2_000, {"on": False, "rail": "main", "steps": [1, 2.5, None]}),
    Sighting(Frame(0x000, b"\x01\x05"), 123_456_789, own=True),
    BusEvent(EventKind.GAP, 200_000_000, "ring is full", lost=7),
    Sighting(Frame(0x705, remote=True, dlc=15), 300_000_000, 1_000_000),
    Sighting(
        Frame(0x1FFF_FFFF, bytes(range(8)), extended=True, dlc=12), 400_000_001, 20_000, True
    ),
]


def record(path: Path, *entries: Entry, flush: bool = False) -> Path:
    """A recording of these entries."""
    with PcapngSink(path, interface="vcan0", clock="virtual time", flush=flush) as sink:
        for entry in entries:
            sink.write(entry)
    return path


def plain() -> st.SearchStrategy[object]:
    """Values that JSON has words for."""
    leaves = st.none() | st.booleans() | st.integers() | st.text(max_size=5)
    return st.recursive(
        leaves | st.floats(allow_nan=False, allow_infinity=False),
        lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=3), inner),
        max_leaves=5,
    )


@st.composite
def sightings(draw: st.DrawFn) -> Sighting:
    """Any frame at any instant with any doubt."""
    extended = draw(st.booleans())
    can_id = draw(st.integers(0, MAX_EXTENDED_ID if extended else MAX_BASE_ID))
    if draw(st.booleans()):
        frame = Frame(can_id, remote=True, extended=extended, dlc=draw(st.integers(0, 15)))
    else:
        data = draw(st.binary(max_size=8))
        dlc = draw(st.integers(8, 15)) if len(data) == 8 else len(data)
        frame = Frame(can_id, data, extended=extended, dlc=dlc)
    at, doubt_ns = draw(st.integers(-INT64, INT64)), draw(st.integers(0, INT64))
    return Sighting(frame, at, doubt_ns, draw(st.booleans()))


INSTANTS = st.integers(-INT64, INT64)
MOMENTS = st.builds(
    Moment, st.text(), INSTANTS, INSTANTS, st.dictionaries(st.text(max_size=4), plain())
)
EVENTS = st.builds(
    BusEvent, st.sampled_from(EventKind), INSTANTS, st.text(), st.integers(0, INT64)
)


@pytest.mark.slow
@given(entries=st.lists(sightings() | MOMENTS | EVENTS, max_size=6), flush=st.booleans())
@settings(max_examples=40)
def test_everything_written_comes_back_exactly(
    entries: list[Entry], flush: bool, tmp_path_factory: pytest.TempPathFactory
) -> None:
    """Frames, owners, doubts, stimuli and events survive the way to disk and back."""
    path = tmp_path_factory.getbasetemp() / "round.pcapng"
    assert list(read_pcapng(record(path, *entries, flush=flush))) == entries


def test_more_doubts_than_interfaces_come_back_too(tmp_path: Path) -> None:
    """Frames of rare doubt carry it in a comment."""
    entries = [Sighting(Frame(0x705, b"\x05"), i, i * 1000, i % 2 == 0) for i in range(40)]
    assert list(read_pcapng(record(tmp_path / "t.pcapng", *entries))) == entries


def columns_of(sightings: list[Sighting]) -> Columns:
    """The same as columns."""
    return Columns(
        array("q", [seen.frame.head | (OWN if seen.own else 0) for seen in sightings]),
        array("Q", [seen.frame.body for seen in sightings]),
        array("q", [seen.at for seen in sightings]),
        array("I", [seen.doubt_ns for seen in sightings]),
    )


@given(
    seen=st.lists(sightings(), max_size=8), doubts=st.lists(st.integers(0, 2**32 - 1), min_size=1)
)
@settings(max_examples=40)
def test_columns_are_written_as_their_frames_are(
    seen: list[Sighting], doubts: list[int], tmp_path_factory: pytest.TempPathFactory
) -> None:
    """Byte by byte the same, whether their doubts are, and before and after single ones."""
    seen = [each._replace(doubt_ns=doubts[n % len(doubts)]) for n, each in enumerate(seen)]
    folder = tmp_path_factory.getbasetemp()
    path = folder / "columns.pcapng"
    with PcapngSink(path, interface="vcan0", clock="virtual time", flush=False) as sink:
        for part in (seen[:1], seen[1:], seen[:1]):
            sink.write_all(columns_of(part))
    singles = record(folder / "singles.pcapng", *seen, *seen[:1])
    assert path.read_bytes() == singles.read_bytes()


def test_columns_of_more_doubts_than_interfaces_come_back_too(tmp_path: Path) -> None:
    """A doubt for which there is no interface any more is told in comments."""
    path = tmp_path / "t.pcapng"
    seen = [[Sighting(Frame(1), i * 10 + n, i * 1000) for n in range(3)] for i in range(40)]
    with PcapngSink(path, interface="vcan0", clock="virtual time", flush=True) as sink:
        for part in seen:
            sink.write_all(columns_of(part))
    assert list(read_pcapng(path)) == [each for part in seen for each in part]


def test_more_identifiers_than_are_remembered_come_back_too(tmp_path: Path) -> None:
    """Five thousand extended ones, single and as columns."""
    seen = [Sighting(Frame(i * 7919, b"x", extended=True), i) for i in range(5000)]
    path = tmp_path / "t.pcapng"
    with PcapngSink(path, interface="vcan0", clock="virtual time", flush=False) as sink:
        for each in seen:
            sink.write(each)
        sink.write_all(columns_of(seen))
    assert list(read_pcapng(path)) == seen * 2


def test_a_verdict_mark_keeps_its_text_and_data(tmp_path: Path) -> None:
    """What the judge notes can be read again."""
    path = tmp_path / "t.pcapng"
    with PcapngSink(path, interface="vcan0", clock="virtual time", flush=False) as sink:
        sink.write(Mark(42, "HB-01 passed", {"measured_ns": [99, 101]}))
    assert list(read_pcapng(path)) == [Mark(42, "HB-01 passed", {"measured_ns": [99, 101]})]


def test_a_trace_writes_itself(tmp_path: Path) -> None:
    """As the sink of a trace it gets each entry in the order in which it became known."""
    path = tmp_path / "t.pcapng"
    with PcapngSink(path, interface="vcan0", clock="virtual time", flush=False) as sink:
        trace = Trace(sink)
        for entry in SAMPLE:
            if isinstance(entry, Sighting):
                trace.see(entry)
            else:
                trace.note(entry)
    assert list(read_pcapng(path)) == SAMPLE


def test_sets_and_mappings_of_a_stimulus_become_lists_and_objects(tmp_path: Path) -> None:
    """A detail that JSON has no word for is written in the nearest one."""
    moment = Moment("keys", 1, 2, {"held": frozenset(("k3", "aut"))})
    (found,) = read_pcapng(record(tmp_path / "t.pcapng", moment))
    assert found == Moment("keys", 1, 2, {"held": ["aut", "k3"]})


def test_a_detail_that_is_no_plain_data_is_refused_by_name(tmp_path: Path) -> None:
    """Better an error at once than a recording that cannot be judged again."""
    with pytest.raises(TypeError, match="Path"):
        record(tmp_path / "t.pcapng", Moment("mark", 0, 0, {"where": Path("x")}))


@pytest.mark.parametrize("flush", [True, False])
def test_a_killed_process_has_lost_nothing(tmp_path: Path, flush: bool) -> None:
    """Each entry is with the operating system when `write` returns."""
    path = tmp_path / "t.pcapng"
    program = textwrap.dedent(f"""
        import os, signal
        from pathlib import Path
        from hil_tests.reporting.pcapng import PcapngSink
        from hil_tests.trace import Sighting
        from node_model.frame import Frame
        sink = PcapngSink(Path({str(path)!r}), interface="v", clock="c", flush={flush})
        for i in range(100):
            sink.write(Sighting(Frame(0x705, b"\\5"), i))
        os.kill(os.getpid(), signal.SIGKILL)
    """)
    done = subprocess.run([sys.executable, "-c", program], check=False)
    assert done.returncode == -signal.SIGKILL
    assert [entry.at for entry in read_pcapng(path) if isinstance(entry, Sighting)] == [
        *range(100)
    ]


def test_wherever_a_file_breaks_off_the_whole_blocks_are_read(tmp_path: Path) -> None:
    """A cut gives the entries before it and one event that names the place."""
    whole = record(tmp_path / "t.pcapng", *SAMPLE).read_bytes()
    cut = tmp_path / "cut.pcapng"
    for size in range(60, len(whole), 11):
        cut.write_bytes(whole[:size])
        found = list(read_pcapng(cut))
        events = [entry for entry in found[-1:] if isinstance(entry, BusEvent)]
        told = bool(events) and "breaks off in the block at offset" in events[0].text
        kept = found[:-1] if told else found
        assert kept == SAMPLE[: len(kept)]
        assert told or size in boundaries(whole)


def boundaries(raw: bytes) -> set[int]:
    """Offsets at which a block ends."""
    places, place = set(), 0
    while place < len(raw):
        place += int.from_bytes(raw[place + 4 : place + 8], "big")
        places.add(place)
    return places


def test_a_tail_of_zeros_is_a_break(tmp_path: Path) -> None:
    """After a power cut some file systems leave zeros where data should be."""
    path = record(tmp_path / "t.pcapng", SAMPLE[0])
    path.write_bytes(path.read_bytes() + bytes(5000))
    *kept, event = read_pcapng(path)
    assert kept == SAMPLE[:1]
    assert isinstance(event, BusEvent)
    assert event.kind is EventKind.GAP


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"", "no pcapng file"),
        (b"\xd4\xc3\xb2\xa1" + bytes(20), "no pcapng file"),
        (b"\x0a\x0d\x0d\x0a\0\0\0\x1cABCD" + bytes(16), "unknown byte order"),
        (b"\x0a\x0d\x0d\x0a\xff\xff\xff\xfc\x1a\x2b\x3c\x4d" + bytes(16), "bytes long"),
    ],
)
def test_what_is_no_recording_is_refused_with_file_and_offset(
    tmp_path: Path, content: bytes, said: str
) -> None:
    """The error names the file, the place, and what is wrong there."""
    path = tmp_path / "t.pcapng"
    path.write_bytes(content)
    with pytest.raises(RecordUnreadable, match=rf"t\.pcapng, offset 0: .*{said}"):
        list(read_pcapng(path))


@pytest.mark.parametrize(
    ("block", "said"),
    [
        (layout.block(layout.ENHANCED_PACKET, bytes(16)), "too short for a packet"),
        (layout.block(layout.INTERFACE_DESCRIPTION, bytes(4)), "too short for what it holds"),
        (layout.packet(7, 0, bytes(8)), "interface 7, which was never described"),
        (layout.packet(0, 0, bytes(7)), "7 bytes, too few for a CAN frame"),
        (layout.packet(0, 0, b"\0\0\x08\0" + bytes(4)), "holds no CAN frame"),
        (layout.packet(0, 0, bytes(8))[:-4] + bytes(4), "not at its end"),
        (b"\0\0\0\6\0\0\0\x0d" + bytes(13), "cannot be 13 bytes long"),
        (
            layout.block(6, bytes(12) + b"\0\0\0\x40\0\0\0\x40" + bytes(8)),
            "claims 64 bytes and holds 8",
        ),
        (
            layout.block(6, bytes(12) + b"\0\0\0\x08\0\0\0\x08" + bytes(8) + b"\0\1\0\x99"),
            "an option 1 that reaches past its end",
        ),
    ],
)
def test_damage_inside_a_recording_is_told_with_its_offset(
    tmp_path: Path, block: bytes, said: str
) -> None:
    """The place of the block, and what cannot be about it."""
    head = layout.section() + layout.interface(layout.CAN_SOCKETCAN, "can0", "")
    path = tmp_path / "t.pcapng"
    path.write_bytes(head + block)
    with pytest.raises(RecordUnreadable, match=rf"offset {len(head)}: the block there .*{said}"):
        list(read_pcapng(path))


@pytest.mark.parametrize(
    ("resolution", "stamp", "at"),
    [(b"\x09", 5, 5), (b"\x06", 5, 5_000), (b"\x83", 12, 1_500_000_000), (b"\x0c", 7_900, 7)],
)
def test_every_resolution_of_stamps_is_read(
    tmp_path: Path, resolution: bytes, stamp: int, at: int
) -> None:
    """Powers of ten and of two; an offset in seconds is added."""
    described = layout.block(
        layout.INTERFACE_DESCRIPTION,
        b"\0\xe3"
        + bytes(6)
        + layout.options((layout.IF_TSRESOL, resolution), (layout.IF_TSOFFSET, bytes(7) + b"\2")),
    )
    path = tmp_path / "t.pcapng"
    path.write_bytes(layout.section() + described + layout.packet(0, stamp, bytes(8)))
    assert list(read_pcapng(path)) == [Sighting(Frame(0), 2_000_000_000 + at)]


@pytest.mark.slow
def test_a_note_too_large_for_a_block_is_refused(tmp_path: Path) -> None:
    """It could not be read again."""
    with pytest.raises(ValueError, match="too many for one note"):
        record(tmp_path / "t.pcapng", Moment("mark", 0, 0, {"x": "y" * layout.LARGEST_BLOCK}))


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    """No traceback of the operating system's."""
    with pytest.raises(RecordUnreadable, match="No such file"):
        list(read_pcapng(tmp_path / "none.pcapng"))


@pytest.mark.parametrize("seed", range(8))
def test_damage_gives_entries_or_a_clear_error(tmp_path: Path, seed: int) -> None:
    """Whatever bytes are changed, reading ends, with entries or with `RecordUnreadable`."""
    chance = random.Random(seed)
    whole = record(tmp_path / "t.pcapng", *SAMPLE, *SAMPLE).read_bytes()
    path = tmp_path / "bad.pcapng"
    for _ in range(30):
        raw = bytearray(whole)
        for _ in range(chance.choice((1, 2, 8))):
            raw[chance.randrange(len(raw))] = chance.randrange(256)
        path.write_bytes(raw)
        try:
            assert len(list(read_pcapng(path))) <= 2 * len(SAMPLE) + 1
        except RecordUnreadable as error:
            assert "offset" in str(error)


def test_a_capture_in_little_endian_microseconds_is_read(tmp_path: Path) -> None:
    """Captures of other programs count as recordings: stamps in us, other byte order."""

    def block(kind: int, body: str) -> bytes:
        raw = bytes.fromhex(body)
        size = (len(raw) + 12).to_bytes(4, "little")
        return kind.to_bytes(4, "little") + size + raw + size

    path = tmp_path / "t.pcapng"
    path.write_bytes(
        block(0x0A0D0D0A, "4d3c2b1a 01000000 ffffffffffffffff")
        + block(1, "e3000000 00000000")
        + block(6, "00000000 00000000 03000000 09000000 09000000 00000705 01000000 05000000")
        + block(
            6, "00000000 00000000 04000000 10000000 10000000 20000004 08000000 0004000000000000"
        )
        + block(6, "00000000 00000000 05000000 09000000 09000000 00000705 0c040000 05000000")
    )
    assert list(read_pcapng(path)) == [
        Sighting(Frame(0x705, b"\x05"), 3000),
        BusEvent(EventKind.ERROR, 4000, "class 0x4, data 0004000000000000"),
        BusEvent(EventKind.FD_FRAME, 5000, "identifier 705h, 12 bytes"),
    ]


def test_a_place_that_cannot_be_written_is_named_with_a_remedy(tmp_path: Path) -> None:
    """A missing folder is an error of the bench, with the option that helps."""
    with pytest.raises(BenchError, match="--can-reports"):
        record(tmp_path / "none" / "t.pcapng")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="this system has no /dev/full")
@pytest.mark.parametrize("flush", [True, False])
def test_a_full_disk_is_an_error_of_the_bench(flush: bool) -> None:
    """What could not be stored is never silently lost."""
    with pytest.raises(BenchError, match="No space left"):
        record(Path("/dev/full"), *SAMPLE, flush=flush)


def test_a_disk_that_fills_up_is_an_error_and_no_signal(tmp_path: Path) -> None:
    """A mapped file takes its room before it uses it: no access to memory that is not there."""
    path = tmp_path / "t.pcapng"
    program = textwrap.dedent(f"""
        import resource
        from pathlib import Path
        from hil_tests.errors import BenchError
        from hil_tests.reporting.pcapng import PcapngSink
        from hil_tests.trace import Sighting
        from node_model.frame import Frame
        resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, 100_000))
        sink = PcapngSink(Path({str(path)!r}), interface="v", clock="c", flush=False)
        try:
            for i in range(10_000):
                sink.write(Sighting(Frame(0x705, b"\5"), i))
        except BenchError as error:
            print(error)
    """)
    done = subprocess.run([sys.executable, "-c", program], check=False, capture_output=True)
    assert done.returncode == 0, done.stderr
    assert b"File too large; make room there" in done.stdout
    assert sum(isinstance(entry, Sighting) for entry in read_pcapng(path)) > 1000


@pytest.mark.parametrize("flush", [True, False])
def test_a_recording_can_begin_again_and_be_renamed(tmp_path: Path, flush: bool) -> None:
    """Nothing of before is in it, whatever doubts there were."""
    path, other = tmp_path / "t.pcapng", tmp_path / "u.pcapng"
    with PcapngSink(path, interface="vcan0", clock="virtual time", flush=flush) as sink:
        for entry in SAMPLE:
            sink.write(entry)
        sink.restart()
        sink.write(SAMPLE[4])
        sink.rename(other)
        sink.write(SAMPLE[0])
        with pytest.raises(BenchError, match="No such file"):
            sink.rename(tmp_path / "none" / "t.pcapng")
    assert list(read_pcapng(other)) == [SAMPLE[4], SAMPLE[0]]
    assert not path.exists()


def test_a_recording_can_be_read_while_it_grows(tmp_path: Path) -> None:
    """Each entry is there for readers as soon as it is written."""
    path = tmp_path / "t.pcapng"
    with PcapngSink(path, interface="vcan0", clock="virtual time", flush=True) as sink:
        for count, entry in enumerate(SAMPLE, 1):
            sink.write(entry)
            assert list(read_pcapng(path)) == SAMPLE[:count]
