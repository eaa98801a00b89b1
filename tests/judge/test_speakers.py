"""Whose frame is it: one by one, and in a row of frames."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from hil_tests.judge.speakers import Speakers
from node_model.frame import Frame
from tests.judge.scene import BEAT, device

BEATS = Frame(BEAT, b"\x7f")
FRAMES = (Frame(0x123), Frame(0x124), Frame(BEAT, extended=True), Frame(0x185), BEATS)


@given(
    row=st.lists(st.sampled_from(FRAMES), max_size=8),
    start=st.integers(0, 8),
    exclusive=st.booleans(),
    neighbours=st.frozensets(st.sampled_from((0x123, 0x124, BEAT))),
)
def test_the_next_frame_of_the_device_is_found(
    row: list[Frame], start: int, exclusive: bool, neighbours: frozenset[int]
) -> None:
    """As by asking for each; what is known to be its beat is its frame, whoever joins."""
    speakers = Speakers(device(exclusive=exclusive))
    speakers.admit(neighbours)
    speakers.give(0x124)
    places = range(start, len(row))
    own = (n for n in places if speakers.are_device(row[n]))
    assert speakers.back_at(row, start, len(row), None) == next(own, len(row))
    beats = (n for n in places if speakers.are_device(row[n]) or row[n] is BEATS)
    assert speakers.back_at(row, start, len(row), BEATS) == next(beats, len(row))
