"""Heartbeat consumer of a device (CiA 301 4.2.0, 7.2.8.2.2.1 and 7.5.2.19).

Laws: each entry of 1016h watches a node by itself. Watching begins with that node's first
heartbeat after the entry was written or the device was initialised. Silence for longer than
the consumer time is an event, once; the next heartbeat ends it. A boot-up prolongs the
watching and neither begins it nor ends an event.

Wiring: after the error handler.
"""

from __future__ import annotations

from node_model.emcy import COMMUNICATION_ERROR
from node_model.frame import Frame
from node_model.guarding import LIFE_GUARD_ERROR
from node_model.heartbeat import HEARTBEAT_BASE
from node_model.node import MS, NOTHING, Frames, earliest
from node_model.od import AbortCode, ObjectDictionary, SdoAbort
from node_model.od.dictionary import key_of
from node_model.service import ErrorHandler, Fault, QuietService

CONSUMER_TIME = 0x1016
NODE_IDS = range(1, 128)


class Watch:
    """One entry of 1016h.

    Args:
        sub: its sub-index.
        value: what the entry holds: node id in bit 16 to 23, consumer time in ms below.
    """

    __slots__ = ("active", "lapse_at", "lost", "node_id", "sub", "time_ns")

    def __init__(self, sub: int, value: int) -> None:
        self.sub = sub
        self.node_id = value >> 16 & 0xFF
        self.time_ns = (value & 0xFFFF) * MS
        self.active = self.node_id in NODE_IDS and self.time_ns > 0
        """It names a node and a time."""
        self.lapse_at: int | None = None
        self.lost = False

    @property
    def cause(self) -> str:
        """Name of its error."""
        return f"heartbeat of node {self.node_id}"


class HeartbeatConsumer(QuietService):
    """Watches the heartbeats of other nodes.

    Args:
        od: its 1016h; without it nobody is watched.
        errors: is told of heartbeat events.
    """

    set_up_by = timed_by = frozenset((CONSUMER_TIME,))

    def __init__(self, od: ObjectDictionary, errors: ErrorHandler) -> None:
        self._od = od
        self._errors = errors
        first = key_of(CONSUMER_TIME, 0)
        self._subs = [sub for sub in range(1, 128) if first + sub in od.entries]
        self._watches: dict[int, Watch] = {}
        self._due: int | None = None
        self._healed: list[tuple[int, str]] = []
        od.guard(CONSUMER_TIME, self._guard)
        od.observe(CONSUMER_TIME, self._written)

    # The verbs of a service.

    def listens_to(self) -> frozenset[int]:
        """Error control frames of the nodes that it watches."""
        watches = self._watches.values()
        return frozenset([HEARTBEAT_BASE + watch.node_id for watch in watches if watch.active])

    def start(self, now: int) -> Frames:
        """Nobody has been heard."""
        self._healed = []
        self._watches = {sub: self._watch(sub) for sub in self._subs}
        self._plan()
        return super().start(now)

    def receive(self, frame: Frame, now: int) -> Frames:
        """A heartbeat or a boot-up."""
        if frame.remote or len(frame.data) != 1:
            return NOTHING
        frames = NOTHING
        for watch in self._watches.values():
            if watch.active and frame.can_id == HEARTBEAT_BASE + watch.node_id:
                frames = (*frames, *self._heard(watch, frame.data[0], now))
        self._plan()
        return frames

    def advance(self, now: int) -> Frames:
        """The events that are due, oldest first."""
        frames = NOTHING
        while (due := self.deadline()) is not None and due <= now:
            frames = (*frames, *self._fire(due))
            self._plan()
        return frames

    def deadline(self) -> int | None:
        """The next node to be missed."""
        return self._due

    def stop(self) -> None:
        """Nobody is watched."""
        super().stop()
        self._watches = {}
        self._healed = []
        self._due = None

    # What decides.

    def begins(self, data: int) -> bool:
        """Whether this error control byte begins the watching: a boot-up does not."""
        return data != 0

    def ends_event(self, data: int) -> bool:
        """Whether this error control byte ends a heartbeat event: a boot-up does not."""
        return data != 0

    def event(self, watch: Watch) -> Fault:
        """The error that a missing heartbeat is; the maker's first byte names the node."""
        return Fault(
            LIFE_GUARD_ERROR, COMMUNICATION_ERROR, bytes((watch.node_id,)), communication=True
        )

    # What it does.

    def _watch(self, sub: int) -> Watch:
        return Watch(sub, self._od.number(CONSUMER_TIME, sub))

    def _heard(self, watch: Watch, data: int, now: int) -> Frames:
        if watch.lapse_at is not None or self.begins(data):
            watch.lapse_at = now + watch.time_ns
        if not watch.lost or not self.ends_event(data):
            return NOTHING
        watch.lost = False
        return self._errors.heal(watch.cause, now)

    def _fire(self, now: int) -> Frames:
        if self._healed and self._healed[0][0] == now:
            return self._errors.heal(self._healed.pop(0)[1], now)
        watch = next(watch for watch in self._watches.values() if watch.lapse_at == now)
        watch.lapse_at = None
        watch.lost = True
        return self._errors.occur(watch.cause, self.event(watch), now)

    # Its object.

    def _guard(self, sub: int, data: bytes) -> None:
        """Bits 24 to 31 are 0, and no node is watched twice."""
        value = int.from_bytes(data, "little")
        if value >> 24:
            raise SdoAbort(AbortCode.VALUE)
        wanted = Watch(sub, value)
        if wanted.active and self.is_watched(wanted):
            raise SdoAbort(AbortCode.INCOMPATIBLE)

    def is_watched(self, wanted: Watch) -> bool:
        """Another entry watches that node already."""
        others = (self._watch(sub) for sub in self._subs if sub != wanted.sub)
        return any(other.active and other.node_id == wanted.node_id for other in others)

    def _written(self, sub: int, now: int) -> None:
        """The entry waits for the first heartbeat; an event of its old node is over."""
        old = self._watches.get(sub)
        if old is None:
            return
        if old.lost:
            self._healed.append((now, old.cause))
        self._watches[sub] = self._watch(sub)
        if old.lost or old.lapse_at is not None:
            self._plan()

    def _plan(self) -> None:
        """When somebody will be missed, or an event is over."""
        ends = (watch.lapse_at for watch in self._watches.values())
        self._due = earliest(*ends, *(at for at, _ in self._healed))
