"""The wire: who is on it, what waits to be sent, and whose frame goes next.

How time passes there is the business of `world`; the laws of both stand there.
"""

from __future__ import annotations

from collections.abc import Callable
from heapq import heapify, heappop, heappush

from node_model.controller import DEFAULT_DEPTH, Controller, Mailbox, Waiting
from node_model.frame import INTERMISSION_BITS, Frame
from node_model.node import Frames, Node

ERROR_FRAME_BITS = 20
"""Six bits error flag, six more by those who answer it, eight bits delimiter."""

Delivery = tuple[Frame, int, Controller, int]
"""A finished frame: itself, when it ended, who sent it, and when that was asked for."""

Event = tuple[int, int, int, "Controller | None", "Callable[[int], None] | None"]
"""When, rank at that instant, order of planning; a controller's deadline, or a stimulus."""


class Wire:
    """One wire and everything on it, at one instant.

    Args:
        bit_rate: of the wire in bit/s; a divisor of 1 000 000 000.
        now: the instant at which it begins.
    """

    def __init__(self, bit_rate: int = 125_000, now: int = 0) -> None:
        self.now = now
        self.bit_rate = bit_rate
        self.bit_ns = 1_000_000_000 // bit_rate
        self._pause_ns = INTERMISSION_BITS * self.bit_ns
        self.controllers: list[Controller] = []
        self._events: list[Event] = []
        self._order = 0
        self._routes: dict[int, tuple[Controller, ...]] = {}
        self._audience = 0
        self._contest: list[Waiting] = []
        """Heap of the frames that take part in the next arbitration."""
        self._flying: Waiting | None = None
        self._ends_at = 0
        self._idle_from = now
        self.errors: list[int] = []
        """When error frames began that a tester has not taken note of yet."""

    # Who is there.

    def attach(
        self,
        node: Node | None = None,
        mailbox: Mailbox = Mailbox.FIFO,
        depth: int = DEFAULT_DEPTH,
    ) -> Controller:
        """Put a node, or with None a tester, on the wire.

        Args:
            node: told the time and the frames from now on.
            mailbox: order of its waiting frames.
            depth: how many frames may wait; further ones are lost.
        """
        controller = Controller(node, mailbox, depth)
        self.controllers.append(controller)
        if node is None:
            controller.rate = self.bit_rate
            self._count()
        else:
            self._settle(controller)
        return controller

    def set_bit_rate(self, bit_rate: int) -> None:
        """The wire, and every tester on it, runs at `bit_rate` bit/s from now on."""
        if bit_rate == self.bit_rate:
            return
        self._abort()
        self.bit_rate = bit_rate
        self.bit_ns = 1_000_000_000 // bit_rate
        self._pause_ns = INTERMISSION_BITS * self.bit_ns
        for controller in self.controllers:
            if controller.node is None:
                controller.rate = bit_rate
            self._drop_if_deaf(controller)
        self._count()

    # What is done to it.

    def send(self, controller: Controller, frame: Frame) -> None:
        """Queue a frame for a controller."""
        self._queue(controller, (frame,))

    def act(self, controller: Controller, verb: Callable[[int], Frames]) -> None:
        """Tell a node something (its power, its keys) at this instant."""
        self._queue(controller, verb(self.now))
        self._settle(controller)

    def at(self, instant: int, action: Callable[[int], None]) -> None:
        """Put a stimulus on the calendar; it is called with its instant."""
        self._order += 1
        heappush(self._events, (max(instant, self.now), 1, self._order, None, action))

    def jam(self) -> None:
        """An error frame destroys what is on the wire now; its sender tries again.

        It takes an active error flag, its echo and the delimiter (ISO 11898-1, error frame),
        then the intermission.
        """
        self.errors.append(self.now)
        flying = self._flying
        if flying is not None:
            sender = flying[4]
            self._contest = [entry for entry in self._contest if entry[4] is not sender]
            sender.waiting.appendleft(flying)
            self._contest += sender.waiting if sender.by_identifier else [flying]
            heapify(self._contest)
            self._flying = None
        busy_bits = ERROR_FRAME_BITS + INTERMISSION_BITS
        self._idle_from = max(self._idle_from, self.now + busy_bits * self.bit_ns)

    # The parts of it.

    def _gets_used_to(self, sender: Controller, frame: Frame) -> bool:
        """Keep a frame in mind that would go over the wire and be heard by no node."""
        if sender.rate != self.bit_rate or self._audience < 2:
            return False
        key = -1 if frame.extended else frame.can_id
        route = self._routes.get(key)
        if self._route(key) if route is None else route:
            return False
        sender.usual, sender.usual_ns = frame, frame.bits * self.bit_ns
        return True

    def _push(self, at: int, controller: Controller) -> None:
        self._order += 1
        heappush(self._events, (at, 0, self._order, controller, None))

    def _queue(self, controller: Controller, frames: Frames) -> None:
        """A node asks for frames to be sent."""
        node = controller.node
        rate = self.bit_rate if node is None else node.bit_rate
        waiting = controller.waiting
        for frame in frames:
            if rate != self.bit_rate or len(waiting) >= controller.depth:
                controller.lost += 1
                continue
            self._order += 1
            entry = (frame.order, self._order, frame, self.now, controller)
            if not waiting or controller.by_identifier:
                heappush(self._contest, entry)
            waiting.append(entry)

    def _settle(self, controller: Controller) -> None:
        """A node was told something: its outputs may have changed."""
        node = controller.node
        if node is None:
            return
        if node.bit_rate != controller.rate or node.listens_to is not controller.listens_to:
            self._retune(controller, node)
        due = node.deadline()
        if due != controller.due_at:
            controller.due_at = due
            if due is not None:
                self._push(due, controller)

    def _retune(self, controller: Controller, node: Node) -> None:
        """A controller changed its bit rate or its acceptance filter."""
        controller.rate = node.bit_rate
        controller.listens_to = node.listens_to
        flying = self._flying
        if flying is not None and flying[4] is controller and controller.rate != self.bit_rate:
            self._abort()
        self._drop_if_deaf(controller)
        self._count()

    def _drop_if_deaf(self, controller: Controller) -> None:
        """Off the wire's bit rate nothing can be sent: what waited is lost."""
        if controller.rate != self.bit_rate and controller.waiting:
            controller.lost += len(controller.waiting)
            controller.waiting.clear()
            self._contest = [entry for entry in self._contest if entry[4] is not controller]
            heapify(self._contest)

    def _count(self) -> None:
        """Who hears and acknowledges has changed."""
        rate, audience = self.bit_rate, 0
        self._routes.clear()
        for controller in self.controllers:
            controller.usual = None
            audience += controller.rate == rate
        self._audience = audience

    def _abort(self) -> None:
        """The frame on the wire is cut off in the middle, which everybody sees as an error."""
        if self._flying is not None:
            self.errors.append(self.now)
            self._flying[4].lost += 1
            self._flying = None
            self._idle_from = self.now + self._pause_ns

    def _start(self, at: int) -> Waiting | None:
        """The wire is idle and somebody wants it: the lowest identifier wins.

        Returns:
            Its frame, or None where the sender takes it back.
        """
        best = heappop(self._contest)
        sender = best[4]
        waiting = sender.waiting
        if waiting[0] is best:
            waiting.popleft()
        else:
            waiting.remove(best)
        if waiting and not sender.by_identifier:
            heappush(self._contest, waiting[0])
        if sender.withdraws is not None and sender.withdraws(best[2], best[3], at):
            return None
        self.now = at
        self._flying = best
        self._ends_at = at + (best[2].known_bits or best[2].bits) * self.bit_ns
        return best

    def _finish(self, flying: Waiting) -> Delivery:
        """The frame on the wire has ended: everybody at this rate has it."""
        _, _, frame, requested_at, sender = flying
        self._flying = None
        self.now = at = self._ends_at
        self._idle_from = at + self._pause_ns
        key = -1 if frame.extended else frame.can_id
        route = self._routes.get(key)
        for listener in self._route(key) if route is None else route:
            node = listener.node
            if listener is not sender and node is not None:
                frames = node.receive(frame, at)
                if frames:
                    self._queue(listener, frames)
                self._settle(listener)
        return frame, at, sender, requested_at

    def _route(self, key: int) -> tuple[Controller, ...]:
        """The stations whose acceptance filter lets this identifier through; -1 = extended."""
        rate = self.bit_rate
        route = [
            c
            for c in self.controllers
            if c.rate == rate and (c.listens_to is None or key in c.listens_to)
        ]
        return self._routes.setdefault(key, tuple(route))
