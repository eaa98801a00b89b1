"""A wire whose truth is known: stations that send what a script says, each frame as it was seen.

The world tells when each frame was asked for; a tester only sees when it ended.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from hil_tests.judge.causal import CausalClock, Seen
from hil_tests.trace import Sighting
from node_model.controller import Controller, Mailbox
from node_model.frame import Frame
from node_model.node import NOTHING, Frames
from node_model.world import World

Request = tuple[int, Frame]
"""When, in ns, and what."""

BIT = 8000
"""A bit at 125 kbit/s, in ns."""

BEAT = Frame(0x701, b"\x05")
DEVICE = frozenset((0x701, 0x081, 0x181, 0x581))
"""What the device under test sends."""


def of_device(frame: Frame) -> bool:
    """Whether the device under test sends it."""
    return frame.can_id in DEVICE


def clock_125() -> CausalClock:
    """A clock for 125 kbit/s that knows the device."""
    return CausalClock(BIT, of_device)


class Script:
    """A station that asks for frames at given instants.

    Args:
        requests: in order of time; those of one instant are asked for together.
        bit_rate: bit/s.
    """

    listens_to: frozenset[int] | None = frozenset()

    def __init__(self, requests: Sequence[Request], bit_rate: int) -> None:
        self.bit_rate = bit_rate
        self._requests = sorted(requests, key=lambda request: request[0])
        self._turn = 0

    def power_on(self, now: int) -> Frames:  # noqa: ARG002  a verb of every node
        """It runs already."""
        return NOTHING

    def power_off(self, now: int) -> Frames:  # noqa: ARG002  a verb of every node
        """It goes on."""
        return NOTHING

    def receive(self, frame: Frame, now: int) -> Frames:  # noqa: ARG002  a verb of every node
        """It heeds nothing."""
        return NOTHING

    def advance(self, now: int) -> Frames:
        """The requests that are due."""
        begin = self._turn
        while (due := self.deadline()) is not None and due <= now:
            self._turn += 1
        return tuple(frame for _, frame in self._requests[begin : self._turn])

    def deadline(self) -> int | None:
        """The next request."""
        left = self._turn < len(self._requests)
        return self._requests[self._turn][0] if left else None


@dataclass(frozen=True, slots=True)
class Told:
    """A frame with the truth.

    Args:
        seen: what the judge makes of it.
        wanted_at: when it was asked for.
        sender: the station.
    """

    seen: Seen
    wanted_at: int
    sender: Controller

    @property
    def inside(self) -> bool:
        """Whether the truth lies in the causal interval."""
        return self.seen.wanted.earliest <= self.wanted_at <= self.seen.wanted.latest

    def __str__(self) -> str:
        return f"{self.seen.frame} at {self.seen.at}: {self.wanted_at} in {self.seen.wanted}"


Stamping = Callable[[int, int], tuple[int, int]]
"""From a frame's place and its true end to its stamp and the doubt of it, in ns."""


def exact(_: int, end: int) -> tuple[int, int]:
    """Virtual time: the stamp is the end."""
    return end, 0


class Wire:
    """A world with a tester who watches it.

    Args:
        bit_rate: bit/s.
    """

    def __init__(self, bit_rate: int = 125_000) -> None:
        self.world = World(bit_rate)
        self.tester = self.world.attach()

    def join(self, requests: Sequence[Request], mailbox: Mailbox = Mailbox.FIFO) -> Controller:
        """A station with a script joins."""
        station = Script(requests, self.world.bit_rate)
        return self.world.attach(station, mailbox)

    def watch(self, clock: CausalClock, until: int, stamping: Stamping = exact) -> list[Told]:
        """Let time pass, and what the clock says of each frame."""
        told: list[Told] = []
        while (delivery := self.world.next_frame(until)) is not None:
            frame, end, sender, wanted_at = delivery
            at, doubt_ns = stamping(len(told), end)
            sighting = Sighting(frame, at, doubt_ns, sender is self.tester)
            told.append(Told(clock.see(sighting, len(told)), wanted_at, sender))
        return told
