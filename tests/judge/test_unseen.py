"""What the virtual wire tells of frames that nobody could read: the judge allows for it."""

from __future__ import annotations

from hil_tests.bench.virtual import VirtualPort
from hil_tests.clock import MS
from hil_tests.judge.causal import CausalClock
from hil_tests.trace import BusEvent, EventKind, Sighting
from node_model.frame import Frame
from node_model.load import Load
from node_model.world import World
from tests.judge.wire import Script

BIT = 8000
BEAT = Frame(0x701, b"\x05")
HIGHER = Frame(0x100, bytes(8))


def test_a_station_switched_off_amid_its_frame_is_told_before_what_follows() -> None:
    """A load ended in the middle of a frame once made the next beat look late by the whole load.

    The cut frame kept the wire busy unseen; the beat behind it had waited since the start.
    """
    world = World()
    port = VirtualPort(world)
    world.attach(Script([(10 * MS, BEAT)], 125_000))
    load = Load([HIGHER], 1_000_000, 125_000)
    station = world.attach(load, depth=4)
    world.act(station, load.power_on)
    clock = CausalClock(BIT, lambda frame: frame == BEAT)
    last = None
    while isinstance(item := port.next(50 * MS), Sighting):
        last = clock.see(item, 0)
    world.run(world.now + BIT)
    world.act(station, load.power_off)

    error, beat = port.next(60 * MS), port.next(60 * MS)

    assert last is not None
    assert isinstance(error, BusEvent)
    assert (error.kind, error.at) == (EventKind.ERROR, 50 * MS + BIT)
    assert isinstance(beat, Sighting)
    clock.disturb(error.at)
    assert clock.see(beat, 1).wanted.earliest < 10 * MS
    assert port.next(60 * MS) is None


def test_an_error_frame_within_a_wait_is_told_before_the_frame_after_it() -> None:
    """The wait ran past both; they come out in the order of the wire."""
    world = World()
    port = VirtualPort(world)
    world.attach(Script([(10 * MS, BEAT)], 125_000))
    world.at(10 * MS + 5 * BIT, lambda _: world.jam())

    first, second = port.next(20 * MS), port.next(20 * MS)

    assert isinstance(first, BusEvent)
    assert first.at == 10 * MS + 5 * BIT
    assert isinstance(second, Sighting)
    assert second.frame is BEAT
