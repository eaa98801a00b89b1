"""The engine of a bench: order of things, calendar, stalls, sending, and what breaks it."""

from __future__ import annotations

import pytest

from hil_tests.bench.chronicle import CLOCK
from hil_tests.bench.core import STALL_NS
from hil_tests.bench.judging import SEND_PATIENCE_NS
from hil_tests.bench.terms import interval_of
from hil_tests.clock import MS, Interval, S, exactly
from hil_tests.errors import BenchError, BusUnavailable
from hil_tests.judge.causal import Seen
from hil_tests.trace import BusEvent, Columns, EventKind, Mark, Moment, Sighting
from node_model.frame import Frame
from tests.bench.fakes import ECHO_NS, HOME, FakePort, bench_of

ANY = Frame(0x123, b"\x01")


class Memory:
    """A sink that keeps what it is given."""

    def __init__(self) -> None:
        self.entries: list[object] = []

        self.readings: list[int] = []
        """What the clock showed, as it was noted."""

    def write(self, entry: object) -> None:
        """Keep it."""
        if isinstance(entry, Mark) and entry.data.get("kind") == CLOCK:
            self.readings.append(entry.at)
        else:
            self.entries.append(entry)

    def write_all(self, columns: Columns) -> None:
        """Keep many frames."""
        self.entries.extend(columns.sightings())


def test_everything_that_happens_while_it_waits_is_recorded() -> None:
    """Frames and events land in the trace and in its sinks, in order, as they come."""
    port = FakePort()
    bench, _ = bench_of(port)
    memory = Memory()
    bench.begin(memory)
    port.plays("701#7F", 1 * MS)
    port.tells(BusEvent(EventKind.ERROR, 2 * MS))
    port.plays("701#7F", 3 * MS)
    bench.wait(2 * MS)
    assert [getattr(each, "at", 0) for each in memory.entries] == [1 * MS, 2 * MS]
    bench.wait(2 * MS)
    assert bench.now() == 4 * MS
    assert len(bench.trace) == 2
    assert list(bench.trace.entries()) == memory.entries


def test_what_the_clock_showed_is_recorded() -> None:
    """To the test, and where a wait counts from; what the engine reads for itself is not."""
    port = FakePort()
    bench, _ = bench_of(port)
    memory = Memory()
    bench.begin(memory)
    port.plays("701#7F", 1 * MS)
    bench.wait(3 * MS)
    port.at = 5 * MS
    assert bench.now() == 5 * MS
    assert memory.readings == [0, 5 * MS]


def test_a_bench_without_a_record_reads_the_clock_all_the_same() -> None:
    """There is only nowhere to note it."""
    port = FakePort()
    bench, _ = bench_of(port)
    port.at = 5 * MS
    assert bench.now() == 5 * MS


@pytest.mark.parametrize(
    ("frame_at", "place"), [(4 * MS, "before"), (5 * MS, "before"), (5 * MS + 1, "after")]
)
def test_a_stimulus_takes_its_place_among_the_frames(frame_at: int, place: str) -> None:
    """What ended before the stimulus is recorded before it, even if it was not read yet."""
    port = FakePort()
    bench, _ = bench_of(port)
    bench.begin()
    port.plays("701#7F", frame_at)
    port.at = 6 * MS
    bench.note(Moment("mark", 5 * MS, 5 * MS))
    kinds = [type(entry) for entry in bench.trace.entries()]
    assert kinds == ([Sighting, Moment] if place == "before" else [Moment, Sighting])


def test_the_calendar_is_kept_whatever_is_waited_for() -> None:
    """Actions are carried out at their instants, in order; equal instants as they were put."""
    bench, _ = bench_of()
    done: list[tuple[str, int]] = []
    for name, at in (("c", 30 * MS), ("a", 10 * MS), ("b", 10 * MS), ("never", 2 * S)):
        bench.at(at, lambda name=name: done.append((name, bench.now())))  # type: ignore[misc]
    bench.wait(1 * S)
    assert done == [("a", 10 * MS), ("b", 10 * MS), ("c", 30 * MS)]
    assert bench.now() == 1 * S


def test_an_action_of_the_past_is_carried_out_at_once() -> None:
    """What was put too late is not forgotten."""
    bench, _ = bench_of()
    bench.wait(5 * MS)
    done: list[int] = []
    bench.at(1 * MS, lambda: done.append(bench.now()))
    bench.wait(5 * MS)
    assert done == [5 * MS]


def test_a_new_test_begins_with_an_empty_calendar() -> None:
    """What one test planned does not happen in the next."""
    bench, _ = bench_of()
    done: list[int] = []
    bench.at(10 * MS, lambda: done.append(1))
    bench.begin()
    bench.wait(1 * S)
    assert done == []


@pytest.mark.parametrize(("late_ns", "stalls"), [(STALL_NS, 0), (STALL_NS + 1, 1)])
def test_a_host_that_stops_us_is_told(late_ns: int, stalls: int) -> None:
    """A wait that ends too late is a stall of the host, in the trace and in the totals."""
    port = FakePort()
    bench, _ = bench_of(port)
    bench.begin()
    port.late_ns = late_ns
    bench.wait(10 * MS)
    assert bench.stalls == stalls
    assert [event.kind for event in bench.trace.events()] == [EventKind.STALL] * stalls


def test_waiting_for_the_past_is_no_stall() -> None:
    """An instant that has passed costs nothing and blames nobody."""
    bench, _ = bench_of()
    bench.wait(1 * S)
    bench.wait_until(0)
    assert (bench.now(), bench.stalls) == (1 * S, 0)


