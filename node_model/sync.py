"""SYNC consumer and producer, and the synchronous window (CiA 301 4.2.0, 7.2.5).

Laws: a SYNC counts only with the length that 1019h says. A producer keeps a grid of 1006h;
its own SYNC is one for the device too. In stopped nothing is sent or heard, and the counter
of a producer begins at 1 again afterwards. The window opens with each SYNC and closes 1007h
later; before the first SYNC, and with 1007h = 0, it is open.

Wiring: before the PDOs, which are given this service. The unit of 1007h is a microsecond in
CiA 301 and a millisecond in the manuals of some makers.
"""

from __future__ import annotations

from collections.abc import Callable

from node_model.cob_id import BIT_30, BIT_31, CAN_ID, check_cob_id, check_same_can_id
from node_model.emcy import COMMUNICATION_ERROR
from node_model.frame import Frame, data_frame
from node_model.nmt import NmtState
from node_model.node import NOTHING, US, Frames
from node_model.od import AbortCode, ObjectDictionary, SdoAbort
from node_model.service import ErrorHandler, Fault, QuietService

SYNC_COB_ID = 0x080
COB_ID = 0x1005
CYCLE_PERIOD = 0x1006
WINDOW_LENGTH = 0x1007
COUNTER_OVERFLOW = 0x1019

CAUSE = "length of SYNC"
UNEXPECTED_LENGTH = Fault(0x8240, COMMUNICATION_ERROR)

SyncListener = Callable[[int | None, int], Frames]
"""Called with the counter of a SYNC, None where it has none, and its instant."""


