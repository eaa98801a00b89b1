"""The clock takes the frames of others together as it takes them one by one."""

from __future__ import annotations

from hypothesis import example, given
from hypothesis import strategies as st

from hil_tests.judge.causal import CausalClock
from hil_tests.trace import Sighting
from node_model.frame import Frame
from tests.judge.wire import BEAT, BIT, of_device

OTHERS = [Frame(can_id, b"\x01\x02") for can_id in (0x080, 0x300, 0x300, 0x6FF, 0x702, 0x7FF)]
COMMAND = Frame(0, b"\x01\x00")
FRAMES = (*OTHERS, *OTHERS, BEAT, Frame(0x181), COMMAND)
GAPS = st.sampled_from((3, 3, 3, 3, 4, 5, 6, 20, 999))
"""Bits from the end of a frame to the start of the next one; up to four they are a chain."""


@given(
    row=st.lists(st.tuples(st.sampled_from(FRAMES), GAPS), max_size=25),
    cuts=st.sets(st.integers(0, 24)),
    bit_ns=st.sampled_from((BIT, BIT, 0)),
)
@example(row=[(OTHERS[n % 5], 3) for n in range(25)], cuts=set(), bit_ns=BIT)
@example(row=[(BEAT, 3), *[(OTHERS[-1 - n % 5], 3) for n in range(24)]], cuts={3}, bit_ns=BIT)
def test_frames_of_others_are_dated_together_as_they_are_one_by_one(
    row: list[tuple[Frame, int]], cuts: set[int], bit_ns: int
) -> None:
    """The same instants, and the same evidence for what follows, wherever they are cut."""
    single, many = CausalClock(bit_ns, of_device), CausalClock(bit_ns, of_device)
    now, asked, found = 0, list[int](), list[int]()
    frames, instants = list[Frame](), list[int]()
    for place, (frame, gap) in enumerate((*row, (BEAT, 3))):
        now += (gap + frame.bits) * BIT
        own = frame is COMMAND
        asked.append(single.see(Sighting(frame, now, own=own), place).wanted.earliest)
        if own or of_device(frame) or place in cuts:
            found += many.others(frames, instants)
            found.append(many.see(Sighting(frame, now, own=own), place).wanted.earliest)
            frames, instants = [], []
        else:
            frames.append(frame)
            instants.append(now)
    assert found == asked
    assert many.idle_before(now + 1) == single.idle_before(now + 1)


def test_others_found_the_wire_idle_or_waited() -> None:
    """By hand: one begins, the next may have waited since then, the third since the second."""
    clock = CausalClock(BIT, of_device)
    high, low = OTHERS[0], OTHERS[-1]
    frames = [high, low, high, high]
    starts = [10**9]
    for frame in frames[:2]:
        starts.append(starts[-1] + (frame.bits + 3) * BIT)
    starts.append(2 * 10**9)
    instants = [at + frame.bits * BIT for at, frame in zip(starts, frames, strict=True)]
    first, second, third, fourth = clock.others(frames, instants)
    assert (first, second) == (starts[0] - BIT, starts[0] - BIT)
    assert third == starts[1]
    assert fourth == starts[3] - BIT
