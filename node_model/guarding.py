"""Node guarding and life guarding of a device (CiA 301 4.2.0, 7.2.8.2.2.2).

Laws: every poll is answered with the NMT state and a bit that alternates from 0; only an
initialisation resets that bit. Life guarding begins with the first poll. Without a poll
within 100Ch x 100Dh there is a life guarding event, once; the next poll ends it. The
heartbeat has precedence: while 1017h is not 0 no poll is served.

Wiring: after the error handler.
"""

from __future__ import annotations

from node_model.emcy import COMMUNICATION_ERROR
from node_model.frame import Frame, data_frame
from node_model.heartbeat import HEARTBEAT_BASE, PRODUCER_TIME
from node_model.node import MS, NOTHING, Frames, earliest
from node_model.od import ObjectDictionary
from node_model.service import ErrorHandler, Fault, QuietService

GUARD_TIME = 0x100C
LIFE_TIME_FACTOR = 0x100D
CAUSE = "life guarding"
LIFE_GUARD_ERROR = 0x8130
LIFE_GUARDING_EVENT = Fault(LIFE_GUARD_ERROR, COMMUNICATION_ERROR, communication=True)


class NodeGuarding(QuietService):
    """The guarded side.

    Args:
        od: its 100Ch, 100Dh and 1017h, as far as they are there.
        node_id: may be changed before a start.
        errors: is told of life guarding events.
    """

    timed_by = frozenset((GUARD_TIME, LIFE_TIME_FACTOR, PRODUCER_TIME))

    def __init__(self, od: ObjectDictionary, node_id: int, errors: ErrorHandler) -> None:
        self._od = od
        self.node_id = node_id
        self._errors = errors
        self._toggle = 0
        self._lapse_at: int | None = None
        self._over_at: int | None = None
        for index in self.timed_by:
            od.observe(index, self._written)

    # The verbs of a service.

    def listens_to(self) -> frozenset[int]:
        """Polls of this node."""
        return frozenset((HEARTBEAT_BASE + self.node_id,))

    def start(self, now: int) -> Frames:
        """The toggle bit is 0 and nobody has polled."""
        self._forget()
        self._toggle = self.first_toggle()
        return super().start(now)

    def receive(self, frame: Frame, now: int) -> Frames:
        """A poll is a remote frame."""
        if not frame.remote or not self.serves():
            return NOTHING
        return (self.answer(), *self._polled(now))

    def advance(self, now: int) -> Frames:
        """A life guarding event, or the end of one that is not watched for any more."""
        if self._over_at is not None and self._over_at <= now:
            return self._recover(now)
        if self._lapse_at is not None and self._lapse_at <= now:
            return self._lapse(self._lapse_at)
        return NOTHING

    def deadline(self) -> int | None:
        """The end of the life time."""
        return self._lapse_at if self._over_at is None else earliest(self._lapse_at, self._over_at)

    def stop(self) -> None:
        """Nobody is watched."""
        super().stop()
        self._forget()

    def _forget(self) -> None:
        self._lapse_at = self._over_at = None

    # What decides.

    def serves(self) -> bool:
        """Polls are answered: there is no heartbeat."""
        return not self._od.number(PRODUCER_TIME)

    def life_ns(self) -> int:
        """Life time; 0 = no life guarding."""
        return self._od.number(GUARD_TIME) * MS * self._od.number(LIFE_TIME_FACTOR)

    def first_toggle(self) -> int:
        """Toggle bit of the first answer after an initialisation."""
        return 0

    def next_toggle(self) -> int:
        """Toggle bit of the answer after this one."""
        return self._toggle ^ 0x80

    # What it does.

    def answer(self) -> Frame:
        """The state and the toggle bit, which then alternates."""
        frame = data_frame(HEARTBEAT_BASE + self.node_id, bytes((self._toggle | self.state,)))
        self._toggle = self.next_toggle()
        return frame

    def _polled(self, now: int) -> Frames:
        life = self.life_ns()
        self._lapse_at = now + life if life else None
        return self._recover(now)

    def _lapse(self, now: int) -> Frames:
        self._lapse_at = None
        return self._errors.occur(CAUSE, LIFE_GUARDING_EVENT, now)

    def _recover(self, now: int) -> Frames:
        self._over_at = None
        return self._errors.heal(CAUSE, now)

    def _written(self, sub: int, now: int) -> None:  # noqa: ARG002  each is a VAR
        """A new life time counts from now; none ends the watching and its event."""
        life = self.life_ns() if self.serves() else 0
        if self._lapse_at is not None:
            self._lapse_at = now + life if life else None
        if not life:
            self._over_at = now
