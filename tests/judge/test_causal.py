"""Causal intervals: the instant at which a frame was asked for lies in them, always.

By hand at 125 kbit/s: a bit takes 8 us; 701#05 has 55 bits or 440 us, between two frames
are 3 bits or 24 us (`Frame.bits` is proved elsewhere, bit by bit).
"""

from __future__ import annotations

from hil_tests.clock import FOREVER, MS, Interval
from hil_tests.judge.causal import (
    ERROR_FRAME_BITS,
    LONGEST_BITS,
    CausalClock,
    Seen,
)
from hil_tests.trace import Sighting
from node_model.frame import Frame
from tests.judge.wire import BEAT, BIT, clock_125, of_device

GAP = 3 * BIT
URGENT = Frame(0x081, b"\x00\x50\x01\x00\x00\x00\x00\x00")
HIGHER = Frame(0x123, b"\x01\x02\x03")
LOWER = Frame(0x7F0, b"\x01\x02\x03\x04")


def chain(clock: CausalClock, first_at: int, *frames: Frame) -> list[Seen]:
    """Frames back to back, the first of which begins at `first_at`."""
    seen, start = [], first_at
    for index, frame in enumerate(frames):
        end = start + frame.bits * BIT
        seen.append(clock.see(Sighting(frame, end), index))
        start = end + GAP
    return seen


def start_of(seen: Seen) -> int:
    """When it began, on an exact clock."""
    return seen.at - seen.frame.bits * BIT


def test_on_an_idle_wire_the_request_is_the_start_to_one_bit() -> None:
    """A frame that found the wire idle was asked for when it began, or one bit earlier."""
    (seen,) = chain(clock_125(), 10 * MS, BEAT)

    assert seen.wanted == Interval(10 * MS - BIT, 10 * MS)
    assert seen.wanted == seen.when


def test_the_doubt_of_the_stamp_widens_the_request() -> None:
    """A stamp that may be late moves the earliest request, not the latest."""
    end = 10 * MS + BEAT.bits * BIT
    seen = clock_125().see(Sighting(BEAT, end, 5000), 0)

    assert seen.wanted == Interval(10 * MS - BIT - 5000, 10 * MS)


def test_a_frame_of_ours_counts_from_its_end() -> None:
    """A stimulus takes effect when its frame has ended, whenever it was asked for."""
    seen = clock_125().see(Sighting(BEAT, 10 * MS, own=True), 7)

    assert seen.own
    assert seen.when == Interval(10 * MS, 10 * MS)
    assert seen.index == 7


def test_behind_a_lower_priority_it_was_asked_for_after_that_began() -> None:
    """It would have won against a frame of lower priority, so it came while that was sent."""
    lower, beat = chain(clock_125(), 10 * MS, LOWER, BEAT)

    assert beat.wanted == Interval(start_of(lower), start_of(beat))


def test_behind_a_higher_priority_it_may_be_as_old_as_the_chain() -> None:
    """A frame of higher priority proves nothing: it may have waited since the chain began."""
    higher, beat = chain(clock_125(), 10 * MS, HIGHER, BEAT)

    assert beat.wanted == Interval(start_of(higher) - BIT, start_of(beat))


def test_the_last_lower_priority_of_the_chain_is_the_evidence() -> None:
    """Later frames of higher priority hide nothing that an earlier one of lower has shown."""
    _, second, _, beat = chain(clock_125(), 10 * MS, LOWER, LOWER, HIGHER, BEAT)

    assert beat.wanted.earliest == start_of(second)


def test_four_bits_of_silence_are_not_yet_idle() -> None:
    """After intermission and one bit the chain goes on; a bit later the wire was idle."""
    for bits, idle in ((4, False), (5, True)):
        clock = clock_125()
        (higher,) = chain(clock, 10 * MS, HIGHER)
        (beat,) = chain(clock, higher.at + bits * BIT, BEAT)

        assert (beat.wanted.earliest == start_of(beat) - BIT) is idle


