"""Nodes in one process hear each other as on a bus, and a late host changes none of it."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise

import pytest

from node_model.devices import make_device
from node_model.frame import Frame
from node_model.host.loop import LATE_NS, Loop
from node_model.host.segment import HOP_NS, Segment
from node_model.node import MS, NOTHING, Frames
from tests.host.fakes import Clock, FakeWire

BEAT_NS = 100 * MS


@dataclass
class Player:
    """Beats as `name` every 100 ms, and answers the identifiers that it listens to."""

    name: int
    answers: dict[int, Frame] = field(default_factory=dict)
    open: bool = False
    bit_rate: int = 0
    listens_to: frozenset[int] | None = frozenset()
    heard: list[tuple[int, Frame]] = field(default_factory=list)
    beat_at: int | None = None

    def power_on(self, now: int) -> Frames:
        """It begins at once."""
        self.bit_rate, self.beat_at = 125_000, now + BEAT_NS
        self.listens_to = None if self.open else frozenset(self.answers)
        return NOTHING

    def power_off(self, now: int) -> Frames:  # noqa: ARG002  a verb of every node
        """Silence."""
        self.bit_rate, self.beat_at, self.listens_to = 0, None, frozenset()
        return NOTHING

    def receive(self, frame: Frame, now: int) -> Frames:
        """Write it down; answer."""
        self.heard.append((now, frame))
        answer = self.answers.get(frame.can_id)
        return NOTHING if answer is None else (answer,)

    def advance(self, now: int) -> Frames:
        """Beat as often as is due."""
        beats = []
        while self.beat_at is not None and self.beat_at <= now:
            self.beat_at += BEAT_NS
            beats.append(Frame(self.name))
        return beats

    def deadline(self) -> int | None:
        """The next beat."""
        return self.beat_at


class Bench:
    """A segment in a loop, switched on."""

    def __init__(self, *players: Player) -> None:
        self.clock = Clock()
        self.start = self.clock.now
        self.wire = FakeWire(self.clock)
        self.segment = Segment(players)
        self.loop = Loop(self.segment, self.wire, self.clock)
        self.loop.power(True, self.loop.instant())

    def turn_at(self, after_ns: int) -> None:
        """The loop comes round that long after power-on."""
        self.clock.now = self.start + after_ns
        self.loop.catch_up()

    def sent(self) -> list[int]:
        """Identifiers of what went to the bus."""
        return [frame.can_id for frame, _ in self.wire.sent]


def test_a_frame_of_one_node_reaches_the_bus_and_the_others_but_not_itself() -> None:
    """Whoever listens to it has it a moment after it was asked for; it goes out once."""
    one, two, deaf = Player(1, {1: Frame(0x11)}), Player(2, open=True), Player(3)
    bench = Bench(one, two, deaf)
    bench.turn_at(BEAT_NS + HOP_NS)

    assert bench.sent() == [1, 2, 3]
    assert two.heard == [(bench.start + BEAT_NS + HOP_NS, Frame(n)) for n in (1, 3)]
    assert one.heard == deaf.heard == []


def test_a_frame_of_the_bus_reaches_all_who_listen_at_its_stamp() -> None:
    """What one of them answers reaches the others."""
    one, two, deaf = Player(1, {0x50: Frame(0x51)}), Player(2, open=True), Player(3)
    bench = Bench(one, two, deaf)
    at = bench.start + 7 * MS
    bench.wire.incoming += [(Frame(0x50), at), (Frame(0x50, extended=True), at + 1)]
    bench.turn_at(8 * MS)

    assert one.heard == [(at, Frame(0x50))]
    assert two.heard == [
        (at, Frame(0x50)),
        (at + 1, Frame(0x50, extended=True)),
        (at + HOP_NS, Frame(0x51)),
    ]
    assert deaf.heard == []
    assert bench.sent() == [0x51]


def test_a_stopped_host_changes_nothing_among_the_nodes() -> None:
    """They hear each other at the same instants, and the same frames go out, late."""

    def players() -> tuple[Player, ...]:
        answering = Player(1, {2: Frame(0x12), 0x12: Frame(0x13)})
        return answering, Player(2, {0x12: Frame(0x22)}), Player(3, open=True)

    prompt, stopped = players(), players()
    in_time, late = Bench(*prompt), Bench(*stopped)
    for tenth in range(1, 10 * 500 + 1):
        in_time.turn_at(tenth * MS // 10)
    late.turn_at(500 * MS)

    assert late.sent() == in_time.sent()
    assert [player.heard for player in stopped] == [player.heard for player in prompt]
    assert not in_time.loop.late
    dues = [due for due, _ in late.loop.late]
    assert dues == sorted(dues)
    assert dues[:4] == [late.start + BEAT_NS] * 3 + [late.start + BEAT_NS + HOP_NS]
    assert all(sent - due > LATE_NS for due, sent in late.loop.late)


def test_nodes_that_answer_each_other_do_not_stop_the_clock() -> None:
    """Each answer takes the time of a short frame."""
    one, two = Player(1, {0x22: Frame(0x21), 2: Frame(0x21)}), Player(2, {0x21: Frame(0x22)})
    bench = Bench(one, two)
    bench.turn_at(BEAT_NS + 10 * HOP_NS)

    assert bench.sent() == [1, 2, *[0x21, 0x22] * 5]
    assert [later - sooner for (sooner, _), (later, _) in pairwise(two.heard)] == [2 * HOP_NS] * 4


@pytest.mark.parametrize(("listens", "due_ns"), [(True, BEAT_NS + HOP_NS), (False, 2 * BEAT_NS)])
def test_a_frame_that_no_neighbour_wants_wakes_nobody(listens: bool, due_ns: int) -> None:
    """The host sleeps until the next beat."""
    bench = Bench(Player(1, {2: Frame(3)} if listens else {}), Player(2))
    bench.turn_at(BEAT_NS)

    assert bench.loop.wake_at() == bench.start + due_ns


def test_without_power_all_are_deaf_and_mute() -> None:
    """What was under way is gone."""
    one, two = Player(1, open=True), Player(2, open=True)
    bench = Bench(one, two)
    bench.turn_at(BEAT_NS)
    bench.loop.power(False, bench.loop.instant())
    bench.wire.incoming.append((Frame(0x50), bench.start + BEAT_NS + 1))
    bench.turn_at(3 * BEAT_NS)

    assert bench.segment.bit_rate == 0
    assert one.heard == two.heard == []
    assert bench.sent() == [1, 2]
    assert bench.loop.wake_at() is None


class Sleeper(Player):
    """Takes no part from 99h on until its next beat."""

    def receive(self, frame: Frame, now: int) -> Frames:
        """99h: off the bus; what it says with that is lost."""
        self.bit_rate = 0 if frame.can_id == 0x99 else self.bit_rate
        return (*super().receive(frame, now), Frame(0x77))

    def advance(self, now: int) -> Frames:
        """Back on the bus."""
        self.bit_rate = 125_000
        return super().advance(now)


def test_a_node_that_takes_no_part_is_deaf_and_mute() -> None:
    """One that initialises hears nothing of its neighbours, nor of the bus."""
    one, two = Player(1, {2: Frame(0x12)}), Sleeper(2, open=True)
    bench = Bench(one, two)
    for can_id, after_ms in ((0x99, 10), (0x50, 20)):
        bench.wire.incoming.append((Frame(can_id), bench.start + after_ms * MS))
    bench.turn_at(2 * BEAT_NS - 1)

    assert [frame.can_id for _, frame in two.heard] == [0x99, 0x12]
    assert bench.sent() == [1, 2, 0x12, 0x77]


def test_a_drive_misses_the_heartbeat_of_its_neighbour() -> None:
    """It keeps quiet while that beats, however late the host is, and tells when it does not."""
    drives = [make_device("drive", settings={"node_id": n, "heartbeat_ms": 50}) for n in (1, 2)]
    clock = Clock()
    start, wire = clock.now, FakeWire(clock)
    loop = Loop(Segment(drives), wire, clock)
    loop.power(True, start)

    def until(after_ms: int, *incoming: Frame) -> set[int]:
        wire.sent.clear()
        wire.incoming += [(frame, clock.now) for frame in incoming]
        clock.now = start + after_ms * MS
        loop.catch_up()
        return {frame.can_id for frame, _ in wire.sent}

    assert until(100) == {0x701, 0x702}
    watch = Frame(0x602, bytes.fromhex("2316100164000100"))
    assert until(5000, watch) == {0x582, 0x701, 0x702}
    assert until(6000, Frame(0x601, bytes.fromhex("2B17100000000000"))) == {0x581, 0x702, 0x82}
