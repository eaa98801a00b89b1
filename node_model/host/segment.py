"""Several nodes behind one end of the bus: to the host they are one node.

Laws, besides those of a node (`node_model.node`):
1. What one of them says goes to the bus and to its neighbours. It is handed on here: a CAN
   socket, like most interfaces, never gives a sender its own frames, and if it did, they
   would come when the host got round to sending them. Then a host that was stopped for a
   second would make one node miss the heartbeat of another.
2. A neighbour hears a frame `HOP_NS` after it was asked for, whatever the host does. So two
   nodes that answer each other need time for it, as on a bus, and frames keep their order.
3. Frames go out in the order in which they were asked for. There is no arbitration among
   the nodes and there are no bit times, as on a vcan.
4. Nodes that take part have the same bit rate; one that starts or is off hears nothing.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence

from node_model.frame import Frame
from node_model.node import NOTHING, US, Frames, Node, earliest

HOP_NS = 47 * US
"""What the shortest frame takes at 1 Mbit/s."""

_EXTENDED = -1
"""Key of all extended frames."""


class Segment:
    """Nodes on one stretch of bus.

    Args:
        nodes: switched off. At the same instant the first one acts first.
    """

    listens_to: frozenset[int] | None = None

    def __init__(self, nodes: Sequence[Node]) -> None:
        self.nodes = tuple(nodes)
        self.bit_rate = 0
        self._dues: list[int | None] = [None for _ in nodes]
        self._soonest: int | None = None
        self._tuned: list[tuple[int, frozenset[int] | None]] = [(0, None) for _ in nodes]
        self._routes: dict[int, tuple[int, ...]] = {}
        self._flying: deque[tuple[int, int, Frame]] = deque()
        """When it is heard, number of its sender, and the frame."""

    def power_on(self, now: int) -> Frames:
        """Supply for all of them."""
        return self._all_told([node.power_on(now) for node in self.nodes], now)

    def power_off(self, now: int) -> Frames:
        """No supply for any of them."""
        self._flying.clear()
        return self._all_told([node.power_off(now) for node in self.nodes], now)

    def receive(self, frame: Frame, now: int) -> Frames:
        """A frame of somebody else: whoever listens to it has it."""
        return self._heard(frame, None, now)

    def advance(self, now: int) -> Frames:
        """Deadlines of the nodes, and frames among them, oldest first."""
        said: list[Frame] = []
        while (due := self.deadline()) is not None and due <= now:
            if due == self._soonest:
                number = self._dues.index(due)
                said += self._told(number, self.nodes[number].advance(due), due)
            else:
                _, sender, frame = self._flying.popleft()
                said += self._heard(frame, sender, due)
        return said

    def deadline(self) -> int | None:
        """The first deadline of a node, or the end of a frame among them."""
        return earliest(self._soonest, self._flying[0][0] if self._flying else None)

    # The parts of it.

    def _all_told(self, answers: Sequence[Frames], now: int) -> Frames:
        said: list[Frame] = []
        for number, frames in enumerate(answers):
            said += self._told(number, frames, now)
        return said

    def _heard(self, frame: Frame, sender: int | None, now: int) -> Frames:
        """All who listen to it, but its sender, have a frame."""
        said: list[Frame] = []
        for number in self._listeners(frame):
            if number != sender:
                said += self._told(number, self.nodes[number].receive(frame, now), now)
        return said

    def _told(self, number: int, frames: Frames, now: int) -> Frames:
        """A node was told something, and said that: it may want other things now."""
        node = self.nodes[number]
        if node.deadline() != self._dues[number]:
            self._dues[number] = node.deadline()
            self._soonest = earliest(*self._dues)
        tuned = node.bit_rate, node.listens_to
        if tuned != self._tuned[number]:
            self._tuned[number] = tuned
            self._routes.clear()
            self.bit_rate = max(rate for rate, _ in self._tuned)
        if not node.bit_rate:
            return NOTHING
        for frame in frames:
            if any(other != number for other in self._listeners(frame)):
                self._flying.append((now + HOP_NS, number, frame))
        return frames

    def _listeners(self, frame: Frame) -> tuple[int, ...]:
        """Numbers of the nodes whose acceptance filter lets it through."""
        key = _EXTENDED if frame.extended else frame.can_id
        found = self._routes.get(key)
        if found is None:
            found = self._routes[key] = tuple(
                number
                for number, (rate, wanted) in enumerate(self._tuned)
                if rate and (wanted is None or key in wanted)
            )
        return found
