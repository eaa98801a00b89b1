"""Where many stations are due at one instant, or many frames wait, all goes as one by one."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import NamedTuple

from hypothesis import example, given
from hypothesis import strategies as st

from node_model.beacon import Beacon
from node_model.controller import Controller, Gathered, Mailbox
from node_model.frame import Frame
from node_model.load import Load
from node_model.node import MS, NOTHING, US, Frames, Node, S
from node_model.world import World

RATE = 125_000


class StepByStep(World):
    """Every device is served by itself, every frame goes out by itself."""

    def _crowd(self, at: int) -> None:
        """Nobody is served before his turn."""

    def _drain(self, until: int, most: int, heard: Gathered, own: Controller) -> None:
        """No frame goes out before its turn."""


class Plan(NamedTuple):
    """What a station does, again and again.

    Args:
        said: with each turn, as many frames as that, -1 = it joins or leaves the bus, -2 = it
            opens or closes its ear.
        period_ns: between two turns.
        phase_ns: of the first one.
        number: of its identifiers.
        mailbox: order of its waiting frames.
        depth: how many may wait.
        answers: it hears the identifier 101h, and answers, which delays its next turn.
        patience_ns: how long a frame may wait; 0 = for ever.
    """

    said: tuple[int, ...]
    period_ns: int
    phase_ns: int = 0
    number: int = 1
    mailbox: Mailbox = Mailbox.FIFO
    depth: int = 8
    answers: bool = False
    patience_ns: int = 0


class Station:
    """Acts by a plan, on a grid."""

    def __init__(self, plan: Plan) -> None:
        self.plan = plan
        self.bit_rate = RATE
        self._ears = frozenset((0x101,)), frozenset[int]()
        self.listens_to: frozenset[int] | None = self._ears[not plan.answers]
        self.turn = 0
        self.heard: list[int] = []
        self._due_at = plan.phase_ns

    def power_on(self, now: int) -> Frames:  # noqa: ARG002  a verb of every node
        """It is always on."""
        return NOTHING

    power_off = power_on

    def receive(self, frame: Frame, now: int) -> Frames:
        """An answer to whatever is heard."""
        self.heard.append(now)
        self._due_at += MS
        return (Frame(0x80 + self.plan.number, frame.data),)

    def advance(self, now: int) -> Frames:
        """The turns that are due."""
        frames: list[Frame] = []
        while self._due_at <= now:
            count = self.plan.said[self.turn % len(self.plan.said)]
            self.turn += 1
            self._due_at += self.plan.period_ns
            frames += [
                Frame(0x100 * (place + 1) + self.plan.number, bytes((self.turn & 0xFF,)))
                for place in range(count)
            ]
            if count == -1:
                self.bit_rate = RATE - self.bit_rate
            elif count == -2:
                self.listens_to = self._ears[self.listens_to is self._ears[0]]
        return frames

    def deadline(self) -> int | None:
        """The next turn; there are eight."""
        return self._due_at if self.turn < 8 else None


class Impatient(Station):
    """Takes back what waits for too long."""

    def withdraws(self, frame: Frame, asked_at: int, now: int) -> bool:  # noqa: ARG002
        """Whether it does not want it any more."""
        return now - asked_at > self.plan.patience_ns


def made(plan: Plan) -> Node:
    """A station of that plan."""
    return Impatient(plan) if plan.patience_ns else Station(plan)


PERIODS = st.sampled_from((5 * MS, 5 * MS, 10 * MS, 10 * MS + 1, 7 * MS - 13, 432 * US))
PHASES = st.sampled_from((5 * MS, 5 * MS, 5 * MS, 5 * MS + 1, 6 * MS, 5 * MS + 456 * US))
PLANS = st.builds(
    Plan,
    said=st.sampled_from(((1,), (1,), (1,), (1, 0), (2, 1), (3,), (1, -1, 0, -1), (1, -2))),
    period_ns=PERIODS,
    phase_ns=PHASES,
    number=st.integers(1, 12),
    mailbox=st.sampled_from(Mailbox),
    depth=st.sampled_from((0, 1, 2, 8)),
    answers=st.sampled_from((False, False, False, True)),
    patience_ns=st.sampled_from((0, 0, 0, MS)),
)
STEPS = st.lists(
    st.tuples(
        st.sampled_from((0, 1, 431 * US, 432 * US, MS, 5 * MS, 20 * MS - 1, 20 * MS)),
        st.sampled_from(("look", "look", "send", "urgent", "jam", "plan", "retune")),
    ),
    min_size=3,
    max_size=12,
)
BEACONS = st.lists(st.tuples(st.integers(1, 20), PERIODS), min_size=6, max_size=20)


def state_of(world: World) -> list[object]:
    """Everything that can make a difference to what comes."""
    stations: list[object] = []
    for controller in world.controllers:
        waiting = [(entry[2], entry[3]) for entry in controller.waiting]
        node = controller.node
        told = (node.turn, tuple(node.heard)) if isinstance(node, Station) else ()
        due_at = node.deadline() if node is not None else None
        stations.append((waiting, controller.lost, controller.rate, told, due_at))
    return [world.now, tuple(world.errors), stations]


def jam(world: World, _: int) -> None:
    """A stimulus for the calendar."""
    world.jam()


class Heard:
    """What `gather` fills."""

    def __init__(self) -> None:
        self.frames: list[Frame] = []
        self.instants: list[int] = []
        self.own: list[int] = []


def played(
    world: World,
    beacons: Sequence[tuple[int, int]],
    plans: Sequence[Plan],
    steps: Sequence[tuple[int, str]],
    most: int,
) -> list[object]:
    """All that a tester sees, and how each station is whenever it has seen something."""
    tester = world.attach()
    for number, period_ns in beacons:
        beacon = Beacon(number, period_ns, RATE)
        world.act(world.attach(beacon), beacon.power_on)
    for plan in plans:
        world.attach(made(plan), plan.mailbox, plan.depth)
    load = Load([Frame(0x340, b"\x55"), Frame(0x7F0)], 50_000, RATE)
    world.act(world.attach(load), load.power_on)
    deeds: dict[str, Callable[[], None]] = {
        "look": lambda: None,
        "send": lambda: world.send(tester, Frame(0x101, b"\x01")),
        "urgent": lambda: world.send(tester, Frame(0x700, b"\x02")),
        "jam": world.jam,
        "plan": lambda: world.at(world.now + 2 * MS, partial(jam, world)),
        "retune": lambda: world.set_bit_rate(375_000 - world.bit_rate),
    }
    found: list[object] = []
    until = 0
    for wait_ns, deed in steps:
        until += wait_ns
        over = False
        while not over:
            heard = Heard()
            over = world.gather(until, most, heard, tester)
            found += [heard.frames, heard.instants, heard.own, over, state_of(world)]
            assert len(heard.frames) <= most
            if world.errors and not over:
                world.errors.clear()
        deeds[deed]()
    return found


ALL_AT_ONCE = [Plan((1,), 10 * MS, 5 * MS, number) for number in range(1, 13)]
SIXTY = [(number, 20 * MS) for number in range(1, 61)]
QUEUES = [Plan((3,), 10 * MS, 5 * MS, n, list(Mailbox)[n % 2]) for n in range(1, 12)]
"""They ask for more than goes out by their next turn."""

IMPATIENT = [
    Plan((0, 1) if number < 7 else (1,), 10 * MS, 5 * MS, number, patience_ns=3 * MS)
    for number in range(12, 0, -1)
]
"""In every second turn all twelve want the bus, for longer than they wait."""

ALIKE = [
    Plan((count,), 10 * MS, 5 * MS, number)
    for number, count in zip((1, 1, 257, 1, 257, 513, 1, 1), (1, 2, 1, 3, 1, 1, 1, 1), strict=True)
]
"""Several send with the same identifiers."""

STAYS = Plan((1,), 5 * MS, 5 * MS, 0)
LEAVING = [STAYS, *[Plan((2, -1), 5 * MS, 5 * MS, n % 9) for n in range(20)], STAYS]
"""Most leave while their frames wait; the first and the last stay."""


@given(
    beacons=BEACONS,
    plans=st.lists(PLANS, max_size=12),
    steps=STEPS,
    most=st.sampled_from((1, 2, 7, 256)),
)
@example(beacons=SIXTY, plans=[], steps=[(MS, "look")] * 9, most=7)
@example(beacons=[], plans=ALL_AT_ONCE, steps=[(10 * MS, "send")] * 9, most=256)
@example(beacons=SIXTY, plans=[], steps=[(23 * MS, "urgent")] * 4, most=99)
@example(beacons=[], plans=QUEUES, steps=[(10 * MS, "look")] * 9, most=99)
@example(beacons=[], plans=IMPATIENT, steps=[(10 * MS, "look")] * 9, most=256)
@example(beacons=[], plans=ALIKE, steps=[(10 * MS, "look")] * 9, most=256)
@example(beacons=[], plans=LEAVING, steps=[(10 * MS, "look")] * 9, most=256)
@example(beacons=[(1, 5 * MS)] * 9, plans=ALL_AT_ONCE, steps=[(20 * MS, "plan")] * 3, most=256)
def test_many_are_served_as_they_are_one_by_one(
    beacons: list[tuple[int, int]], plans: list[Plan], steps: list[tuple[int, str]], most: int
) -> None:
    """Frames, instants, losses, what waits and what each station knows, at every look."""
    together = played(World(RATE), beacons, plans, steps, most)
    singly = played(StepByStep(RATE), beacons, plans, steps, most)
    assert together == singly


def test_a_stimulus_at_the_end_of_a_frame_comes_before_it() -> None:
    """Nine stations; an error frame destroys the third frame at its very end."""
    found = []
    for world in (World(RATE), StepByStep(RATE)):
        tester, heard = world.attach(), Heard()
        for number in range(1, 10):
            beacon = Beacon(number, 10 * MS, RATE)
            world.act(world.attach(beacon), beacon.power_on)
        world.gather(15 * MS, 99, heard, tester)
        third = heard.instants[11]
        world.at(third + 10 * MS, partial(jam, world))
        assert not world.gather(99 * MS, 99, heard, tester)
        found.append((heard.instants, state_of(world)))
        assert len(heard.instants) == 9 + 9 + 3
        assert heard.instants[-1] > third + 10 * MS
    assert found[0] == found[1]


class Shy(Station):
    """Leaves the bus as soon as it hears something."""

    def receive(self, frame: Frame, now: int) -> Frames:
        """Enough."""
        self.bit_rate = 0
        return super().receive(frame, now)


def test_nothing_goes_out_once_nobody_acknowledges() -> None:
    """The only listener leaves at the first of a tester's nine frames; eight wait for ever."""
    world = World(RATE)
    tester, heard = world.attach(None, Mailbox.BY_IDENTIFIER), Heard()
    world.attach(Shy(Plan((0,), S, S, answers=True)))
    for number in range(9):
        world.send(tester, Frame(0x101 + number))
    assert world.gather(S // 2, 99, heard, tester)
    assert (len(heard.frames), heard.own) == (1, [0])
    assert len(tester.waiting) == 8
