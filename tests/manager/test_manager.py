"""One node's manager: commands, states, heartbeat (MGR-01 to MGR-04, MGR-08)."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from hil_tests.clock import MS
from hil_tests.judge.cobs import State
from hil_tests.manager import Event, Manager, What
from node_model.frame import Frame


def frame(text: str) -> Frame:
    """A data frame, e.g. "705#7F"."""
    can_id, _, data = text.partition("#")
    return Frame(int(can_id, 16), bytes.fromhex(data))


def told(manager: Manager, *frames: str, every_ns: int = 10 * MS, start: int = 0) -> list[Event]:
    """What a manager makes of frames that come one after the other."""
    for turn, text in enumerate(frames):
        manager.update(frame(text), start + turn * every_ns)
    return manager.take_events()


def kinds(events: list[Event]) -> list[tuple[What, bool]]:
    """What happened, and whether it began or ended."""
    return [(event.what, event.over) for event in events]


@pytest.mark.parametrize(
    ("command", "sent"),
    [
        (Manager.start, "000#0105"),
        (Manager.stop, "000#0205"),
        (Manager.pre_operational, "000#8005"),
        (Manager.reset, "000#8105"),
        (Manager.reset_communication, "000#8205"),
    ],
)
def test_each_command_is_its_nmt_frame(
    command: Callable[[Manager, int], Frame], sent: str
) -> None:
    """Command specifier and node id on identifier 0 (MGR-01)."""
    manager = Manager(5)
    assert command(manager, 0) == frame(sent)


@pytest.mark.parametrize("node_id", [0, 128, -1])
def test_a_manager_has_a_node(node_id: int) -> None:
    """Node ids are 1 to 127; both ends are managed, what lies beyond is refused."""
    assert (Manager(1).node_id, Manager(127).node_id) == (1, 127)
    with pytest.raises(ValueError, match=f"node id {node_id}: write 1..127"):
        Manager(node_id)


def test_a_command_alone_changes_no_state() -> None:
    """The state comes from what the node sent, never from a wish (MGR-02)."""
    manager = Manager(5)
    manager.start(0)
    assert manager.state is None
    told(manager, "705#7F")
    manager.start(0)
    assert manager.state is State.PRE_OPERATIONAL


@pytest.mark.parametrize(
    ("sent", "state"),
    [
        ("705#00", State.PRE_OPERATIONAL),
        ("705#7F", State.PRE_OPERATIONAL),
        ("705#05", State.OPERATIONAL),
        ("705#04", State.STOPPED),
        ("705#85", State.OPERATIONAL),
        ("705#06", None),
    ],
)
def test_the_low_seven_bits_are_the_state(sent: str, state: State | None) -> None:
    """Boot-up is the passage to pre-operational; a code that there is not is no state."""
    manager = Manager(5)
    told(manager, sent)
    assert manager.state is state


@pytest.mark.parametrize(
    "stranger",
    [
        frame("000#0105"),
        frame("000#05"),
        frame("706#04"),
        frame("705#0400"),
        frame("705#"),
        Frame(0x705, b"\x04", extended=True),
        Frame(0x705, remote=True, dlc=1),
        frame("085#308111"),
    ],
    ids=str,
)
def test_what_is_no_error_control_of_the_node_changes_nothing(stranger: Frame) -> None:
    """Identifier 0 above all (MGR-03), other nodes, other lengths, other formats."""
    manager = Manager(5)
    told(manager, "705#05")
    manager.update(stranger, 1)
    assert manager.state is State.OPERATIONAL
    assert manager.take_events() == []


def test_a_boot_up_of_a_known_node_is_a_restart() -> None:
    """The first one is none; one that was commanded is told as such (MGR-08)."""
    manager = Manager(5)
    assert told(manager, "705#00") == []
    (alone,) = told(manager, "705#00", start=5)
    manager.reset(10)
    (asked,) = told(manager, "705#00", start=20)
    (again,) = told(manager, "705#00", start=30)
    assert alone == Event(What.RESTART, 5, 5, "by itself")
    assert asked == Event(What.RESTART, 5, 20, "as commanded", asked=True)
    assert not again.asked


def beating(*, written: bool) -> Manager:
    """A manager that watches a heartbeat with a consumer time of 100 ms."""
    manager = Manager(5)
    manager.heartbeat(100 * MS, 0, written=written)
    return manager


def test_a_stored_heartbeat_is_watched_from_the_first_beat_on() -> None:
    """Before it nothing is missed; the consumer time ends exactly then (MGR-08)."""
    manager = beating(written=False)
    assert manager.deadline() is None
    told(manager, "705#7F", start=50 * MS)
    assert manager.deadline() == 150 * MS
    manager.advance(150 * MS - 1)
    assert manager.take_events() == []
    manager.advance(150 * MS)
    (event,) = manager.take_events()
    assert (event.what, event.at, event.over) == (What.HEARTBEAT, 150 * MS, False)
    assert event.text == "no heartbeat within 100 ms"
    assert manager.lost == {What.HEARTBEAT}
    assert manager.deadline() is None


def test_the_boot_up_counts_as_the_first_beat_of_a_stored_time() -> None:
    """From it on the next one is awaited (MGR-04)."""
    manager = beating(written=False)
    told(manager, "705#00", start=7)
    assert manager.deadline() == 100 * MS + 7


def test_a_written_heartbeat_begins_at_once() -> None:
    """The first beat is due one consumer time after the write (MGR-04)."""
    manager = beating(written=True)
    assert manager.deadline() == 100 * MS
    manager.advance(100 * MS)
    assert kinds(manager.take_events()) == [(What.HEARTBEAT, False)]


def test_a_written_heartbeat_ends_with_a_restart() -> None:
    """What was not stored is gone; a beat that comes nevertheless is watched again."""
    manager = beating(written=True)
    told(manager, "705#00")
    assert manager.deadline() is None
    told(manager, "705#7F", start=5)
    assert manager.deadline() == 100 * MS + 5


def test_the_next_heartbeat_clears_the_event() -> None:
    """The event is told once, however long the silence; a restart in between as well (MGR-08)."""
    manager = beating(written=False)
    told(manager, "705#05")
    manager.advance(100 * MS)
    manager.advance(900 * MS)
    assert kinds(manager.take_events()) == [(What.HEARTBEAT, False)]
    events = told(manager, "705#00", "705#7F", start=900 * MS)
    assert kinds(events) == [(What.RESTART, False), (What.HEARTBEAT, True)]
    assert manager.lost == frozenset()


def test_bit_7_of_a_heartbeat_is_zero() -> None:
    """One that is set is told once, and is no beat (MGR-04)."""
    manager = beating(written=False)
    events = told(manager, "705#05", "705#85", "705#85")
    assert [(event.what, event.text) for event in events] == [
        (What.HEARTBEAT, "bit 7 is set in the heartbeat 85h")
    ]
    assert manager.deadline() == 100 * MS
    assert kinds(told(manager, "705#05", start=30 * MS)) == [(What.HEARTBEAT, True)]


def test_a_late_reply_to_a_poll_is_no_bad_heartbeat() -> None:
    """Where no heartbeat is watched, bit 7 tells nothing but that somebody polled."""
    manager = Manager(5)
    assert told(manager, "705#85") == []
    assert (manager.state, manager.deadline()) == (State.OPERATIONAL, None)


def test_watching_can_end() -> None:
    """A consumer time of 0 asks for nothing, and forgets what was lost."""
    manager = beating(written=True)
    manager.advance(100 * MS)
    manager.heartbeat(0, 200 * MS)
    assert (manager.lost, manager.deadline()) == (frozenset(), None)
    told(manager, "705#05", start=300 * MS)
    assert manager.deadline() is None


def test_an_emcy_tells_the_life_guarding_event_of_the_device() -> None:
    """8130h begins it, 0000h ends it; other codes and repetitions are no news (MGR-06)."""
    manager = Manager(5)
    begun = told(manager, "085#3081110000000000", "085#3081110000000000", "085#1023030000000000")
    assert kinds(begun) == [(What.LIFE_GUARDING, False)]
    ended = told(manager, "085#0000000000000000", "085#0000000000000000")
    assert kinds(ended) == [(What.LIFE_GUARDING, True)]
