"""The two parameter objects of a PDO: what a client may write into them, and when.

Laws: a PDO is changed in five steps: switched off by bit 31, number of entries 0, entries,
number of entries, switched on (CiA 301 4.2.0, 7.5.2.36 and .38). While it is valid neither
its identifier nor its mapping, inhibit time or SYNC start value changes. A refused step
leaves everything as it was.
"""

from __future__ import annotations

from collections.abc import Callable

from node_model.cob_id import BIT_30, BIT_31, CAN_ID, check_cob_id, check_same_can_id
from node_model.node import MS, US
from node_model.od import AbortCode, ObjectDictionary, SdoAbort
from node_model.pdo.mapping import Direction, Mapping, field_of, mapping_of

COB_ID, TYPE, INHIBIT, TIMER, START = 1, 2, 3, 5, 6
"""Sub-indices of a communication parameter object."""
LAST_SYNCHRONOUS = 240
SYNC_RTR, RTR, EVENT_OF_MAKER, EVENT_OF_PROFILE = 252, 253, 254, 255
EVENTS = frozenset({EVENT_OF_MAKER, EVENT_OF_PROFILE})
TYPES = {
    Direction.RECEIVE: frozenset(range(LAST_SYNCHRONOUS + 1)) | EVENTS,
    Direction.TRANSMIT: frozenset(range(LAST_SYNCHRONOUS + 1)) | EVENTS | {SYNC_RTR, RTR},
}
"""Transmission types that a device can have (7.5.2.35 and .37)."""

Changed = Callable[[int, int], None]
"""Called with a sub-index of the communication parameter, and the instant."""


class PdoParameters:
    """Reads and guards the objects of one PDO.

    Args:
        od: has both objects.
        index: of the communication parameter; the mapping stands 200h above.
        direction: which way the PDO goes.
        changed: told after a communication parameter was written.
    """

    def __init__(
        self, od: ObjectDictionary, index: int, direction: Direction, changed: Changed
    ) -> None:
        self._od = od
        self.index = index
        self.map_index = index + 0x200
        self.direction = direction
        od.guard(index, self._guard)
        od.observe(index, changed)
        od.guard(self.map_index, self._guard_mapping)

    # What they say.

    def cob_id(self) -> int:
        """COB-ID with its flags; an object that has none is off."""
        return self._od.number(self.index, COB_ID, BIT_31)

    def is_valid(self) -> bool:
        """Bit 31 clear: the PDO exists."""
        return not self.cob_id() & BIT_31

    def allows_rtr(self) -> bool:
        """Bit 30 clear: remote frames are answered."""
        return not self.cob_id() & BIT_30

    def can_id(self) -> int:
        """Identifier of its frames."""
        return self.cob_id() & CAN_ID

    def type(self) -> int:
        """Transmission type."""
        return self._od.number(self.index, TYPE, EVENT_OF_PROFILE)

    def inhibit_ns(self) -> int:
        """Least time between two event-driven PDOs; the object counts in 100 us."""
        return self._od.number(self.index, INHIBIT) * 100 * US

    def timer_ns(self) -> int:
        """Event timer of a TPDO, deadline of an RPDO; the object counts in ms."""
        return self._od.number(self.index, TIMER) * MS

    def start_value(self) -> int:
        """Counter of the SYNC that a synchronous TPDO begins with; 0 = any."""
        return self._od.number(self.index, START)

    def mapping(self) -> Mapping:
        """What it carries; nothing where the objects describe no mapping."""
        count = self._od.number(self.map_index)
        try:
            return mapping_of(self._od, self.map_index, count, self.direction)
        except SdoAbort:
            return Mapping()

    # What a client may write.

    def _guard(self, sub: int, data: bytes) -> None:
        check = {
            COB_ID: self.check_cob_id,
            TYPE: self.check_type,
            INHIBIT: self.check_inhibit,
            START: self.check_start,
        }.get(sub)
        if check:
            check(int.from_bytes(data, "little"))

    def check_cob_id(self, new: int) -> None:
        """Another identifier only while the PDO is off.

        Raises:
            SdoAbort: 0609 0030h.
        """
        check_cob_id(new, BIT_31 | BIT_30, idle=bool(new & BIT_31))
        if self.is_valid() and not new & BIT_31:
            check_same_can_id(self.cob_id(), new)

    def check_type(self, new: int) -> None:
        """No reserved transmission type.

        Raises:
            SdoAbort: 0609 0030h.
        """
        if new not in TYPES[self.direction]:
            raise SdoAbort(AbortCode.VALUE)

    def check_inhibit(self, new: int) -> None:
        """Another inhibit time only while the PDO is off.

        Raises:
            SdoAbort: 0609 0030h.
        """
        if self.is_valid() and new != self._od.number(self.index, INHIBIT):
            raise SdoAbort(AbortCode.VALUE)

    def check_start(self, new: int) -> None:
        """A counter of 0 to 240, and only while the PDO is off.

        Raises:
            SdoAbort: 0609 0030h.
        """
        if new > LAST_SYNCHRONOUS or (self.is_valid() and new != self.start_value()):
            raise SdoAbort(AbortCode.VALUE)

    def _guard_mapping(self, sub: int, data: bytes) -> None:
        value = int.from_bytes(data, "little")
        if self.is_valid():
            raise SdoAbort(AbortCode.ACCESS)
        if sub == 0:
            self.check_count(value)
        else:
            self.check_entry(value)

    def check_count(self, count: int) -> None:
        """The entries that this number takes in make a mapping.

        Raises:
            SdoAbort: see `mapping_of`.
        """
        mapping_of(self._od, self.map_index, count, self.direction)

    def check_entry(self, value: int) -> None:
        """An entry is written while there are none; 0 is no entry.

        Raises:
            SdoAbort: 0601 0000h, the number of entries is not 0; or see `field_of`.
        """
        if self._od.number(self.map_index):
            raise SdoAbort(AbortCode.ACCESS)
        if value:
            field_of(self._od, value, self.direction)
