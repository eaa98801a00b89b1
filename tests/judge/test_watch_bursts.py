"""The watch takes frames together as it takes them one by one: the same verdicts, either way."""

from __future__ import annotations

from collections.abc import Sequence

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hil_tests.clock import MS
from hil_tests.judge.cobs import nmt_frame
from hil_tests.trace import Burst, Moment, Sighting
from node_model.frame import Frame
from tests.judge.scene import BEAT, NODE, Scene, device

RIGHT, WRONG = Frame(BEAT, b"\x7f"), Frame(BEAT, b"\x04")
FRAMES = (RIGHT, RIGHT, RIGHT, WRONG, Frame(BEAT, b"\x00"), Frame(0x123), Frame(0x185, b"\x00"))
STOP = nmt_frame(2, NODE)
Row = Sequence[tuple[Frame, int]]


def verdicts(
    row: Row, bit_ns: int, *, together: bool, exclusive: bool = True
) -> tuple[list[str], list[str]]:
    """What is wrong with frames that follow a start, and when each was asked for.

    Args:
        row: frames, each with its distance in ms from the one before; `STOP` is the tester's.
        bit_ns: 0 = an untimed wire.
        together: they come in one burst.
        exclusive: nobody else lives on the bus.
    """
    scene = Scene(device(exclusive=exclusive), bit_ns=bit_ns).started()
    scene.beats([150, 250])
    burst, now = Burst(), 250 * MS
    for frame, span_ms in row:
        now += span_ms * MS
        if frame is STOP:
            burst.own.append(len(burst))
        burst.frames.append(frame)
        burst.instants.append(now)
    if together:
        asked = scene.watch.see_all(burst, 3)
    else:
        asked = []
        for place, (frame, at) in enumerate(zip(burst.frames, burst.instants, strict=True), 3):
            seen = scene.watch.see(Sighting(frame, at, own=frame is STOP), place)
            asked.append(seen.wanted.earliest)
    scene.beats([now / MS + 100, now / MS + 200], 0x04 if burst.own else 0x7F)
    return [str(verdict) for verdict in scene.verdicts(now / MS + 201)], [str(a) for a in asked]


@settings(max_examples=60, deadline=None)
@given(
    row=st.lists(
        st.tuples(
            st.sampled_from((*FRAMES, STOP)), st.sampled_from((1, 50, 99, 100, 100, 101, 140))
        ),
        min_size=1,
        max_size=8,
    ),
    bit_ns=st.sampled_from((0, 4000)),
    exclusive=st.booleans(),
)
def test_a_burst_is_judged_as_its_frames_are(row: Row, bit_ns: int, exclusive: bool) -> None:
    """Right beats, wrong ones, boot-ups, strange frames, at any distance, and commands."""
    alone, asked_alone = verdicts(row, bit_ns, together=False, exclusive=exclusive)
    together, asked = verdicts(row, bit_ns, together=True, exclusive=exclusive)
    assert together == alone
    assert asked == asked_alone


@pytest.mark.parametrize(("span_ms", "blamed"), [(100, 0), (120, 1)])
def test_beats_of_a_burst_are_held_against_their_limits(span_ms: int, blamed: int) -> None:
    """Many that are right are taken at once; one that is not is told."""
    row = [(RIGHT, 100)] * 5 + [(RIGHT, span_ms)] + [(RIGHT, 100)] * 5
    found, _ = verdicts(row, 4000, together=True)
    assert len(found) == blamed
    assert all(text.startswith("HB-01") for text in found)


def test_a_start_with_keys_held_that_is_missing() -> None:
    """That keys other than the two lead to a regular start is a reading of ours (COM-27)."""
    for held, blamed in (([], ["NMT-02"]), (["k3"], ["COM-27"])):
        scene = Scene()
        detail = {"on": True, "mode": "regular", "held": held}
        scene.watch.did(Moment("power", 0, 0, detail))
        assert scene.blamed(2000) == blamed


def test_a_start_with_keys_held_that_is_heard_is_a_regular_one() -> None:
    """What it lacks then, the boot-up, it lacks with every key: NMT-02."""
    scene = Scene()
    scene.watch.did(Moment("power", 0, 0, {"on": True, "mode": "regular", "held": ["k3"]}))
    scene.see(Frame(0x085, bytes(8)), 150)
    assert {"NMT-02"} <= set(scene.blamed(2000))
    assert "COM-27" not in scene.blamed(2000)
