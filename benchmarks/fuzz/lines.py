"""How the frames reach a device: one call each, or over a world with bit times."""

from __future__ import annotations

from typing import Protocol

from benchmarks.fuzz.watched import Finding, Watched
from node_model.frame import Frame
from node_model.node import MS
from node_model.world import World

_STEP_BITS, _IDLE_STEPS = 150, 3
"""A step is longer than a frame; three of them hold a request, its answer, and one before."""
_MOST_STEPS = 1000
"""Until a bus is taken to be full for ever."""


class Spent(Exception):
    """The device is so busy that the rest of this life would take too long."""


class Line(Protocol):
    """What plays a life."""

    watched: Watched

    @property
    def now(self) -> int:
        """Its instant."""

    def power(self, on: bool) -> None:
        """Supply on or off."""

    def wait(self, span_ns: int) -> None:
        """Time goes on."""

    def send(self, frame: Frame) -> None:
        """A frame comes, now or as soon as the bus is free."""

    def settle(self) -> None:
        """What was sent arrives, and what is said because of it.

        Raises:
            Spent: the bus does not come to rest.
        """

    def close(self) -> None:
        """The life is over; what can be judged only now is."""


class Direct:
    """Every frame arrives at the very instant, whatever the acceptance filter says."""

    def __init__(self, watched: Watched) -> None:
        self.watched = watched
        self.now = 0

    def power(self, on: bool) -> None:
        """Supply on or off."""
        verb = self.watched.power_on if on else self.watched.power_off
        verb(self.now)

    def wait(self, span_ns: int) -> None:
        """Each deadline in its time."""
        watched, until = self.watched, self.now + span_ns
        while (due := watched.deadline()) is not None and due <= until:
            watched.advance(due)
        self.now = until

    def send(self, frame: Frame) -> None:
        """It is there."""
        self.watched.receive(frame, self.now)

    def settle(self) -> None:
        """It has arrived; a moment for what was due at the same instant."""
        self.wait(MS)

    def close(self) -> None:
        """Nothing is left to judge."""


class OnWire:
    """A world whose bit rate follows the device's."""

    def __init__(self, watched: Watched) -> None:
        self.watched = watched
        self._world = World(watched.device.facts.bit_rate)
        self._tester = self._world.attach()
        self._end = self._world.attach(watched)
        self._beats = 0

    @property
    def now(self) -> int:
        """The world's."""
        return self._world.now

    def power(self, on: bool) -> None:
        """Supply on or off."""
        self._world.act(self._end, self.watched.power_on if on else self.watched.power_off)

    def wait(self, span_ns: int) -> None:
        """Frames and deadlines in their order."""
        self._follow()
        until = self._world.now + span_ns
        while (seen := self._world.next_frame(until)) is not None:
            frame, _, sender, _ = seen
            ids = frame.can_id >> 7 == 0xE and not frame.extended
            self._beats += sender is self._end and ids and frame.can_id < 0x7E4

    def _follow(self) -> None:
        rate = self.watched.bit_rate
        if rate and rate != self._world.bit_rate:
            self._world.set_bit_rate(rate)

    def send(self, frame: Frame) -> None:
        """It waits for the bus."""
        self._world.send(self._tester, frame)

    def settle(self) -> None:
        """Until nothing waits for the bus any more, nor is on it."""
        idle = 0
        for _ in range(_MOST_STEPS):
            self.wait(_STEP_BITS * self._world.bit_ns)
            idle = 0 if self._tester.waiting or self._end.waiting else idle + 1
            if idle == _IDLE_STEPS:
                return
        raise Spent

    def close(self) -> None:
        """Every heartbeat has arrived, but where the bus could not take what there was."""
        asked = self.watched.beats
        self.settle()
        if not self._end.lost and self._beats < asked:
            raise Finding(f"{asked} heartbeats asked for, {self._beats} arrived")
