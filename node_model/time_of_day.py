"""TIME: the time of day, sent and heard (CiA 301 4.2.0, 7.2.6 and 7.1.6.5).

Laws: six bytes, 28 bits of milliseconds after midnight and 16 bits of days since 1984-01-01.
Nothing is sent or heard in stopped; a frame of another length is not a TIME. Between two
TIMEs the time goes on with the device's own clock.

Wiring: needs no other service. CiA 301 leaves open when a producer sends: each `period_ns`,
or when the application calls `announce`.
"""

from __future__ import annotations

from node_model.cob_id import BIT_30, BIT_31, CAN_ID, check_cob_id, check_same_can_id
from node_model.frame import Frame, data_frame
from node_model.nmt import NmtState
from node_model.node import MS, NOTHING, Frames
from node_model.od import ObjectDictionary
from node_model.service import QuietService

TIME_COB_ID = 0x100
COB_ID = 0x1012
DAY_MS = 86_400_000
MILLISECONDS = (1 << 28) - 1


class TimeOfDay(QuietService):
    """TIME of a device.

    Args:
        od: its 1012h; without it TIME is neither sent nor heard.
        period_ns: from one TIME to the next as a producer; 0 = only when asked.
    """

    alone = True
    set_up_by = timed_by = frozenset((COB_ID,))

    def __init__(self, od: ObjectDictionary, period_ns: int = 0) -> None:
        self._od = od
        self._period_ns = period_ns
        self._due_at: int | None = None
        self._set_ms = 0
        self._set_at = 0
        od.guard(COB_ID, self._guard)
        od.observe(COB_ID, self._written)

    def listens_to(self) -> frozenset[int]:
        """The TIME, as a consumer."""
        return frozenset((self.can_id(),)) if self.consumes() else frozenset()

    def start(self, now: int) -> Frames:
        """A producer begins."""
        super().start(now)
        self._begin(now)
        return NOTHING

    def enter(self, state: NmtState, now: int) -> Frames:
        """Stopped ends the production, any other state resumes it."""
        was, self.state = self.state, state
        if not self.may_act():
            self._due_at = None
        elif was is NmtState.STOPPED:
            self._begin(now)
        return NOTHING

    def receive(self, frame: Frame, now: int) -> Frames:
        """The time of somebody else."""
        if self.may_act() and self.consumes() and self.fits(frame):
            self.set(*self.decode(frame.data), now)
        return NOTHING

    def advance(self, now: int) -> Frames:
        """The TIMEs that are due."""
        frames = NOTHING
        while self._due_at is not None and self._due_at <= now:
            frames = (*frames, self.frame(self._due_at))
            self._due_at += self._period_ns
        return frames

    def deadline(self) -> int | None:
        """The next TIME to send."""
        return self._due_at

    def stop(self) -> None:
        """Nothing is sent."""
        super().stop()
        self._due_at = None

    # The time.

    def set(self, milliseconds: int, days: int, now: int) -> None:
        """It is that many ms after midnight, that many days after 1984-01-01."""
        self._set_ms = days * DAY_MS + milliseconds
        self._set_at = now

    def time(self, now: int) -> tuple[int, int]:
        """Milliseconds after midnight, and days since 1984-01-01."""
        days, milliseconds = divmod(self._set_ms + (now - self._set_at) // MS, DAY_MS)
        return milliseconds, days & 0xFFFF

    def announce(self, now: int) -> Frames:
        """Send a TIME, if this is a producer and its state allows it."""
        sends = self.running and self.may_act() and self.produces()
        return (self.frame(now),) if sends else NOTHING

    # What decides.

    def may_act(self) -> bool:
        """In pre-operational and operational (7.3.2.2.5)."""
        return self.state is not NmtState.STOPPED

    def consumes(self) -> bool:
        """1012h: bit 31 set."""
        return bool(self._od.number(COB_ID) & BIT_31)

    def produces(self) -> bool:
        """1012h: bit 30 set."""
        return bool(self._od.number(COB_ID) & BIT_30)

    def can_id(self) -> int:
        """Identifier of the TIME."""
        return self._od.number(COB_ID, 0, TIME_COB_ID) & CAN_ID

    def fits(self, frame: Frame) -> bool:
        """A data frame of six bytes."""
        return not frame.remote and len(frame.data) == 6

    def decode(self, data: bytes) -> tuple[int, int]:
        """Milliseconds and days of a TIME; the four bits between them mean nothing."""
        return int.from_bytes(data[:4], "little") & MILLISECONDS, int.from_bytes(
            data[4:], "little"
        )

    def frame(self, now: int) -> Frame:
        """The TIME of this instant."""
        milliseconds, days = self.time(now)
        data = milliseconds.to_bytes(4, "little") + days.to_bytes(2, "little")
        return data_frame(self.can_id(), data)

    # What it does.

    def _begin(self, now: int) -> None:
        wanted = self.running and self.may_act() and self.produces() and self._period_ns
        self._due_at = now + self._period_ns if wanted else None

    def _guard(self, sub: int, data: bytes) -> None:  # noqa: ARG002  a VAR
        """The identifier stays while the service is used."""
        old, new = self._od.number(COB_ID), int.from_bytes(data, "little")
        check_cob_id(new, BIT_31 | BIT_30)
        if old & (BIT_31 | BIT_30) and new & (BIT_31 | BIT_30):
            check_same_can_id(old, new)

    def _written(self, sub: int, now: int) -> None:  # noqa: ARG002  a VAR
        self._begin(now)
