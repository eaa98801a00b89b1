"""Who sends next on a virtual wire, also after an error frame. See `ears` for the lengths."""

from __future__ import annotations

from node_model.controller import Mailbox
from node_model.frame import Frame
from node_model.keypad import Keypad, load
from node_model.node import MS, S
from tests.node_model.ears import BIT, BOOT_UP, EMCY, HIGH, LONG, LOW, Ear, Hasty, all_frames, wire

# Arbitration and mailboxes.


def test_the_lowest_identifier_wins_when_the_wire_falls_idle() -> None:
    """A frame on the wire is not interrupted; of those that wait the lowest goes next."""
    world, tester = wire()
    other = world.attach(Ear())
    world.send(tester, LONG)
    world.run(BIT)
    world.send(tester, LOW)
    other_node = other.node
    assert isinstance(other_node, Ear)
    world.act(other, lambda _: (HIGH,))
    assert [frame for _, frame in all_frames(world, S)] == [LONG, HIGH, LOW]


def test_of_equal_frames_the_one_asked_for_first_goes_first() -> None:
    """No real wire could tell them apart; this one is deterministic."""
    world, tester = wire()
    other = world.attach(Ear())
    world.act(other, lambda _: (LOW,))
    world.send(tester, LOW)
    first, second = world.next_frame(S), world.next_frame(S)
    assert first is not None
    assert second is not None
    assert (first[2], second[2]) == (other, tester)


def booting(mailbox: Mailbox) -> list[Frame]:
    """What a keypad sends at its start through that kind of mailbox."""
    world, _ = wire(250_000)
    pad = Keypad(load())
    controller = world.attach(pad, mailbox)
    world.act(controller, pad.power_on)
    return [frame for _, frame in all_frames(world, 100 * MS)]


def test_a_fifo_sends_in_the_order_of_asking() -> None:
    """Boot-up, then EMCY, though EMCY has the lower identifier."""
    assert booting(Mailbox.FIFO) == [BOOT_UP, EMCY]


def test_a_mailbox_by_identifier_lets_emcy_overtake_boot_up() -> None:
    """The classical fault of full-CAN controllers: both wait, the lower identifier goes."""
    assert booting(Mailbox.BY_IDENTIFIER) == [EMCY, BOOT_UP]


def test_a_mailbox_by_identifier_sends_all_that_waits_in_order() -> None:
    """Each of its frames takes part in arbitration by itself."""
    world, _ = wire()
    other = world.attach(Ear(), Mailbox.BY_IDENTIFIER)
    frames = [Frame(ident) for ident in (0x300, 0x100, 0x200)]
    world.act(other, lambda _: frames)
    assert [frame.can_id for _, frame in all_frames(world, S)] == [0x100, 0x200, 0x300]


def test_a_node_may_take_back_what_the_bus_keeps_waiting() -> None:
    """A frame before them takes longer than they wait; what follows in the mailbox goes out."""
    world, tester = wire()
    node = world.attach(Hasty())
    world.send(tester, LONG)
    world.at(1, lambda _: world.send(node, BOOT_UP))
    world.at(1, lambda _: world.send(node, EMCY))
    assert all_frames(world, 5 * MS) == [(109 * BIT, LONG), (112 * BIT + 121 * BIT, EMCY)]
    assert node.lost == 0


def test_what_need_not_wait_is_not_taken_back() -> None:
    """Nor what may wait for ever."""
    world, _ = wire()
    node = world.attach(Hasty())
    world.send(node, BOOT_UP)
    assert all_frames(world, 5 * MS) == [(56 * BIT, BOOT_UP)]


def test_a_full_mailbox_loses_what_comes_next() -> None:
    """Depth 2: one of three frames is lost and counted."""
    world, _ = wire()
    other = world.attach(Ear(), depth=2)
    world.act(other, lambda _: (LOW, HIGH, LONG))
    assert [frame for _, frame in all_frames(world, S)] == [LOW, HIGH]
    assert other.lost == 1


# Error frames.


def test_an_error_frame_makes_the_sender_try_again() -> None:
    """Twenty bits of error frame, three of intermission, then the whole frame once more."""
    world, tester = wire()
    world.attach(Ear())
    world.send(tester, LONG)
    world.send(tester, LOW)
    world.run(50 * BIT)
    world.jam()
    again = (50 + 20 + 3 + 109) * BIT
    assert all_frames(world, S) == [(again, LONG), (again + (3 + 46) * BIT, LOW)]
    assert tester.lost == 0


def test_after_an_error_frame_arbitration_starts_anew() -> None:
    """A lower identifier that waits meanwhile goes first, from the same mailbox too."""
    world, tester = wire()
    other = world.attach(Ear(), Mailbox.BY_IDENTIFIER)
    world.act(other, lambda _: (LONG,))
    world.run(50 * BIT)
    world.act(other, lambda _: (LOW,))
    world.send(tester, HIGH)
    world.jam()
    assert [frame for _, frame in all_frames(world, S)] == [HIGH, LOW, LONG]


def test_an_error_frame_on_an_idle_wire_only_takes_time() -> None:
    """Twenty-three bits."""
    world, tester = wire()
    world.attach(Ear())
    world.jam()
    world.send(tester, LOW)
    assert all_frames(world, S) == [((20 + 3 + 46) * BIT, LOW)]
