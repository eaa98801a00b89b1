"""The smallest node: boot-up, then a heartbeat for ever. A neighbour on the bus."""

from __future__ import annotations

from node_model.frame import Frame
from node_model.heartbeat import HeartbeatProducer, heartbeat_frame
from node_model.nmt import NmtState
from node_model.node import NOTHING, Frames


class Beacon:
    """A node that announces itself and beats in pre-operational.

    Args:
        node_id: 1..127.
        period_ns: heartbeat producer time.
        bit_rate: bit/s while powered.
    """

    listens_to: frozenset[int] | None = frozenset()

    def __init__(self, node_id: int, period_ns: int, bit_rate: int) -> None:
        self._rate = bit_rate
        self.bit_rate = 0
        self._boot_up = heartbeat_frame(node_id, NmtState.INITIALISING)
        self._beats: Frames = (heartbeat_frame(node_id, NmtState.PRE_OPERATIONAL),)
        self._producer = HeartbeatProducer(period_ns)

    def power_on(self, now: int) -> Frames:
        """Boot-up at once; the first beat one period later."""
        if self.bit_rate:
            return NOTHING
        self.bit_rate = self._rate
        self._producer.start(now)
        return (self._boot_up,)

    def power_off(self, now: int) -> Frames:  # noqa: ARG002  a verb of every node
        """Silence."""
        self.bit_rate = 0
        self._producer.stop()
        return NOTHING

    def receive(self, frame: Frame, now: int) -> Frames:  # noqa: ARG002  a verb of every node
        """It heeds nothing."""
        return NOTHING

    def advance(self, now: int) -> Frames:
        """The beats that are due."""
        producer = self._producer
        if producer.due_at is None or now < producer.due_at:
            return NOTHING
        producer.beat()
        frames = self._beats
        while producer.due_at <= now:
            producer.beat()
            frames = (*frames, *self._beats)
        return frames

    def deadline(self) -> int | None:
        """The next beat."""
        return self._producer.due_at
