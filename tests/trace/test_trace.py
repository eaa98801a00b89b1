"""The record of a run: nothing lost, nothing changed, in order, and small."""

from __future__ import annotations

import tracemalloc

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hil_tests.clock import Interval
from hil_tests.trace import (
    Burst,
    BusEvent,
    Columns,
    Entry,
    EventKind,
    Mark,
    Moment,
    Sighting,
    Trace,
)
from node_model.frame import MAX_BASE_ID, MAX_EXTENDED_ID, Frame

INT64 = (1 << 63) - 1
MOST_DOUBT = (1 << 32) - 1
FRAMES = [
    Frame(0),
    Frame(0x7FF, b"\xff" * 8),
    Frame(0x705, b"\x05"),
    Frame(0x181, b"\x00\x00\x01"),
    Frame(0x705, remote=True, dlc=1),
    Frame(0x705, remote=True, dlc=15),
    Frame(0x123, bytes(8), dlc=12),
    Frame(0x1FFF_FFFF, b"\x80" + bytes(7), extended=True),
    Frame(0x705, extended=True, remote=True),
]


@st.composite
def sightings(draw: st.DrawFn) -> Sighting:
    """A sighting of any frame at any instant, with any doubt, of our own or not."""
    extended = draw(st.booleans())
    can_id = draw(st.integers(0, MAX_EXTENDED_ID if extended else MAX_BASE_ID))
    if draw(st.booleans()):
        frame = Frame(can_id, remote=True, extended=extended, dlc=draw(st.integers(0, 15)))
    else:
        data = draw(st.binary(max_size=8))
        dlc = draw(st.integers(8, 15)) if len(data) == 8 else len(data)
        frame = Frame(can_id, data, extended=extended, dlc=dlc)
    instant = draw(st.integers(-INT64, INT64))
    return Sighting(frame, instant, draw(st.integers(0, MOST_DOUBT)), own=draw(st.booleans()))


moments = st.builds(
    Moment,
    st.sampled_from(["power", "keys", "bitrate", "send", "mark"]),
    st.integers(0, 10**12),
    st.integers(0, 10**12),
    st.dictionaries(st.sampled_from(["on", "held"]), st.booleans()),
)
events = st.builds(
    BusEvent,
    st.sampled_from(EventKind),
    st.integers(0, 10**12),
    st.sampled_from(["", "bus-off", "rx queue"]),
    st.integers(0, 9),
)
entries = st.lists(sightings() | moments | events, max_size=8)


class Paper:
    """A sink that keeps what was written."""

    def __init__(self) -> None:
        self.lines: list[Entry | Mark] = []

    def write(self, entry: Entry | Mark) -> None:
        """Keeps one entry."""
        self.lines.append(entry)

    def write_all(self, columns: Columns) -> None:
        """Keeps many frames."""
        self.lines.extend(columns.sightings())


def record(trace: Trace, found: list[Entry]) -> None:
    """Puts entries of every kind into a trace."""
    for entry in found:
        if isinstance(entry, Sighting):
            trace.see(entry)
        else:
            trace.note(entry)


def beat(count: int, step_ns: int = 100) -> Trace:
    """A trace of `count` heartbeats, `step_ns` apart, from instant 0."""
    trace = Trace()
    for index in range(count):
        trace.see(Sighting(Frame(0x705, b"\x05"), index * step_ns))
    return trace


# Nothing lost, nothing changed


@given(st.lists(sightings(), max_size=8), st.integers(0, 9))
def test_frames_of_others_come_with_their_places(found: list[Sighting], start: int) -> None:
    """Our own are left out; each of the others is told with its index, from any place on."""
    trace = Trace()
    record(trace, list(found))
    others = [(place, each.frame) for place, each in enumerate(found) if not each.own]
    assert list(trace.others(start)) == [each for each in others if each[0] >= start]


@settings(max_examples=40)
@given(entries)
def test_what_was_recorded_comes_back_in_order(found: list[Entry]) -> None:
    """Frames, stimuli and bus events come back equal, in the order of recording."""
    trace = Trace()
    record(trace, found)
    assert list(trace.entries()) == found


@settings(max_examples=40)
@given(entries)
def test_each_kind_comes_back_by_itself(found: list[Entry]) -> None:
    """Frames, stimuli and events can each be had alone, still in order."""
    trace = Trace()
    record(trace, found)
    assert list(trace.frames()) == [entry for entry in found if isinstance(entry, Sighting)]
    assert list(trace.moments()) == [entry for entry in found if isinstance(entry, Moment)]
    assert list(trace.events()) == [entry for entry in found if isinstance(entry, BusEvent)]


@settings(max_examples=40)
@given(entries)
def test_a_sink_gets_each_entry_at_once(found: list[Entry]) -> None:
    """After each entry every sink holds all entries so far."""
    one, other = Paper(), Paper()
    trace = Trace(one, other)
    for count, entry in enumerate(found, start=1):
        record(trace, [entry])
        assert one.lines == other.lines == found[:count]


@pytest.mark.parametrize("frame", FRAMES, ids=str)
@pytest.mark.parametrize("own", [False, True])
def test_every_kind_of_frame_survives_packing(frame: Frame, *, own: bool) -> None:
    """Formats, remote frames, each length and odd DLCs come out as they went in."""
    trace = Trace()
    trace.see(Sighting(frame, 1_000, 20, own))
    assert trace.frame(0) == Sighting(frame, 1_000, 20, own)
    assert trace.is_own(0) == own


