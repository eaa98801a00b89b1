"""The world's wire, written with SimPy: the yardstick of `benchmarks.bus_hours`.

Same nodes, same rules (exact lengths, intermission, lowest identifier first, acceptance
filters, FIFO mailboxes, bit rates), written as one would with SimPy: a process for each
node that sleeps until its deadline and is interrupted when that changes, a process for
the wire, a heap for arbitration. It takes the short ways that SimPy offers: integer time,
no resources or stores, no condition events, no time-out for an intermission that nobody
waits for. `benchmarks.bus_hours` checks frame by frame that it does what the world does.

Left out, since the workloads do not need it: aborted frames, changes of the wire's rate.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Generator
from heapq import heappop, heappush
from typing import Any

import simpy
from simpy.events import Initialize

from node_model.frame import INTERMISSION_BITS, Frame
from node_model.node import Frames, Node

_STIMULUS, _END, _START = 2, 3, 4
"""Priorities within one instant; devices have SimPy's own (1)."""

Waiting = tuple[int, int, Frame, "Station"]
Steps = Generator[simpy.Event, Any, None]


class Later(simpy.Event):
    """SimPy's Timeout with a priority of its own."""

    def __init__(self, env: Any, delay: int, priority: int) -> None:
        self.env = env
        self.callbacks = []
        self._value = None
        self._ok = True
        env.schedule(self, priority, delay)


class Station:
    """A node, its mailbox, and the process that calls it at its deadlines."""

    __slots__ = ("depth", "due_at", "listens_to", "node", "process", "rate", "waiting")

    def __init__(self, node: Node | None, depth: int) -> None:
        self.node = node
        self.depth = depth
        self.waiting: deque[Waiting] = deque()
        self.due_at: int | None = None
        self.rate = 0
        self.listens_to: frozenset[int] | None = frozenset()
        self.process: simpy.Process | None = None


class SimpyWire:
    """One wire and everything on it, as SimPy processes.

    Args:
        bit_rate: of the wire in bit/s.
    """

    def __init__(self, bit_rate: int) -> None:
        # Any: its time is annotated as int or float, and is an integer throughout here.
        self.env: Any = simpy.Environment()
        self.bit_rate = bit_rate
        self.bit_ns = 1_000_000_000 // bit_rate
        self.frames = 0
        self._heard: simpy.Event | None = None
        self._stations: list[Station] = []
        self._routes: dict[int, list[Station]] = {}
        self._audience = 0
        self._contest: list[Waiting] = []
        self._order = 0
        self._asked: simpy.Event | None = None
        self.env.process(self._wire())

    def attach(self, node: Node | None = None, depth: int = 256) -> Station:
        """Put a node, or with None a tester, on the wire."""
        station = Station(node, depth)
        self._stations.append(station)
        if node is None:
            station.rate = self.bit_rate
            self._count()
        else:
            self._retune(station, node)
        return station

    def send(self, station: Station, frame: Frame) -> None:
        """Queue a frame for a station."""
        self._queue(station, (frame,))

    def act(self, station: Station, verb: Callable[[int], Frames]) -> None:
        """Tell a node something at this instant."""
        self._queue(station, verb(self.env._now))
        self._settle(station)

    def at(self, instant: int, action: Callable[[int], None]) -> None:
        """Put a stimulus on the calendar."""
        env = self.env
        event = Later(env, instant - env.now, _STIMULUS)
        event.callbacks.append(lambda _: action(instant))

    def next_frame(self) -> simpy.Event:
        """What a tester's process waits for; its value is the frame and when it ended."""
        self._heard = heard = simpy.Event(self.env)
        return heard

    def run(self, until: int) -> None:
        """Let time pass, up to and with the instant `until`."""
        self.env.run(until + 1)

    def _device(self, station: Station, node: Node) -> Steps:
        """A node's life: sleep until its deadline, advance, send."""
        timeout = self.env.timeout
        queue = self._queue
        now: int = self.env._now
        due = station.due_at
        while due is not None:
            try:
                yield timeout(due - now)
            except simpy.Interrupt:
                now = self.env._now
                due = station.due_at
                continue
            now = due
            frames = node.advance(now)
            if frames:
                queue(station, frames)
            if node.bit_rate != station.rate or node.listens_to is not station.listens_to:
                self._retune(station, node)
            due = station.due_at = node.deadline()
        station.process = None

    def _wire(self) -> Steps:
        """The wire's life: wait for a request, arbitrate, carry the frame, hand it over."""
        env, bit_ns, contest = self.env, self.bit_ns, self._contest
        gap_ns = INTERMISSION_BITS * bit_ns
        idle_from = 0
        while True:
            while not contest or self._audience < 2:
                self._asked = asked = env.event()
                yield asked
                self._asked = None
            if env._now < idle_from:
                yield Later(env, idle_from - env._now, _START)
            frame, sender = self._winner()
            yield Later(env, frame.bits * bit_ns, _END)
            at: int = env._now
            idle_from = at + gap_ns
            self._deliver(frame, sender, at)

    def _winner(self) -> tuple[Frame, Station]:
        _, _, frame, sender = heappop(self._contest)
        waiting = sender.waiting
        waiting.popleft()
        if waiting:
            heappush(self._contest, waiting[0])
        return frame, sender

    def _deliver(self, frame: Frame, sender: Station, at: int) -> None:
        """A frame has ended: whoever listens has it."""
        self.frames += 1
        route = self._routes.get(frame.can_id)
        for station in self._route(frame.can_id) if route is None else route:
            node = station.node
            if station is not sender and node is not None:
                frames = node.receive(frame, at)
                if frames:
                    self._queue(station, frames)
                self._settle(station)
        if self._heard is not None:
            self._heard.succeed((frame, at))
            self._heard = None

    def _queue(self, station: Station, frames: Frames) -> None:
        """A station asks for frames to be sent."""
        node = station.node
        rate = self.bit_rate if node is None else node.bit_rate
        waiting = station.waiting
        for frame in frames:
            if rate != self.bit_rate or len(waiting) >= station.depth:
                continue
            self._order += 1
            entry = (frame.order, self._order, frame, station)
            if not waiting:
                heappush(self._contest, entry)
            waiting.append(entry)
        self._wake()

    def _wake(self) -> None:
        """An idle wire looks at the requests after everything else of this instant."""
        asked = self._asked
        if asked is not None and self._contest and self._audience > 1:
            self._asked = None
            asked._ok = True
            asked._value = None
            self.env.schedule(asked, _START)

    def _settle(self, station: Station) -> None:
        """A node was told something: its deadline may have changed."""
        node = station.node
        if node is None:
            return
        if node.bit_rate != station.rate or node.listens_to is not station.listens_to:
            self._retune(station, node)
        due = node.deadline()
        if due == station.due_at:
            return
        station.due_at = due
        if station.process is None:
            station.process = self.env.process(self._device(station, node))
        elif not isinstance(station.process.target, Initialize):
            station.process.interrupt()

    def _retune(self, station: Station, node: Node) -> None:
        station.rate = node.bit_rate
        station.listens_to = node.listens_to
        self._count()

    def _count(self) -> None:
        self._audience = sum(s.rate == self.bit_rate for s in self._stations)
        self._routes.clear()
        self._wake()

    def _route(self, can_id: int) -> list[Station]:
        route = self._routes[can_id] = [
            s
            for s in self._stations
            if s.rate == self.bit_rate and (s.listens_to is None or can_id in s.listens_to)
        ]
        return route
