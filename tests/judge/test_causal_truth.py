"""Causal intervals against a world that knows the truth: it is inside, whatever happens."""

from __future__ import annotations

from dataclasses import dataclass

from hypothesis import given, settings
from hypothesis import strategies as st

from hil_tests.clock import FOREVER, MS
from hil_tests.judge.causal import CausalClock
from hil_tests.trace import Sighting
from node_model.controller import Mailbox
from node_model.frame import Frame
from tests.judge.wire import BEAT, BIT, DEVICE, Request, Told, Wire, clock_125, of_device

BIT_RATES = (50_000, 125_000, 1_000_000)
DEVICE_IDS = st.sampled_from(sorted(DEVICE))
OTHER_IDS = st.sampled_from([0x000, 0x080, 0x100, 0x1FF, 0x300, 0x5FF, 0x6FF, 0x702, 0x7FF])
MAILBOXES = st.sampled_from(Mailbox)


@dataclass(frozen=True, slots=True)
class Plan:
    """What is asked for on a wire, in bit times so that it is busy at every bit rate."""

    bit_rate: int
    stations: tuple[tuple[bool, Mailbox, tuple[tuple[int, Frame], ...]], ...]
    """Whether the device's, mailbox, and requests: bits since the last, frame."""

    def wire(self) -> Wire:
        """The stations on a wire."""
        wire = Wire(self.bit_rate)
        for _, mailbox, requests in self.stations:
            at, script = 1000, list[Request]()
            for bits, frame in requests:
                at += bits * wire.world.bit_ns
                script.append((at, frame))
            wire.join(script, mailbox)
        return wire


def requests_of(
    ids: st.SearchStrategy[int], most: int
) -> st.SearchStrategy[tuple[tuple[int, Frame], ...]]:
    """Requests of one station: bursts, near misses of an idle wire, and pauses."""
    spaces = st.one_of(st.just(0), st.integers(0, 8), st.integers(40, 180), st.integers(0, 2000))
    frames = st.builds(Frame, ids, st.binary(max_size=8))
    return st.lists(st.tuples(spaces, frames), min_size=1, max_size=most).map(tuple)


DEVICES = st.lists(
    st.tuples(st.just(True), MAILBOXES, requests_of(DEVICE_IDS, 12)), min_size=1, max_size=2
)
"""One or two queues of the device."""
OTHERS = st.lists(
    st.tuples(st.just(False), st.just(Mailbox.BY_IDENTIFIER), requests_of(OTHER_IDS, 20)),
    max_size=3,
)
PLANS = st.builds(
    lambda rate, devices, others: Plan(rate, (*devices, *others)),
    st.sampled_from(BIT_RATES),
    DEVICES,
    OTHERS,
)


def outside(told: list[Told]) -> list[str]:
    """The frames whose truth is not in their interval."""
    return [str(each) for each in told if not each.inside]


@settings(max_examples=60)
@given(plan=PLANS)
def test_the_truth_is_inside_whatever_is_on_the_wire(plan: Plan) -> None:
    """Random stations of every priority, one or two queues in the device, bursts, bit rates."""
    wire = plan.wire()
    told = wire.watch(CausalClock(wire.world.bit_ns, of_device), FOREVER - 1)

    assert len(told) == sum(len(requests) for _, _, requests in plan.stations)
    assert not outside(told)


@settings(max_examples=40)
@given(plan=PLANS, delays=st.lists(st.tuples(st.integers(0, 30), st.integers(0, 30)), min_size=1))
def test_the_truth_is_inside_when_stamps_are_late(
    plan: Plan, delays: list[tuple[int, int]]
) -> None:
    """Each frame is stamped late, within its own doubt, in the order of the wire."""
    wire = plan.wire()
    bit_ns = wire.world.bit_ns

    def late(place: int, end: int) -> tuple[int, int]:
        delay, more = delays[place % len(delays)]
        return end + delay * bit_ns, (delay + more) * bit_ns

    told = wire.watch(CausalClock(bit_ns, of_device), FOREVER - 1, late)

    assert not outside(told)


@settings(max_examples=40)
@given(plan=PLANS, jams=st.lists(st.integers(0, 4000), min_size=1, max_size=4))
def test_the_truth_is_inside_after_error_frames(plan: Plan, jams: list[int]) -> None:
    """Error frames destroy what is on the wire; it is sent again, and judged rightly."""
    wire = plan.wire()
    bit_ns = wire.world.bit_ns
    clock = CausalClock(bit_ns, of_device)
    told: list[Told] = []
    for bits in sorted(jams):
        told += wire.watch(clock, 1000 + bits * bit_ns)
        wire.world.jam()
        clock.disturb(wire.world.now)
    told += wire.watch(clock, FOREVER - 1)

    assert not outside(told)


@settings(max_examples=40)
@given(plan=PLANS, late_bits=st.integers(0, 3000))
def test_the_truth_is_inside_when_the_watch_begins_late(plan: Plan, late_bits: int) -> None:
    """A watch that begins amid traffic claims nothing of what was before."""
    wire = plan.wire()
    since = 1000 + late_bits * wire.world.bit_ns
    wire.world.run(since)
    told = wire.watch(CausalClock(wire.world.bit_ns, of_device, since), FOREVER - 1)

    assert not outside(told)


@settings(max_examples=40)
@given(plan=PLANS, lost=st.tuples(st.integers(0, 30), st.integers(1, 10)))
def test_the_truth_is_inside_after_a_loss(plan: Plan, lost: tuple[int, int]) -> None:
    """Frames that the reader lost are told as a gap, when the next frame comes."""
    wire = plan.wire()
    clock = CausalClock(wire.world.bit_ns, of_device)
    told: list[Told] = []
    first, count = lost
    index = 0
    while (delivery := wire.world.next_frame(FOREVER - 1)) is not None:
        frame, end, sender, wanted_at = delivery
        index += 1
        if first <= index < first + count:
            continue
        if index == first + count:
            clock.disturb(end)
        told.append(Told(clock.see(Sighting(frame, end), index), wanted_at, sender))

    assert not outside(told)


@settings(max_examples=40)
@given(plan=PLANS, looks=st.lists(st.integers(0, 5000), min_size=1, max_size=8))
def test_what_was_asked_for_before_the_quiet_was_seen(plan: Plan, looks: list[int]) -> None:
    """No frame comes that was asked for before the instant from which all must have ended."""
    wire = plan.wire()
    clock = CausalClock(wire.world.bit_ns, of_device)
    quiet = -FOREVER
    for bits in sorted(looks):
        until = 1000 + bits * wire.world.bit_ns
        late = [each for each in wire.watch(clock, until) if each.wanted_at < quiet]
        assert not late
        quiet = clock.idle_before(until)

    assert all(each.wanted_at >= quiet for each in wire.watch(clock, FOREVER - 1))


@given(sizes=st.lists(st.integers(0, 8), min_size=1, max_size=6), first=st.integers(0, 500))
def test_own_frames_and_the_devices_answer_are_told_apart(sizes: list[int], first: int) -> None:
    """The tester sends, the device sends amid it: own frames are marked, the truth is inside."""
    wire = Wire()
    wire.join([(10 * MS + first * BIT, BEAT)])

    def send(_: int) -> None:
        for size in sizes:
            wire.world.send(wire.tester, Frame(0x201, bytes(size)))

    wire.world.at(10 * MS, send)
    told = wire.watch(clock_125(), 50 * MS)

    assert [each.seen.own for each in told].count(True) == len(sizes)
    assert not outside(told)
