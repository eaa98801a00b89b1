"""Virtual time: a bit-timed wire, the same on every machine. See `ears` for the lengths."""

from __future__ import annotations

from collections.abc import Callable

from node_model.frame import Frame
from node_model.node import MS, NOTHING, Frames, S
from node_model.world import World
from tests.node_model.ears import BIT, EMCY, HIGH, LONG, LOW, Ear, all_frames, wire

# The wire's time.


def test_a_frame_ends_after_its_exact_length() -> None:
    """121 bits at 125 kbit/s; the world's time is then the frame's end."""
    world, tester = wire()
    world.attach(Ear())
    world.send(tester, EMCY)
    assert world.next_frame(S) == (EMCY, 121 * BIT, tester, 0)
    assert world.now == 121 * BIT


def test_three_bits_lie_between_two_frames() -> None:
    """The intermission of ISO 11898-1 and nothing more."""
    world, tester = wire()
    world.attach(Ear())
    world.send(tester, LONG)
    world.send(tester, LOW)
    assert all_frames(world, S) == [(109 * BIT, LONG), ((109 + 3 + 46) * BIT, LOW)]


def test_time_passes_without_frames() -> None:
    """Up to the instant asked for, and never back."""
    world, _ = wire()
    assert world.next_frame(5 * MS) is None
    assert world.now == 5 * MS
    assert world.next_frame(3 * MS) is None
    assert world.now == 5 * MS


def test_a_frame_that_ends_later_is_not_seen_yet() -> None:
    """One ns before its end there is nothing; at its end there is."""
    world, tester = wire()
    world.attach(Ear())
    world.send(tester, LOW)
    assert world.next_frame(46 * BIT - 1) is None
    assert world.next_frame(46 * BIT) == (LOW, 46 * BIT, tester, 0)


def test_a_frame_that_must_wait_for_the_idle_wire_has_not_started_yet() -> None:
    """Time may stand in the intermission, and go on from there."""
    world, tester = wire()
    world.attach(Ear())
    world.send(tester, LOW)
    world.send(tester, HIGH)
    assert world.next_frame(S) == (LOW, 46 * BIT, tester, 0)
    assert world.next_frame(47 * BIT) is None
    assert world.next_frame(S) == (HIGH, (46 + 3 + 46) * BIT, tester, 0)


def test_a_tester_may_act_like_a_node() -> None:
    """What its verb returns is sent."""
    world, tester = wire()
    world.attach(Ear())
    world.act(tester, lambda _: (LOW,))
    assert world.next_frame(S) == (LOW, 46 * BIT, tester, 0)


def test_a_world_may_begin_at_any_instant() -> None:
    """And its bits at one megabit take 1000 ns."""
    world = World(1_000_000, now=7)
    tester = world.attach()
    world.attach(Ear(1_000_000))
    world.send(tester, LOW)
    assert world.next_frame(S) == (LOW, 7 + 46_000, tester, 7)


def test_a_waiting_frame_starts_when_the_intermission_is_over() -> None:
    """A frame asked for in the intermission waits for its end; later ones start at once."""
    world, tester = wire()
    world.attach(Ear())
    world.send(tester, LOW)
    world.run(47 * BIT)
    world.send(tester, HIGH)
    assert world.next_frame(S) == (HIGH, (46 + 3 + 46) * BIT, tester, 47 * BIT)
    world.run(10 * MS)
    world.send(tester, HIGH)
    assert world.next_frame(S) == (HIGH, 10 * MS + 46 * BIT, tester, 10 * MS)


# Who hears.


def test_everybody_hears_but_the_sender() -> None:
    """At the instant of the frame's end."""
    world, tester = wire()
    ears = Ear(), Ear()
    first = world.attach(ears[0])
    world.attach(ears[1])
    world.act(first, lambda _: (LOW,))
    world.run(S)
    assert ears[0].heard == []
    assert ears[1].heard == [(46 * BIT, LOW)]
    assert tester.waiting == type(tester.waiting)()


def test_an_answer_is_asked_for_at_the_end_of_the_question() -> None:
    """And follows after the intermission."""
    world, tester = wire()
    other = world.attach(Ear(answer=(HIGH,)))
    world.send(tester, LOW)
    world.next_frame(S)
    assert world.next_frame(S) == (HIGH, (46 + 3 + 46) * BIT, other, 46 * BIT)


def test_the_acceptance_filter_is_kept() -> None:
    """Base identifiers in the set pass; extended ones only where there is no filter."""
    world, tester = wire()
    picky, open_ear = Ear(), Ear()
    picky.listens_to = frozenset((0x2AA,))
    world.attach(picky)
    world.attach(open_ear)
    for frame in (LOW, HIGH, Frame(0x2AA, extended=True)):
        world.send(tester, frame)
    world.run(S)
    assert [frame for _, frame in picky.heard] == [LOW]
    assert len(open_ear.heard) == 3


def test_a_filter_may_change_while_time_passes() -> None:
    """The next frame goes by the new one."""
    world, tester = wire()
    ear = Ear()
    controller = world.attach(ear)
    world.send(tester, LOW)
    world.run(10 * MS)
    ear.listens_to = frozenset()
    world.act(controller, lambda _: NOTHING)
    world.send(tester, LOW)
    world.run(20 * MS)
    assert len(ear.heard) == 1


