"""Stations for a virtual wire, and frames whose lengths were counted by hand.

The literal lengths were counted bit by bit with `tests/oracles/bits.py`, stuff bits included:
701#00 has 56 bits, 709#00 55, 709#7F 54, 081#00500100... 121, 555#5555555555555555 109,
2AA# 46, 155# 46, 124# 45. At 125 kbit/s a bit takes 8000 ns; between two frames are 3 bits.
"""

from __future__ import annotations

from node_model.controller import Controller
from node_model.frame import Frame
from node_model.node import MS, NOTHING, Frames
from node_model.world import World

BIT = 8000
BOOT_UP = Frame(0x701, b"\0")
EMCY = Frame(0x081, b"\x00\x50\x01\x00\x00\x00\x00\x00")
LONG = Frame(0x555, b"\x55" * 8)
LOW, HIGH = Frame(0x2AA), Frame(0x155)


class Ear:
    """A node that writes down what it hears, and answers with what it was given."""

    def __init__(self, bit_rate: int = 125_000, answer: Frames = NOTHING) -> None:
        self.bit_rate = bit_rate
        self.listens_to: frozenset[int] | None = None
        self.answer = answer
        self.heard: list[tuple[int, Frame]] = []
        self.due_at: int | None = None

    def power_on(self, now: int) -> Frames:  # noqa: ARG002  a verb of every node
        """Nothing."""
        return NOTHING

    def power_off(self, now: int) -> Frames:  # noqa: ARG002  a verb of every node
        """Off the bus."""
        self.bit_rate = 0
        return NOTHING

    def receive(self, frame: Frame, now: int) -> Frames:
        """Write it down."""
        self.heard.append((now, frame))
        return self.answer

    def advance(self, now: int) -> Frames:
        """One frame when it is due."""
        if self.due_at is None or now < self.due_at:
            return NOTHING
        self.due_at = None
        return (BOOT_UP,)

    def deadline(self) -> int | None:
        """When that frame is due."""
        return self.due_at


def wire(rate: int = 125_000) -> tuple[World, Controller]:
    """A world with a tester in it."""
    world = World(rate)
    return world, world.attach()


def all_frames(world: World, until: int) -> list[tuple[int, Frame]]:
    """Everything that ends on the wire by `until`."""
    seen = []
    while (found := world.next_frame(until)) is not None:
        seen.append((found[1], found[0]))
    return seen


class Hasty(Ear):
    """A node that takes back what has waited for longer than half a millisecond."""

    def withdraws(self, frame: Frame, asked_at: int, now: int) -> bool:
        """All but EMCY."""
        return frame != EMCY and now > asked_at + MS // 2