class SyncService(QuietService):
    """SYNC of a device.

    Args:
        od: its 1005h, 1006h, 1007h and 1019h, as far as they are there.
        errors: is told of a SYNC of the wrong length.
        window_unit_ns: unit of 1007h.
        produces: the device can be a producer.
    """

    set_up_by = frozenset((COB_ID,))
    timed_by = frozenset((COB_ID, CYCLE_PERIOD, COUNTER_OVERFLOW))

    def __init__(
        self,
        od: ObjectDictionary,
        errors: ErrorHandler,
        window_unit_ns: int = US,
        produces: bool = True,
    ) -> None:
        self._od = od
        self._errors = errors
        self._window_unit_ns = window_unit_ns
        self._produces = produces
        self._listeners: list[SyncListener] = []
        self._due_at: int | None = None
        self._counter = 0
        self.synced_at: int | None = None
        od.guard(COB_ID, self._guard_cob_id)
        od.guard(COUNTER_OVERFLOW, self._guard_overflow)
        for index in self.timed_by:
            od.observe(index, self._written)

    def tell(self, listener: SyncListener) -> None:
        """`listener` acts on each SYNC; what it returns is sent."""
        self._listeners.append(listener)

    # The verbs of a service.

    def listens_to(self) -> frozenset[int]:
        """The SYNC."""
        return frozenset((self.can_id(),))

    def start(self, now: int) -> Frames:
        """No SYNC has been seen; a producer begins."""
        super().start(now)
        self.synced_at = None
        self._begin(now)
        return NOTHING

    def enter(self, state: NmtState, now: int) -> Frames:
        """Stopped ends the production, any other state resumes it."""
        was, self.state = self.state, state
        if not self.may_act():
            self._due_at = self.synced_at = None
        elif was is NmtState.STOPPED:
            self._begin(now)
        return NOTHING

    def receive(self, frame: Frame, now: int) -> Frames:
        """A SYNC of somebody else."""
        if frame.remote or not self.may_act():
            return NOTHING
        if not self.fits(frame.data):
            return self._errors.occur(CAUSE, UNEXPECTED_LENGTH, now)
        counter = frame.data[0] if frame.data else None
        return (*self._errors.heal(CAUSE, now), *self._sync(counter, now))

    def advance(self, now: int) -> Frames:
        """The SYNCs that are due, and what follows each."""
        frames = NOTHING
        while self._due_at is not None and self._due_at <= now:
            due, self._due_at = self._due_at, self.next_due(self._due_at)
            frames = (*frames, *self._produce(due))
        return frames

    def deadline(self) -> int | None:
        """The next SYNC to produce."""
        return self._due_at

    def stop(self) -> None:
        """Nothing is produced."""
        super().stop()
        self._due_at = self.synced_at = None

    # The window.

    def is_open(self, now: int) -> bool:
        """Whether synchronous PDOs may be sent and received at `now` (7.2.5.2)."""
        window = self.window_ns()
        return not window or self.synced_at is None or now <= self.synced_at + window

    def window_ns(self) -> int:
        """Length of the window; 0 = there is none."""
        return self._od.number(WINDOW_LENGTH) * self._window_unit_ns

    # What decides.

    def may_act(self) -> bool:
        """In pre-operational and operational (7.3.2.2.5)."""
        return self.state is not NmtState.STOPPED

    def can_id(self) -> int:
        """Identifier of the SYNC."""
        return self._od.number(COB_ID, 0, SYNC_COB_ID) & CAN_ID

    def is_producer(self) -> bool:
        """1005h: bit 30 set."""
        return bool(self._od.number(COB_ID) & BIT_30)

    def period_ns(self) -> int:
        """1006h, in us; 0 = nothing is produced."""
        return self._od.number(CYCLE_PERIOD) * US

    def overflow(self) -> int:
        """1019h: the greatest counter; 0 = SYNC without counter."""
        return self._od.number(COUNTER_OVERFLOW)

    def fits(self, data: bytes) -> bool:
        """This is the length that a SYNC has: one byte with counter, else none."""
        return len(data) == (1 if self.overflow() else 0)

    def first_counter(self) -> int:
        """Counter of the first SYNC after the production began."""
        return 1

    def next_counter(self) -> int:
        """Counter after this one: 1 follows the greatest."""
        return self._counter % self.overflow() + 1

    def next_due(self, due: int) -> int:
        """When the SYNC follows that was due at `due`."""
        return due + self.period_ns()

    # What it does.

    def _begin(self, now: int) -> None:
        """A producer sends its first SYNC one period from now."""
        self._counter = self.first_counter()
        wanted = self.running and self.may_act() and self.is_producer() and self.period_ns()
        self._due_at = self.next_due(now) if wanted else None

    def _produce(self, due: int) -> Frames:
        counter: int | None = None
        if self.overflow():
            counter = self._counter
            self._counter = self.next_counter()
        data = b"" if counter is None else bytes((counter,))
        return (data_frame(self.can_id(), data), *self._sync(counter, due))

    def _sync(self, counter: int | None, now: int) -> Frames:
        self.synced_at = now
        frames = NOTHING
        for listener in self._listeners:
            frames = (*frames, *listener(counter, now))
        return frames

    # Its objects.

    def _guard_cob_id(self, sub: int, data: bytes) -> None:  # noqa: ARG002  a VAR
        """Bit 31 does not matter; a producer keeps its identifier."""
        old, new = self._od.number(COB_ID), int.from_bytes(data, "little")
        check_cob_id(new, BIT_31 | (BIT_30 if self._produces else 0))
        if old & new & BIT_30:
            check_same_can_id(old, new)

    def _guard_overflow(self, sub: int, data: bytes) -> None:  # noqa: ARG002  a VAR
        """0 or 2 to 240, and only while there is no communication cycle."""
        greatest = int.from_bytes(data, "little")
        if greatest == 1 or greatest > 240:
            raise SdoAbort(AbortCode.VALUE)
        if self._od.number(CYCLE_PERIOD):
            raise SdoAbort(AbortCode.DEVICE_STATE)

    def _written(self, sub: int, now: int) -> None:  # noqa: ARG002  each is a VAR
        """A producer begins anew."""
        self._begin(now)