def test_a_doubtful_stamp_does_not_prove_silence() -> None:
    """Silence counts only as far as the doubt of the stamp leaves it certain."""
    for doubt_ns, idle in ((BIT - 1, True), (BIT, False)):
        clock = clock_125()
        (higher,) = chain(clock, 10 * MS, HIGHER)
        end = higher.at + 5 * BIT + BEAT.bits * BIT
        beat = clock.see(Sighting(BEAT, end, doubt_ns), 1)

        assert (beat.wanted.earliest > higher.at) is idle


def test_the_evidence_is_as_doubtful_as_its_own_stamp() -> None:
    """The start of a lower priority is known as well as that frame was stamped, not this one."""
    clock = clock_125()
    lower = clock.see(Sighting(LOWER, 20 * MS, 3000), 0)
    beat = clock.see(Sighting(BEAT, 20 * MS + GAP + BEAT.bits * BIT, 10), 1)

    assert beat.wanted.earliest == start_of(lower) - 3000


def test_behind_its_own_frame_the_device_may_have_queued_it() -> None:
    """A FIFO mailbox holds an urgent frame behind a slow one: a lower priority proves nothing."""
    first, _, slow, urgent = chain(clock_125(), 10 * MS, HIGHER, LOWER, BEAT, URGENT)

    assert slow.wanted.earliest > start_of(first)
    assert urgent.wanted.earliest == slow.wanted.earliest


def test_what_began_after_its_own_frame_is_evidence_again() -> None:
    """Once the device's earlier frame is out, the next one competes for itself."""
    _, _, lower, urgent = chain(clock_125(), 10 * MS, HIGHER, BEAT, LOWER, URGENT)

    assert urgent.wanted.earliest == start_of(lower)


def test_frames_of_others_do_not_queue_in_the_device() -> None:
    """Behind a stranger's frame the priority alone decides."""
    stranger = Frame(0x100)
    lower, _, seen = chain(clock_125(), 10 * MS, LOWER, BEAT, stranger)

    assert seen.wanted.earliest == start_of(lower) + (LOWER.bits + 3) * BIT


def test_it_may_have_waited_behind_any_of_its_own_since_the_evidence() -> None:
    """A queue in front of several mailboxes: not only the last frame of its own may block it.

    Here 181h waits in the queue until 581h has left its mailbox, then 081h comes later and
    overtakes it: nothing says that 181h was asked for after 581h began.
    """
    _, lower, blocker, passer, overtaker, seen = chain(
        clock_125(), 10 * MS, HIGHER, LOWER, Frame(0x581), Frame(0x100), URGENT, Frame(0x181)
    )

    assert blocker.wanted.earliest == start_of(lower)
    assert overtaker.wanted.earliest == start_of(passer)
    assert seen.wanted.earliest == start_of(lower)


def test_an_untimed_wire_knows_the_stamp_alone() -> None:
    """Without bit times the request is the stamp, within its doubt."""
    clock = CausalClock(0, of_device)
    seen = clock.see(Sighting(BEAT, 10 * MS, 300), 0)

    assert seen.wanted == Interval(10 * MS - 300, 10 * MS)


def test_a_watch_that_begins_amid_traffic_knows_nothing_of_the_chain_before() -> None:
    """The first frame may have waited in a chain that nobody saw; after silence it did not."""
    busy = CausalClock(BIT, of_device, since=10 * MS)
    quiet = CausalClock(BIT, of_device, since=10 * MS)

    assert chain(busy, 10 * MS - BIT, BEAT)[0].wanted.earliest == -FOREVER
    (seen,) = chain(quiet, 10 * MS + 5 * BIT, BEAT)
    assert seen.wanted.earliest == start_of(seen) - BIT


