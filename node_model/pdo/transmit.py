"""A TPDO: when it is sent and what it then carries (CiA 301 4.2.0, 7.2.2.2 and 7.5.2.37).

Laws: it lives in operational, while it is valid and maps something. Type 0 answers a SYNC
after its objects have changed, type n every n-th SYNC, 252 and 253 remote frames alone, 254
and 255 each change, at most once an inhibit time, and at least once an event time. Waiting
for the inhibit time it sends the values of the end, not of the beginning.
"""

from __future__ import annotations

from collections.abc import Callable

from node_model.frame import Frame, data_frame
from node_model.node import NOTHING, Frames, earliest
from node_model.od import ObjectDictionary
from node_model.pdo.mapping import Direction, Mapping
from node_model.pdo.parameters import EVENTS, LAST_SYNCHRONOUS, RTR, TIMER, PdoParameters


class Tpdo:
    """One TPDO.

    Args:
        od: has its parameters and what it maps.
        index: of its communication parameter, 1800h..19FFh.
    """

    parameters_type: Callable[..., PdoParameters] = PdoParameters

    def __init__(self, od: ObjectDictionary, index: int) -> None:
        self.parameters = self.parameters_type(od, index, Direction.TRANSMIT, self._written)
        self._operational = False
        self._mapping = Mapping()
        self._keys: frozenset[tuple[int, int]] = frozenset()
        self._type = 0
        self._can_id = 0
        self._clear()

    def _clear(self) -> None:
        self.active = False
        self._due_at: int | None = None
        self._timer_at: int | None = None
        self._sent_at: int | None = None
        self._seen = b""
        self._sampled: bytes | None = None
        self._changed = False
        self._waits = False
        self._count = 0

    # Its life.

    def begin(self, now: int) -> None:
        """Operational, or set up anew in it: all counting starts."""
        sent_at = self._sent_at
        self._clear()
        self._sent_at = sent_at
        self._operational = True
        self._mapping = self.parameters.mapping()
        self._keys = self._mapping.keys
        self._type = self.parameters.type()
        self._can_id = self.parameters.can_id()
        self.active = self.parameters.is_valid() and self._mapping.size > 0
        if self.active:
            self._waits = self.parameters.start_value() > 0
            self._seen = self._mapping.pack()
            if self.sends_first():
                self._ask(now)
            else:
                self._arm(now)

    def end(self) -> None:
        """Not operational any more: what waits is dropped."""
        self._operational = self.active = False
        self._due_at = self._timer_at = None

    def reset(self) -> None:
        """The device initialises: nothing was ever sent."""
        self.end()
        self._clear()

    # What happens to it.

    def on_change(self, key: tuple[int, int], now: int) -> None:
        """The object at that index and sub-index was written."""
        if not self.active or key not in self._keys or not self.is_news():
            return
        if self._type in EVENTS:
            self._ask(now)
        self._changed = True

    def on_sync(self, counter: int | None) -> bytes | None:
        """What this SYNC makes it send, if anything; sampled now."""
        if not self.active or not self.is_due_at(counter):
            return None
        self._sampled = self._seen = self._mapping.pack()
        self._changed = False
        return self._sampled if self.is_synchronous() else None

    def on_remote(self, now: int) -> Frames:
        """Somebody asks for it."""
        if not self.active or not self.answers_remote():
            return NOTHING
        if self._type in EVENTS:
            return (self._send(now),)
        data = self._mapping.pack() if self._type == RTR else self._sampled
        return (self.frame(self._mapping.pack() if data is None else data),)

    def advance(self, now: int) -> Frames:
        """What is due by events and by the event timer."""
        frames = NOTHING
        while (due := self.deadline()) is not None and due <= now:
            if self._timer_at == due:
                self._timer_at = None
                self._ask(due)
            if self._due_at == due:
                frames = (*frames, self._send(due))
        return frames

    def deadline(self) -> int | None:
        """The end of the inhibit time or of the event time."""
        return self._due_at if self._timer_at is None else earliest(self._due_at, self._timer_at)

    # What decides.

    def is_synchronous(self) -> bool:
        """A SYNC sends it."""
        return self._type <= LAST_SYNCHRONOUS

    def sends_first(self) -> bool:
        """An event-driven PDO is sent when operational begins."""
        return self._type in EVENTS

    def is_news(self) -> bool:
        """What it carries differs from what was sent last."""
        return self._mapping.pack() != self._seen

    def is_due_at(self, counter: int | None) -> bool:
        """Whether this SYNC concerns it: each with 0 after a change, each with 252."""
        if self._type == 0:
            return self._changed
        if self.is_synchronous():
            return self.counts(counter)
        return self._type < RTR

    def counts(self, counter: int | None) -> bool:
        """Whether this SYNC is the n-th; one with the start value counts as such."""
        if self._waits and counter is not None:
            self._waits = counter != self.parameters.start_value()
            return not self._waits
        self._count = (self._count + 1) % self._type
        return self._count == 0

    def answers_remote(self) -> bool:
        """COB-ID: bit 30 clear."""
        return self.parameters.allows_rtr()

    def free_at(self) -> int:
        """When the inhibit time of the last transmission is over."""
        return 0 if self._sent_at is None else self._sent_at + self.parameters.inhibit_ns()

    def frame(self, data: bytes) -> Frame:
        """It, with these data."""
        return data_frame(self._can_id, data)

    # What it does.

    def _ask(self, now: int) -> None:
        if self._due_at is None:
            self._due_at = max(now, self.free_at())

    def _arm(self, now: int) -> None:
        """The event time counts from now."""
        period = self.parameters.timer_ns() if self._type in EVENTS else 0
        self._timer_at = now + period if period else None

    def _send(self, now: int) -> Frame:
        self._seen = self._mapping.pack()
        self._sent_at = now
        self._due_at = None
        self._arm(now)
        return self.frame(self._seen)

    def _written(self, sub: int, now: int) -> None:
        """A client has written a parameter."""
        if not self._operational:
            return
        if sub == TIMER and self.active:
            self._arm(now)
        else:
            self.begin(now)
