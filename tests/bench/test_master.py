"""The NMT master of a bench: its manager sees the bus, and what it wants is sent in time."""

from __future__ import annotations

from hil_tests.bench.master import Master
from hil_tests.clock import MS
from hil_tests.judge.cobs import State
from hil_tests.manager import Manager, What
from node_model.frame import Frame
from tests.bench.answering import AnsweringPort, Says, Script, bench_with, in_turn

GUARD_NS = 100 * MS


def master(script: Script | None = None) -> tuple[Master, AnsweringPort]:
    """A master of node 5, and the bus below it."""
    bench, port = bench_with(script or in_turn())
    made = Master(bench)
    made.meet()
    return made, port


def polls(port: AnsweringPort) -> int:
    """How many guarding requests were sent."""
    return sum(frame.remote for frame in port.sent)


def shown(master_: Master) -> State | None:
    """As the manager knows it."""
    return master_.state


def replies(*bytes_: int) -> Script:
    """One guarding reply to each poll, as long as there are any."""
    left = iter(bytes_)

    def script(frame: Frame) -> list[Says]:
        byte = next(left, None) if frame.remote else None
        return [] if byte is None else [(1 * MS, f"705#{byte:02X}")]

    return script


def test_the_state_is_what_the_device_showed() -> None:
    """Not what it was told to do."""
    made, port = master()
    port.plays("705#00", 1 * MS)
    port.plays("705#7F", 2 * MS)
    made.wait(5 * MS)
    assert shown(made) is State.PRE_OPERATIONAL
    made.tell(Manager.start)
    made.wait(5 * MS)
    assert str(port.sent[-1]) == "000#0105"
    assert shown(made) is State.PRE_OPERATIONAL
    port.plays("705#05", port.at + 1 * MS)
    made.wait(5 * MS)
    assert shown(made) is State.OPERATIONAL


def test_a_meeting_begins_with_nothing_known() -> None:
    """What was on the bus before is not told to the new manager."""
    made, port = master()
    port.plays("705#05", 1 * MS)
    made.wait(5 * MS)
    assert shown(made) is State.OPERATIONAL
    assert made.meet().node_id == 5
    assert shown(made) is None


def test_polls_go_out_while_the_bench_waits() -> None:
    """At once and every guard time; the last deadline of a wait is still kept."""
    made, port = master(replies(0x7F, 0xFF, 0x7F, 0xFF))
    made.guard(GUARD_NS, 3)
    assert polls(port) == 0
    made.wait(3 * GUARD_NS)
    assert polls(port) == 4
    made.wait(GUARD_NS // 2)
    assert polls(port) == 4
    assert made.take_events() == []
    made.guard(0, 0)
    made.wait(3 * GUARD_NS)
    assert polls(port) == 4


def test_polls_without_a_reply_are_an_event() -> None:
    """When the life time is over."""
    made, _ = master(replies(0x7F))
    made.guard(GUARD_NS, 2)
    made.wait(4 * GUARD_NS)
    (event,) = made.take_events()
    assert (event.what, event.over) == (What.NODE_GUARDING, False)
    assert made.take_events() == []


def test_a_reply_that_is_missed_never_reached_the_manager() -> None:
    """It shows in the toggle bit of the next one."""
    bench, _ = bench_with(replies(0x7F, 0xFF, 0x7F))
    made = Master(bench)
    made.meet()
    made.guard(GUARD_NS, 3)
    made.wait(GUARD_NS - 10 * MS)
    assert made.take_events() == []
    bench.send(Frame(0x705, remote=True, dlc=1))
    bench.wait(5 * MS)
    made.miss()
    made.wait(GUARD_NS)
    assert [event.what for event in made.take_events()] == [What.NODE_GUARDING]


def test_a_heartbeat_is_watched_from_its_next_beat_on() -> None:
    """A beat moves the deadline while the bench waits for it."""
    made, port = master()
    for at in (10, 60, 110):
        port.plays("705#7F", at * MS)
    made.heartbeat(80 * MS)
    made.wait(180 * MS)
    assert made.take_events() == []
    made.wait(20 * MS)
    (event,) = made.take_events()
    assert event.what is What.HEARTBEAT
    assert event.at == 190 * MS


def test_a_heartbeat_that_was_written_is_due_at_once() -> None:
    """Its first beat, too, must come within the time."""
    made, _ = master()
    made.heartbeat(80 * MS, written=True)
    made.wait(100 * MS)
    (event,) = made.take_events()
    assert (event.what, event.at) == (What.HEARTBEAT, 80 * MS)
