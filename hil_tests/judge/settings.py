"""What a tester has set in the device, as the bus tells: SDO downloads and their answers.

The heartbeat period, and identifiers under which the device may now speak, change while it
is watched. The judge needs nobody to tell it: request and answer stand in the record.
What a communication error leads to is known so, too. (CiA 301 4.2.0, 7.2.4.3; the objects
1005h, 1012h, 1014h, 1015h, 1017h, 1029h, 1201h.. and 1800h.. .)
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from hil_tests.clock import Interval
from hil_tests.judge.causal import Seen
from hil_tests.judge.cobs import SDO_ANSWER, SDO_REQUEST

_EXPEDITED = 0x22
_DOWNLOAD = 0x20
_CONFIRMED = 0x60
_COMMAND = 0xE0
_SIZED = 0x01
_INVALID = 1 << 31
_PRODUCES = 1 << 30
_IDENTIFIER = 0x7FF
_PRODUCER_TIME = b"\x17\x10\x00"
_TPDO = range(0x1800, 0x1A00)
_MORE_SERVERS = range(0x1201, 0x1280)


class Role(Enum):
    """What a device sends under an identifier that it was given."""

    PDO = "PDO"
    EMCY = "emergency message"
    SYNC = "SYNC"
    TIME = "TIME"
    SDO = "SDO answer"


@dataclass(frozen=True, slots=True)
class HeartbeatSet:
    """1017h was written.

    Args:
        period_ms: what to; None = with a value that the record does not show.
        when: from the end of the request to the answer.
    """

    period_ms: int | None
    when: Interval


@dataclass(frozen=True, slots=True)
class IdentifierSet:
    """The device may speak under this identifier from now on."""

    can_id: int
    role: Role


@dataclass(frozen=True, slots=True)
class BehaviourSet:
    """1029h:01 was written; None = with a value that the record does not show."""

    value: int | None


@dataclass(frozen=True, slots=True)
class EmergenciesHeld:
    """Emergency messages are switched off, or wait for an inhibit time."""


Setting = HeartbeatSet | IdentifierSet | BehaviourSet | EmergenciesHeld


class SdoListener:
    """Listens to what the tester writes over the default SDO server of one node.

    Args:
        node_id: 1..127.
    """

    def __init__(self, node_id: int) -> None:
        self._request_id = SDO_REQUEST + node_id
        self._answer_id = SDO_ANSWER + node_id
        self._asked: tuple[bytes, int] | None = None

    def asked(self, seen: Seen) -> None:
        """A frame of the tester."""
        frame = seen.frame
        if frame.can_id != self._request_id or frame.extended or len(frame.data) < 8:
            return
        is_download = frame.data[0] & _COMMAND == _DOWNLOAD
        self._asked = (frame.data, seen.at) if is_download else None

    @property
    def waits(self) -> bool:
        """Something was written, and the device has not answered yet."""
        return self._asked is not None

    @property
    def beat_asked(self) -> bool:
        """A heartbeat period was written, and the device has not answered yet."""
        return self._asked is not None and self._asked[0][1:4] == _PRODUCER_TIME

    def answered(self, seen: Seen) -> Setting | None:
        """A frame of the device; what was set by it."""
        frame, asked = seen.frame, self._asked
        if frame.can_id != self._answer_id or asked is None or len(frame.data) < 4:
            return None
        self._asked = None
        request, asked_at = asked
        if frame.data[0] != _CONFIRMED or frame.data[1:4] != request[1:4]:
            return None
        when = Interval(asked_at, max(asked_at, seen.wanted.latest))
        return _setting(request, when)


def _setting(request: bytes, when: Interval) -> Setting | None:
    """What a download that was confirmed means."""
    index, sub = request[1] | request[2] << 8, request[3]
    expedited = request[0] & _EXPEDITED == _EXPEDITED
    spare = (request[0] >> 2) & 3 if request[0] & _SIZED else 0
    value = int.from_bytes(request[4 : 8 - spare], "little")
    if (index, sub) == (0x1017, 0):
        return HeartbeatSet(value if expedited else None, when)
    if (index, sub) == (0x1029, 1):
        return BehaviourSet(value if expedited else None)
    held = {(0x1014, 0): value & _INVALID, (0x1015, 0): value}
    if held.get((index, sub)):
        return EmergenciesHeld()
    role = role_of(index, sub, value)
    if role is None or not expedited or not value & _IDENTIFIER:
        return None
    return IdentifierSet(value & _IDENTIFIER, role)


def role_of(index: int, sub: int, value: int) -> Role | None:
    """What a device sends under the identifier in an object with this value; None = nothing."""
    if index in _TPDO and sub == 1 and not value & _INVALID:
        return Role.PDO
    if index in _MORE_SERVERS and sub == 2 and not value & _INVALID:
        return Role.SDO
    if (index, sub) == (0x1014, 0) and not value & _INVALID:
        return Role.EMCY
    producers = {(0x1005, 0): Role.SYNC, (0x1012, 0): Role.TIME}
    return producers.get((index, sub)) if value & _PRODUCES else None