def test_an_error_frame_keeps_the_wire_busy() -> None:
    """What is sent after it may have been on the wire before it: the chain goes on."""
    clock = clock_125()
    (lower,) = chain(clock, 10 * MS, LOWER)
    clock.disturb(15 * MS)
    retried, _ = chain(clock, 15 * MS + 23 * BIT, BEAT, HIGHER)

    assert retried.wanted.earliest == start_of(lower) - BIT


def test_after_an_error_frame_and_silence_the_wire_is_idle_again() -> None:
    """Past the longest error frame and its intermission a start is a request."""
    clock = clock_125()
    chain(clock, 10 * MS, LOWER)
    clock.disturb(15 * MS)
    (seen,) = chain(clock, 15 * MS + (ERROR_FRAME_BITS + 5) * BIT, BEAT)

    assert seen.wanted.earliest == start_of(seen) - BIT


def test_a_disturbance_of_the_past_does_not_shorten_the_chain() -> None:
    """An error told late leaves the wire busy until the last frame's end."""
    clock = clock_125()
    higher = chain(clock, 10 * MS, HIGHER)[0]
    clock.disturb(9 * MS)
    (beat,) = chain(clock, higher.at + GAP, BEAT)

    assert beat.wanted.earliest == start_of(higher) - BIT


def test_after_a_loss_what_came_before_is_no_evidence() -> None:
    """A lost frame may have been the device's own, with this one queued behind it."""
    clock = clock_125()
    first, lower = chain(clock, 10 * MS, HIGHER, LOWER)
    clock.disturb(lower.at)
    (beat,) = chain(clock, lower.at + 100 * BIT, BEAT)
    assert beat.wanted.earliest == start_of(beat) - BIT
    clock = clock_125()
    first, lower = chain(clock, 10 * MS, HIGHER, LOWER)
    clock.disturb(lower.at + 100 * BIT)
    (beat,) = chain(clock, lower.at + 106 * BIT, BEAT)
    assert beat.wanted.earliest == start_of(first) - BIT


def test_at_another_bit_rate_frames_have_another_length() -> None:
    """From the change on bits are counted anew, and what was before was not heard."""
    clock = clock_125()
    chain(clock, 10 * MS, LOWER)
    clock.retune(1000, 20 * MS)
    early = clock.see(Sighting(BEAT, 20 * MS + BEAT.bits * 1000), 1)
    late = clock.see(Sighting(BEAT, 30 * MS), 2)

    assert early.wanted == Interval(-FOREVER, 20 * MS)
    assert late.wanted.doubt_ns == 1000
    assert late.wanted.latest == 30 * MS - BEAT.bits * 1000


def test_on_an_idle_wire_a_longest_frame_would_have_ended() -> None:
    """What is not seen by now was not asked for before a longest frame's time ago."""
    clock = clock_125()
    chain(clock, 10 * MS, BEAT)

    assert clock.idle_before(20 * MS) == 20 * MS - LONGEST_BITS * BIT


def test_on_a_busy_wire_a_frame_may_wait_since_the_chain_began() -> None:
    """While frames go back to back, one of lower priority may still wait."""
    clock = clock_125()
    first, *_, last = chain(clock, 10 * MS, *[HIGHER] * 5)
    longest_ns = LONGEST_BITS * BIT

    assert clock.idle_before(last.at + longest_ns) == start_of(first) - BIT
    assert clock.idle_before(last.at + longest_ns + 1) == last.at + 1


def test_a_short_chain_does_not_speed_up_a_longest_frame() -> None:
    """Right after the only frame the longest frame still counts."""
    clock = clock_125()
    (seen,) = chain(clock, 10 * MS, Frame(0x7FF))

    assert clock.idle_before(seen.at) == seen.at - LONGEST_BITS * BIT


def test_no_frame_is_longer_than_the_longest() -> None:
    """The most bits a frame can have, with its intermission, are what the judge allows for."""
    worst = Frame(0x1FFF_FFFF & 0x10F0_F0F0, bytes(8), extended=True)

    assert 140 < worst.bits + 3 <= LONGEST_BITS
