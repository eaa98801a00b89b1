"""Heartbeat producer (CiA 301 4.2.0, 7.2.8.2.2.1): a beat each period, on a fixed grid.

Law: the next beat is one period after the *due* instant of the last one, so that a late
caller delays a beat and never shifts the grid.
"""

from __future__ import annotations

from node_model.frame import Frame, data_frame
from node_model.nmt import NmtState

HEARTBEAT_BASE = 0x700


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