def test_sending_waits_for_the_frame_on_the_bus() -> None:
    """What send returns is the own frame as it was read back; others are recorded meanwhile."""
    port = FakePort()
    bench, _ = bench_of(port)
    bench.begin()
    port.plays(ANY, ECHO_NS // 2)
    sent = bench.send(ANY)
    assert (sent.own, sent.at, sent.index) == (True, ECHO_NS, 1)


def test_a_frame_that_nobody_acknowledges_is_an_error_of_the_bench() -> None:
    """After two seconds the bench, not the device, is called broken; with what to look at."""
    port = FakePort()
    bench, _ = bench_of(port)
    port.acknowledged = False
    with pytest.raises(BenchError, match="nobody acknowledges"):
        bench.send(ANY)
    assert bench.now() == SEND_PATIENCE_NS


def test_a_bus_that_goes_away_is_an_error_of_the_bench() -> None:
    """The port's own words come through, wherever the bench was waiting."""
    port = FakePort()
    bench, _ = bench_of(port)
    port.gone = "fake0 was pulled out"
    for verb in (lambda: bench.wait(1), lambda: bench.send(ANY), bench.drain):
        with pytest.raises(BusUnavailable, match="pulled out"):
            verb()


def test_an_action_is_awaited_while_the_bus_is_read() -> None:
    """A driver that takes a millisecond keeps no frame waiting."""
    port = FakePort()
    bench, stage = bench_of(port)
    bench.begin()
    port.plays("701#7F", 500_000)
    when = bench.carry_out(stage.switch(on=True))
    assert when == Interval(0, 1 * MS)
    assert len(bench.trace) == 1


def test_totals_count_frames_and_bus_time_of_every_test() -> None:
    """What begin and end enclose is added up over the run."""
    port = FakePort()
    bench, _ = bench_of(port)
    for _ in range(2):
        bench.begin()
        port.plays("701#7F", bench.now() + 1)
        bench.wait(1 * S)
        bench.end()
    assert (bench.frames, bench.bus_ns) == (2, 2 * S)


def test_examples_of_a_property_are_counted_and_let_go() -> None:
    """Only the last example stays in memory; the totals have them all."""
    port = FakePort()
    bench, _ = bench_of(port)
    bench.begin()
    for _ in range(3):
        bench.begin_example()
        port.plays("701#7F", bench.now() + 1)
        bench.wait(1 * S)
    assert len(bench.trace) == 1
    bench.end()
    assert (bench.frames, bench.bus_ns) == (3, 3 * S)


def test_the_node_id_must_be_known() -> None:
    """A bench that was not told says what to add."""
    bench, _ = bench_of(parameters=None)
    with pytest.raises(BenchError, match=r"state it in \[device\]"):
        _ = bench.node_id


@pytest.mark.parametrize(
    ("held", "mode"),
    [
        ((), "regular"),
        (("on_off",), "regular"),
        (("on_off", "aut"), "commissioning"),
        (("on_off", "aut", "k3"), "either"),
    ],
)
def test_keys_held_decide_how_it_will_start(held: tuple[str, ...], mode: str) -> None:
    """Exactly the commissioning keys commission; what more keys do is left open."""
    bench, _ = bench_of()
    assert bench.keys is not None
    bench.keys.hold(*held)
    assert bench.start_mode() == mode


def test_late_hosts_are_asked_and_believed() -> None:
    """What the host of a model tells of its lateness widens the doubt of its frames."""
    port = FakePort()
    bench, stage = bench_of(port)

    class Health:
        """Two frames late."""

        def late(self) -> object:
            """See HealthDriver."""
            from hil_tests.bench.virtual import Done  # noqa: PLC0415

            return Done(lambda: [(1 * MS, 9 * MS)])

    stage.health = Health()
    bench.begin()
    port.plays("701#7F", 9 * MS)
    bench.wait(10 * MS)
    bench.settle()
    seen = bench.seen(0)
    assert bench.when(seen) == Interval(1 * MS, 9 * MS)
    assert bench.lateness.worst_ns == 8 * MS


def test_things_to_count_from_have_an_interval() -> None:
    """A frame, a stimulus, an interval and an instant will all do."""
    seen = Seen(ANY, 9, Interval(5, 7), own=False, index=0)
    assert interval_of(seen) == Interval(5, 7)
    assert interval_of(Moment("power", 1, 2)) == Interval(1, 2)
    assert interval_of(Interval(3, 4)) == Interval(3, 4)
    assert interval_of(6) == exactly(6)


def test_a_new_bench_expects_what_the_device_is_commissioned_to() -> None:
    """The judge is told node id, period and bit rate; nothing where they are not known."""
    bench, _ = bench_of()
    expected = bench.expected(HOME)
    assert (expected.node_id, expected.bit_rate) == (1, 250_000)
    assert expected.heartbeat_ns == 1 * S
    unknown = bench.expected(None)
    assert (unknown.node_id, unknown.heartbeat_ns, unknown.bit_rate) == (None, None, None)


def test_a_load_that_the_stage_cannot_give_is_none() -> None:
    """Loading says whether it works; the watch learns whose frames these are."""
    bench, stage = bench_of()
    assert not bench.load([ANY], 500_000)
    stage.loadable = True
    assert bench.watch.speakers.are_device(ANY)
    assert bench.load([ANY], 500_000)
    assert not bench.watch.speakers.are_device(ANY)
    bench.end_load()
    assert "end load" in stage.asked


def test_the_description_is_for_people() -> None:
    """The header of a run names bench, bus and clock."""
    bench, stage = bench_of()
    assert bench.description() == {
        "bench": "desk",
        "bus": "fake0, 250000 bit/s, untimed wire",
        "clock": "a fake one",
        "lateness": "",
    }
    bench.close()
    assert stage.asked == ["close"]
