"""Recordings in columns: the same as the reader gives, whatever the file is like."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hil_tests.reporting.html.recording import Kinds, read_recording
from hil_tests.reporting.pcapng import PcapngSink, read_pcapng
from hil_tests.trace import BusEvent, Entry, EventKind, Mark, Moment, Sighting
from node_model.frame import Frame
from tests.reporting.html.making import write_trace


def entries_of(path: Path) -> tuple[list[Entry], str]:
    """What the columns hold, as entries, and the damage."""
    recording = read_recording(path, Kinds(str))
    found: list[Entry] = []
    index = 0
    for place, note in [*recording.notes, (len(recording), None)]:
        found += map(recording.sighting, range(index, place))
        index = place
        if note is not None:
            found.append(note)
    return found, recording.damage


SIGHTINGS = st.builds(
    Sighting,
    st.builds(Frame, st.integers(0, 0x7FF), st.binary(max_size=8)),
    st.integers(-(10**9), 10**18),
    st.sampled_from([0, 1, 20_000, 30_000]),
    st.booleans(),
)
ENTRIES = st.one_of(
    SIGHTINGS,
    st.just(Sighting(Frame(0x705, remote=True, dlc=1), 7, 0, own=True)),
    st.just(Sighting(Frame(0x1234567, b"\x01", extended=True), 8)),
    st.just(Sighting(Frame(0x123, bytes(8), dlc=11), 9)),
    st.just(Moment("power", 5, 9, {"on": False})),
    st.just(BusEvent(EventKind.GAP, 11, "ring is full", lost=3)),
)


@pytest.mark.slow
@given(st.lists(ENTRIES, max_size=30))
def test_columns_hold_what_was_written(
    tmp_path_factory: pytest.TempPathFactory, written: list[Entry]
) -> None:
    """Frames, stimuli and events come back in order, exactly."""
    path = tmp_path_factory.mktemp("trace") / "t.pcapng"
    with PcapngSink(path, interface="vcan0", clock="test", flush=False) as sink:
        for entry in written:
            sink.write(entry)
    assert entries_of(path) == (written, "")


def test_marks_of_the_judge_are_left_out(tmp_path: Path) -> None:
    """What the judge said stands in the results; the columns hold what happened."""
    path = tmp_path / "t.pcapng"
    with PcapngSink(path, interface="vcan0", clock="test", flush=False) as sink:
        sink.write(Mark(5, "NMT-02", {}))
    assert entries_of(path) == ([], "")
    assert [type(entry) for entry in read_pcapng(path)] == [Mark]


def test_many_doubts_are_read_as_well(tmp_path: Path) -> None:
    """Where a comment tells the doubt of a frame, the slower reader is asked."""
    path = tmp_path / "t.pcapng"
    written: list[Entry] = [Sighting(Frame(0x81, bytes(8)), n, n + 1) for n in range(20)]
    with PcapngSink(path, interface="vcan0", clock="test", flush=False) as sink:
        for entry in written:
            sink.write(entry)
    assert entries_of(path) == (written, "")


def test_a_cut_recording_ends_in_a_gap(tmp_path: Path) -> None:
    """Wherever a file breaks off, what stands before is shown, and that it breaks off."""
    path = write_trace(tmp_path / "traces" / "t.pcapng")
    whole = path.read_bytes()
    for size in range(len(whole) - 1, 0, -97):
        path.write_bytes(whole[:size])
        found, damage = entries_of(path)
        assert damage or (isinstance(found[-1], BusEvent) and found[-1].kind is EventKind.GAP)


@pytest.mark.parametrize("byte", range(0, 400, 13))
def test_damage_is_told_or_harmless(tmp_path: Path, byte: int) -> None:
    """A wrong byte anywhere raises nothing."""
    path = write_trace(tmp_path / "traces" / "t.pcapng")
    content = bytearray(path.read_bytes())
    content[byte] ^= 0xFF
    path.write_bytes(bytes(content))
    entries_of(path)


def test_what_is_no_recording_is_said(tmp_path: Path) -> None:
    """A text file gives a sentence with its name."""
    path = tmp_path / "t.pcapng"
    path.write_text("hello, this is not a recording at all", "utf-8")
    found, damage = entries_of(path)
    assert found == []
    assert "t.pcapng" in damage