def test_nobody_alone_can_send() -> None:
    """Without an acknowledge the frame waits until there is somebody at this bit rate."""
    world, tester = wire()
    world.send(tester, LOW)
    world.attach(Ear(250_000))
    assert world.next_frame(S) is None
    world.attach(Ear())
    assert world.next_frame(2 * S) == (LOW, S + 46 * BIT, tester, 0)


def test_at_another_bit_rate_a_node_is_deaf_and_mute() -> None:
    """It hears nothing, and what it wants to send is lost and counted."""
    world, tester = wire()
    world.attach(Ear())
    ear = Ear(250_000)
    other = world.attach(ear)
    world.act(other, lambda _: (HIGH, HIGH))
    world.send(tester, LOW)
    assert [frame for _, frame in all_frames(world, S)] == [LOW]
    assert ear.heard == []
    assert other.lost == 2


def test_the_bit_rate_of_wire_and_testers_can_be_set() -> None:
    """Then those at the new rate talk, and the others have lost what waited."""
    world, tester = wire()
    world.attach(Ear())
    slow = world.attach(Ear())
    fast_ear = Ear(500_000)
    fast = world.attach(fast_ear)
    world.act(slow, lambda _: (LOW, HIGH))
    world.set_bit_rate(500_000)
    assert slow.lost == 2
    world.act(fast, lambda _: (LOW,))
    world.send(tester, HIGH)
    assert all_frames(world, S) == [(46 * 2000, HIGH), ((46 + 3 + 46) * 2000, LOW)]
    assert world.bit_ns == 2000


def test_setting_the_bit_rate_that_it_has_disturbs_nobody() -> None:
    """The frame on the wire goes on."""
    world, tester = wire()
    world.attach(Ear())
    world.send(tester, LOW)
    world.run(BIT)
    world.set_bit_rate(125_000)
    assert world.next_frame(S) == (LOW, 46 * BIT, tester, 0)


def test_setting_another_bit_rate_cuts_the_frame_on_the_wire() -> None:
    """It is lost and counted; after three bits of the old rate the next goes at the new one."""
    world, tester = wire()
    world.attach(Ear())
    world.attach(Ear(250_000))
    world.send(tester, LONG)
    world.send(tester, LOW)
    world.run(20 * BIT)
    world.set_bit_rate(250_000)
    assert tester.lost == 1
    assert all_frames(world, S) == [(20 * BIT + 3 * BIT + 46 * 4000, LOW)]


def test_a_node_that_leaves_cuts_its_frame_on_the_wire() -> None:
    """Power-off in the middle of a frame: the wire is idle after three bits."""
    world, tester = wire()
    ear = Ear()
    other = world.attach(ear)
    world.attach(Ear())
    world.act(other, lambda _: (LONG, LONG))
    world.run(50 * BIT)
    world.act(other, ear.power_off)
    world.send(tester, LOW)
    assert other.lost == 2
    assert all_frames(world, S) == [((50 + 3 + 46) * BIT, LOW)]


def test_a_node_that_leaves_lets_others_finish() -> None:
    """Only its own frame is cut."""
    world, tester = wire()
    ear = Ear()
    other = world.attach(ear)
    world.attach(Ear())
    world.send(tester, LONG)
    world.run(50 * BIT)
    world.act(other, ear.power_off)
    assert all_frames(world, S) == [(109 * BIT, LONG)]
    assert ear.heard == []


# The calendar.


def test_stimuli_come_at_their_instants_in_the_order_of_asking() -> None:
    """A stimulus may put another one on the calendar; a past instant means now."""
    world, _ = wire()
    seen: list[tuple[str, int]] = []

    def note(name: str) -> Callable[[int], None]:
        return lambda now: seen.append((name, now))

    world.at(20, note("third"))
    world.at(10, note("first"))
    world.at(10, note("second"))
    world.at(15, lambda _: world.at(0, note("at once")))
    world.run(MS)
    assert seen == [("first", 10), ("second", 10), ("at once", 15), ("third", 20)]


def test_at_one_instant_devices_act_before_stimuli_and_both_before_a_frame_ends() -> None:
    """The order that the laws of the world name."""
    world, tester = wire()
    ear = Ear()
    ear.due_at = 46 * BIT
    controller = world.attach(ear)
    world.send(tester, LOW)
    lengths: list[tuple[int, int]] = []
    world.at(46 * BIT, lambda _: lengths.append((len(controller.waiting), len(ear.heard))))
    world.next_frame(S)
    assert lengths == [(1, 0)]
    assert ear.heard == [(46 * BIT, LOW)]


def test_a_deadline_that_moves_is_followed() -> None:
    """Earlier, later or gone: the old instant means nothing any more."""
    world, _ = wire()
    ear = Ear()
    controller = world.attach(ear)
    world.attach(Ear())

    def move(due_at: int | None) -> Frames:
        ear.due_at = due_at
        return NOTHING

    world.act(controller, lambda _: move(30 * MS))
    world.act(controller, lambda _: move(10 * MS))
    assert [at for at, _ in all_frames(world, 50 * MS)] == [10 * MS + 56 * BIT]
    world.act(controller, lambda _: move(60 * MS))
    world.act(controller, lambda _: move(None))
    assert all_frames(world, S) == []