@pytest.mark.parametrize("own", [False, True])
def test_a_burst_is_recorded_like_its_frames(*, own: bool) -> None:
    """Same frames and instants, on paper too, no doubt, and those ours that are."""
    paper = Paper()
    trace = Trace(paper)
    trace.see(Sighting(Frame(1), 5, 3))
    burst = Burst()
    last = len(FRAMES) - 1
    burst.frames += FRAMES
    burst.instants += range(10, 10 + len(FRAMES))
    burst.own += [1, last] if own else []
    assert trace.see_all(burst) == 1
    seen = [Sighting(f, 10 + n, 0, n in burst.own) for n, f in enumerate(FRAMES)]
    assert list(trace.frames(1)) == seen == burst.sightings()
    assert paper.lines[1:] == seen


def test_columns_are_recorded_like_their_frames() -> None:
    """Those of another trace come back as they were, on paper too, after what was there."""
    paper, other = Paper(), Trace()
    seen = [Sighting(f, 10 + n, 3 * n, own=n % 2 == 0) for n, f in enumerate(FRAMES)]
    for each in seen:
        other.see(each)
    trace = Trace(paper)
    trace.see(seen[0])
    columns = Columns(other._head, other._body, other._at, other._doubt)
    assert trace.extend(columns) == 1
    assert list(trace.frames(1)) == seen == list(columns.sightings())
    assert paper.lines[1:] == seen


def test_leading_zero_bytes_are_data() -> None:
    """00 00 01 and 01 are different data, and so are no data and 00."""
    trace = Trace()
    bodies = [b"\x00\x00\x01", b"\x01", b"", b"\x00"]
    for body in bodies:
        trace.see(Sighting(Frame(0x181, body), 0))
    assert [sighting.frame.data for sighting in trace.frames()] == bodies


@pytest.mark.parametrize(
    ("doubt_ns", "kept_ns"),
    [(0, 0), (MOST_DOUBT, MOST_DOUBT), (MOST_DOUBT + 1, MOST_DOUBT), (INT64, MOST_DOUBT)],
)
def test_doubt_is_kept_up_to_four_seconds(doubt_ns: int, kept_ns: int) -> None:
    """Doubt comes back exactly up to 2^32 - 1 ns; more is kept as that."""
    trace = Trace()
    trace.see(Sighting(Frame(1), 0, doubt_ns))
    assert trace.frame(0).doubt_ns == kept_ns


# Where things are


def test_frames_are_numbered_from_zero() -> None:
    """Recording a frame tells its index; the length is the number of frames."""
    trace = Trace()
    assert len(trace) == 0
    assert trace.see(Sighting(Frame(1), 5)) == 0
    trace.note(Moment("mark", 6, 6))
    assert trace.see(Sighting(Frame(2), 7)) == 1
    assert len(trace) == 2


def test_negative_indices_count_from_the_end() -> None:
    """Index -1 is the newest frame, as in a list; outside there is none."""
    trace = beat(3)
    assert trace.frame(-1) == trace.frame(2)
    assert trace.frame(-3) == trace.frame(0)
    for outside in (3, -4):
        with pytest.raises(IndexError):
            trace.frame(outside)


@given(st.integers(0, 6), st.none() | st.integers(-8, 8), st.integers(0, 8))
def test_a_stretch_of_frames_is_cut_like_a_list(count: int, stop: int | None, start: int) -> None:
    """`frames(start, stop)` gives what slicing a list of them would."""
    trace = beat(count)
    assert list(trace.frames(start, stop)) == list(trace.frames())[start:stop]


@settings(max_examples=60)
@given(entries, st.integers(0, 8))
def test_entries_from_a_frame_on_are_the_tail(found: list[Entry], start: int) -> None:
    """From frame `start` on: that frame, and all that came after the frame before it."""
    trace = Trace()
    record(trace, found)
    seen, tail = 0, []
    for entry in found:
        if seen >= start:
            tail.append(entry)
        seen += isinstance(entry, Sighting)
    assert list(trace.entries(start)) == tail


@given(st.lists(st.integers(0, 50), max_size=20).map(sorted), st.integers(-1, 51))
def test_a_frame_is_found_by_its_instant(stamps: list[int], instant: int) -> None:
    """The first frame at or after an instant, among equal stamps the first."""
    trace = Trace()
    for at in stamps:
        trace.see(Sighting(Frame(1), at))
    expected = next((i for i, at in enumerate(stamps) if at >= instant), len(stamps))
    assert trace.index_at(instant) == expected


# Small


def test_a_frame_costs_at_most_40_bytes() -> None:
    """What a long run really allocates for a frame, growth of its columns included."""
    sighting = Sighting(Frame(0x705, b"\x05"), 1)
    trace = Trace()
    tracemalloc.start()
    for _ in range(5_000):
        trace.see(sighting)
    allocated, _ = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert allocated / len(trace) <= 40


def test_the_columns_take_28_bytes_a_frame() -> None:
    """Three and a half words a frame are reported, whatever the frame."""
    trace = Trace()
    assert trace.bytes_used == 0
    for frame in FRAMES:
        trace.see(Sighting(frame, 0))
    assert trace.bytes_used == 28 * len(FRAMES)


# Values


def test_a_stimulus_took_effect_in_an_interval() -> None:
    """The interval of a stimulus reaches from its begin to its end."""
    assert Moment("power", 10, 25).when == Interval(10, 25)


def test_an_entry_of_unknown_origin_is_foreign_and_exact() -> None:
    """Left out, a sighting is another station's and without doubt; an event lost nothing known."""
    sighting = Sighting(Frame(1), 5)
    assert (sighting.doubt_ns, sighting.own) == (0, False)
    assert (BusEvent(EventKind.GAP, 5).text, BusEvent(EventKind.GAP, 5).lost) == ("", 0)
    assert Moment("mark", 1, 1).detail == {}
