"""A frame that nobody listens to goes over the wire as any other does."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial

from hypothesis import example, given
from hypothesis import strategies as st

from node_model.beacon import Beacon
from node_model.controller import Controller
from node_model.frame import Frame
from node_model.keypad import Keypad, Parameters, load
from node_model.node import MS, NOTHING, US, Frames, Node
from node_model.world import World

RATE = 125_000
BEAT_NS = 54 * 8 * US
"""A heartbeat of these stations, roughly: what follows that closely meets it on the wire."""


class Listener:
    """Acknowledges, and hears everything or nothing."""

    bit_rate = RATE

    def __init__(self, ear: frozenset[int] | None) -> None:
        self.listens_to = ear

    def power_on(self, now: int) -> Frames:  # noqa: ARG002  a verb of every node
        """Nothing."""
        return NOTHING

    power_off = advance = power_on

    def receive(self, frame: Frame, now: int) -> Frames:  # noqa: ARG002  a verb of every node
        """Nothing."""
        return NOTHING

    def deadline(self) -> int | None:
        """Never."""
        return None


STEPS = st.lists(
    st.tuples(
        st.sampled_from((0, 1, BEAT_NS - 1, BEAT_NS, BEAT_NS + 24 * US, MS, 3 * MS, 20 * MS)),
        st.sampled_from(("look", "send", "jam", "retune", "plan", "power")),
    ),
    min_size=5,
    max_size=40,
)
BEACONS = st.lists(
    st.tuples(
        st.sampled_from((2 * MS, 3 * MS, 3 * MS + 1, 5 * MS)),
        st.sampled_from((0, 1, MS, BEAT_NS)),
    ),
    max_size=3,
)


def switched_on(world: World, station: Controller, node: Node, _: int) -> None:
    """A stimulus for the calendar."""
    world.act(station, node.power_on)


class Heard:
    """What `gather` fills."""

    def __init__(self) -> None:
        self.frames: list[Frame] = []
        self.instants: list[int] = []
        self.own: list[int] = []


Seen = tuple[Frame, int, int, int] | tuple[Frame, int, bool] | int


def one_by_one(world: World, until: int, tester: Controller) -> Iterator[Seen]:  # noqa: ARG001
    """Each frame, when it ended, who sent it, when that was asked for."""
    while (found := world.next_frame(until)) is not None:
        frame, at, sender, asked_at = found
        assert world.now == at
        yield frame, at, world.controllers.index(sender), asked_at


def singly(world: World, until: int, tester: Controller) -> Iterator[Seen]:
    """Each frame, when it ended, and whether it is the tester's."""
    while (found := world.next_frame(until)) is not None:
        yield found[0], found[1], found[2] is tester


def together(world: World, until: int, tester: Controller) -> Iterator[Seen]:
    """The same, gathered seven at a time at most."""
    over = False
    while not over:
        heard = Heard()
        over = world.gather(until, 7, heard, tester)
        assert len(heard.frames) <= 7
        assert over or len(heard.frames) == 7 or world.errors
        for place, (frame, at) in enumerate(zip(heard.frames, heard.instants, strict=True)):
            yield frame, at, place in heard.own


def played(
    ear: frozenset[int] | None,
    beacons: Sequence[tuple[int, int]],
    steps: Sequence[tuple[int, str]],
    look: Callable[[World, int, Controller], Iterator[Seen]] = one_by_one,
) -> list[Seen]:
    """What a tester sees, and when it looks."""
    world = World(RATE)
    tester = world.attach()
    world.attach(Listener(ear))
    pad = Keypad(replace(load(), factory=Parameters(2, 3, 20, 0, 0)))
    panel = world.attach(pad)
    world.act(panel, pad.power_on)
    for number, (period_ns, phase_ns) in enumerate(beacons):
        beacon = Beacon(10 + number, period_ns, RATE)
        station = world.attach(beacon)
        world.at(phase_ns, partial(switched_on, world, station, beacon))
    seen: list[Seen] = []
    until = 49 * MS

    def jam(_: int) -> None:
        world.jam()

    deeds: dict[str, Callable[[], None]] = {
        "look": lambda: None,
        "send": lambda: world.send(tester, Frame(0, b"\x01\x02")),
        "jam": world.jam,
        "retune": lambda: world.set_bit_rate(375_000 - world.bit_rate),
        "plan": lambda: world.at(world.now + 2 * MS, jam),
        "power": lambda: world.act(panel, pad.power_off if pad.powered else pad.power_on),
    }
    for wait_ns, deed in steps:
        until += wait_ns
        seen += look(world, until, tester)
        seen.append(world.now)
        deeds[deed]()
    return seen + world.errors


@given(beacons=BEACONS, steps=STEPS)
@example(beacons=[], steps=[(3 * MS, "look")] * 30)
@example(beacons=[(2 * MS, 0), (3 * MS, 1)], steps=[(MS, "jam")] * 30)
def test_whether_anybody_listens_changes_nothing_on_the_wire(
    beacons: list[tuple[int, int]], steps: list[tuple[int, str]]
) -> None:
    """Frames, instants, senders and errors are the same with a node that hears it all."""
    assert played(frozenset(), beacons, steps) == played(None, beacons, steps)


@given(beacons=BEACONS, steps=STEPS)
@example(beacons=[], steps=[(200 * MS, "look")] * 5)
@example(beacons=[(5 * MS, 0)], steps=[(200 * MS, "send")] * 5)
@example(beacons=[], steps=[(200 * MS, "plan")] * 5)
def test_frames_that_are_gathered_are_those_that_come_one_by_one(
    beacons: list[tuple[int, int]], steps: list[tuple[int, str]]
) -> None:
    """A keypad that repeats its heartbeat, alone or among others, and whatever is done."""
    ear: frozenset[int] = frozenset()
    assert played(ear, beacons, steps, together) == played(ear, beacons, steps, singly)
