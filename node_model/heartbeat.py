"""Heartbeat producer (CiA 301 4.2.0, 7.2.8.2.2.1): a beat each period, on a fixed grid.

Law: the next beat is one period after the *due* instant of the last one, so that a late
caller delays a beat and never shifts the grid.
"""

from __future__ import annotations

from collections.abc import Callable

from node_model.frame import Frame, data_frame
from node_model.nmt import NmtState
from node_model.node import MS, NOTHING, Frames
from node_model.od import ObjectDictionary
from node_model.service import QuietService

HEARTBEAT_BASE = 0x700
PRODUCER_TIME = 0x1017


def heartbeat_frame(node_id: int, state: NmtState) -> Frame:
    """Error control frame that shows `state`; with INITIALISING it is the boot-up."""
    return data_frame(HEARTBEAT_BASE + node_id, bytes((state,)))


class HeartbeatProducer:
    """When the next beat is due.

    Args:
        period_ns: 0 = no heartbeat.
    """

    __slots__ = ("due_at", "period_ns")

    def __init__(self, period_ns: int) -> None:
        self.period_ns = period_ns
        self.due_at: int | None = None

    def start(self, now: int) -> None:
        """Boot-up was sent at `now`; the first beat follows one period later."""
        self.due_at = now + self.period_ns if self.period_ns else None

    def stop(self) -> None:
        """No more beats until the next start."""
        self.due_at = None

    def beat(self) -> None:
        """The beat that was due is being sent."""
        if self.due_at is not None:
            self.due_at += self.period_ns

    def go_on(self, until: int, most: int) -> range:
        """The beats that are due up to `until` are being sent, `most` of them at most."""
        first, period_ns = self.due_at, self.period_ns
        if first is None or not period_ns or first > until:
            return range(0)
        due = range(first, until + 1, period_ns)[:most]
        self.due_at = due.stop
        return due


class HeartbeatService(QuietService):
    """Heartbeat producer of a device, set up by 1017h.

    A written time acts at once: the first beat follows one period later, whatever beat was
    due before. Wiring: needs no other service.

    Args:
        od: its 1017h, in ms; without it there is no heartbeat.
        node_id: may be changed before a start.
        producer: makes the timer for a period in ns.
    """

    alone = True
    timed_by = frozenset((PRODUCER_TIME,))

    def __init__(
        self,
        od: ObjectDictionary,
        node_id: int,
        producer: Callable[[int], HeartbeatProducer] = HeartbeatProducer,
    ) -> None:
        self._od = od
        self.node_id = node_id
        self._make = producer
        self._producer = producer(0)
        od.observe(PRODUCER_TIME, self._written)

    def start(self, now: int) -> Frames:
        """The boot-up counts as the first beat."""
        self._restart(now)
        return super().start(now)

    def advance(self, now: int) -> Frames:
        """The beats that are due."""
        frames = NOTHING
        producer = self._producer
        while producer.due_at is not None and producer.due_at <= now:
            producer.beat()
            frames = (*frames, self.beat())
        return frames

    def deadline(self) -> int | None:
        """The next beat."""
        return self._producer.due_at

    def stop(self) -> None:
        """No more beats."""
        super().stop()
        self._producer.stop()

    def beat(self) -> Frame:
        """A beat that shows the present state."""
        return heartbeat_frame(self.node_id, self.state)

    def period_ns(self) -> int:
        """1017h, in ms."""
        return self._od.number(PRODUCER_TIME) * MS

    def _restart(self, now: int) -> None:
        self._producer = self._make(self.period_ns())
        self._producer.start(now)

    def _written(self, sub: int, now: int) -> None:  # noqa: ARG002  a VAR
        if self.running:
            self._restart(now)
