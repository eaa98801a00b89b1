"""Emergency object (CiA 301 4.2.0, 7.2.7): its frame, and the producer with its error handling.

Laws of the producer: each error is told once, when it occurs; the error register 1001h has
the bits of every error that there is; 1003h holds the newest errors, newest first. Nothing is
sent in stopped: it waits, in order, until the device leaves that state. The inhibit time
delays and never reorders. Only what services and the application report is an error: an SDO
access that is refused never is.

Wiring: first of a device's services, and the `ErrorHandler` of the others. `start` forgets
all errors: who still has one reports it again after it. `change` is called with the NMT
state that 1029h wants after a communication error; the device changes to it when it next
advances, or at once.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from itertools import takewhile

from node_model.cob_id import BIT_31, CAN_ID, check_cob_id, check_same_can_id
from node_model.frame import Frame, data_frame
from node_model.nmt import NmtState
from node_model.node import NOTHING, US, Frames
from node_model.od import AbortCode, ObjectDictionary, SdoAbort
from node_model.service import Fault, QuietService

EMCY_BASE = 0x080
NO_ERROR = 0x0000
HARDWARE_ERROR = 0x5000
GENERIC_ERROR = 0x01
"""Bit 0 of the error register 1001h: set whenever there is any error."""
COMMUNICATION_ERROR = 0x10
"""Bit 4 of the error register 1001h."""

ERROR_REGISTER = 0x1001
ERROR_FIELD = 0x1003
COB_ID = 0x1014
INHIBIT_TIME = 0x1015
BEHAVIOUR = 0x1029

StateRequest = Callable[[NmtState, int], None]
"""Called with the NMT state that the device shall enter by itself, and the instant."""

MAY_SEND = frozenset({NmtState.PRE_OPERATIONAL, NmtState.OPERATIONAL})


def emcy_frame(node_id: int, code: int, register: int, manufacturer: bytes = bytes(5)) -> Frame:
    """EMCY of a node: error code little-endian, error register, five bytes of the maker."""
    return data_frame(EMCY_BASE + node_id, emcy_data(code, register, manufacturer))


def emcy_data(code: int, register: int, manufacturer: bytes) -> bytes:
    """The eight bytes of an EMCY; missing bytes of the maker are zero."""
    return code.to_bytes(2, "little") + bytes((register,)) + manufacturer.ljust(5, b"\0")


def _no_change(state: NmtState, now: int) -> None:
    """A device that does not follow 1029h."""


class EmergencyProducer(QuietService):
    """Error handling and EMCY producer of a device.

    Args:
        od: its 1001h, 1003h, 1014h, 1015h and 1029h, as far as they are there.
        node_id: for the default COB-ID; may be changed before a start.
        change: asked to change the NMT state after a communication error.
    """

    alone = True
    timed_by = frozenset((COB_ID, INHIBIT_TIME))

    def __init__(
        self, od: ObjectDictionary, node_id: int, change: StateRequest = _no_change
    ) -> None:
        self._od = od
        self.node_id = node_id
        self._change = change
        self.errors: dict[str, Fault] = {}
        self._queue: deque[bytes] = deque()
        self._since = 0
        self._sent_at: int | None = None
        row = takewhile(lambda sub: od.has(ERROR_FIELD, sub), range(255))
        self._depth = max(len(list(row)) - 1, 0)
        od.guard(ERROR_FIELD, self._guard_field)
        od.guard_reading(ERROR_FIELD, self._guard_field_reading)
        od.guard(COB_ID, self._guard_cob_id)
        od.observe(COB_ID, self._cob_id_written)
        od.guard(BEHAVIOUR, self._guard_behaviour)

    # What is reported to it.

    def occur(self, cause: str, fault: Fault, now: int) -> Frames:
        """`cause` now has this fault; one that it has already is not told again."""
        if self.is_known(cause, fault):
            return NOTHING
        self.errors[cause] = fault
        register = self._show_register()
        self._push(self.field_entry(fault, register))
        self._tell(emcy_data(fault.code, register, fault.manufacturer), now)
        frames = self.advance(now)
        self._react(fault, now)
        return frames

    def heal(self, cause: str, now: int) -> Frames:
        """`cause` is gone; one that was not there is no news."""
        if self.errors.pop(cause, None) is None:
            return NOTHING
        register = self._show_register()
        if self.tells_end(register):
            self._tell(emcy_data(NO_ERROR, register, b""), now)
        return self.advance(now)

    # The verbs of a service.

    def start(self, now: int) -> Frames:
        """No errors, as after power-on."""
        self.errors.clear()
        self._queue.clear()
        self._sent_at = None
        self._show_register()
        return super().start(now)

    def enter(self, state: NmtState, now: int) -> Frames:
        """What waited in stopped is sent."""
        super().enter(state, now)
        self._since = now
        return self.advance(now)

    def advance(self, now: int) -> Frames:
        """The emergencies whose inhibit time is over."""
        frames = NOTHING
        while (due := self.deadline()) is not None and due <= now:
            self._sent_at = due
            frames = (*frames, data_frame(self.can_id(), self._queue.popleft()))
        return frames

    def deadline(self) -> int | None:
        """When the oldest waiting emergency may be sent."""
        if not self._queue or not self.may_send():
            return None
        free_at = self._since if self._sent_at is None else self._sent_at + self.inhibit_ns()
        return max(self._since, free_at)

    # What decides.

    def is_known(self, cause: str, fault: Fault) -> bool:
        """This very error was told already."""
        return self.errors.get(cause) == fault

    def register(self) -> int:
        """Error register: the bits of every error, and bit 0 with any of them."""
        bits = 0
        for fault in self.errors.values():
            bits |= fault.register | GENERIC_ERROR
        return bits

    def field_entry(self, fault: Fault, register: int) -> int:
        """Entry of 1003h: error code, error register, first byte of the maker."""
        maker = fault.manufacturer[0] if fault.manufacturer else 0
        return fault.code | register << 16 | maker << 24

    def tells_end(self, register: int) -> bool:
        """Whether the end of an error is told: with the last one (7.2.7.1)."""
        return register == 0

    def may_send(self) -> bool:
        """In pre-operational and operational (CiA 301, 7.3.2.2.5)."""
        return self.state in MAY_SEND

    def is_valid(self) -> bool:
        """1014h: bit 31 clear."""
        return not self._cob_id() & BIT_31

    def can_id(self) -> int:
        """Identifier of its frames."""
        return self._cob_id() & CAN_ID

    def inhibit_ns(self) -> int:
        """1015h, in units of 100 us: least time between two emergencies."""
        return self._od.number(INHIBIT_TIME) * 100 * US

    def reaction(self) -> NmtState | None:
        """1029h:01, what a communication error does to the NMT state (7.5.2.32)."""
        behaviour = self._od.number(BEHAVIOUR, 1)
        if behaviour == 0:
            return NmtState.PRE_OPERATIONAL if self.state is NmtState.OPERATIONAL else None
        return NmtState.STOPPED if behaviour == 2 and self.state in MAY_SEND else None

    # What it does.

    def _cob_id(self) -> int:
        return self._od.number(COB_ID, 0, EMCY_BASE + self.node_id)

    def _show_register(self) -> int:
        register = self.register()
        if self._od.has(ERROR_REGISTER):
            self._od.put(ERROR_REGISTER, 0, bytes((register,)))
        return register

    def _push(self, entry: int) -> None:
        """The newest error to 1003h:01; the others move down, the oldest falls out."""
        od, depth = self._od, self._depth
        if not depth:
            return
        for sub in range(depth, 1, -1):
            od.put(ERROR_FIELD, sub, od.get(ERROR_FIELD, sub - 1))
        od.put(ERROR_FIELD, 1, entry.to_bytes(4, "little"))
        od.put(ERROR_FIELD, 0, bytes((min(od.number(ERROR_FIELD) + 1, depth),)))

    def _tell(self, data: bytes, now: int) -> None:
        if not self.is_valid():
            return
        if not self._queue:
            self._since = now
        self._queue.append(data)

    def _react(self, fault: Fault, now: int) -> None:
        target = self.reaction() if fault.communication else None
        if target is not None:
            self._change(target, now)

    # Its objects.

    def _guard_field(self, sub: int, data: bytes) -> None:  # noqa: ARG002  only :00 is writable
        """Only 0 may be written: it clears the list."""
        if any(data):
            raise SdoAbort(AbortCode.VALUE)

    def _guard_field_reading(self, sub: int) -> None:
        """An entry that holds no error cannot be read."""
        if sub > self._od.number(ERROR_FIELD):
            raise SdoAbort(AbortCode.NO_DATA)

    def _guard_cob_id(self, sub: int, data: bytes) -> None:  # noqa: ARG002  a VAR
        old, new = self._cob_id(), int.from_bytes(data, "little")
        check_cob_id(new, BIT_31, idle=bool(new & BIT_31))
        if not (old | new) & BIT_31:
            check_same_can_id(old, new)

    def _cob_id_written(self, sub: int, now: int) -> None:  # noqa: ARG002  a VAR
        """What waits is not sent once the service is switched off."""
        if not self.is_valid():
            self._queue.clear()

    def _guard_behaviour(self, sub: int, data: bytes) -> None:  # noqa: ARG002  all alike
        """0 pre-operational, 1 no change, 2 stopped."""
        if int.from_bytes(data, "little") > 2:
            raise SdoAbort(AbortCode.VALUE)
