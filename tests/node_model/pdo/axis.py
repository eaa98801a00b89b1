"""A small axis with two RPDOs and three TPDOs, for tests of PDOs."""

from __future__ import annotations

from node_model.frame import Frame
from node_model.nmt import NmtState
from node_model.node import US
from node_model.od import Access, DataType, Entry, ObjectDictionary
from node_model.pdo import PdoService
from node_model.sync import SyncService
from tests.node_model.services import Reports, entry, feed, u8, u16, u32

SYNC = Frame(0x080)
CONTROL, STATUS, SET_POINT, ACTUAL = 0x6040, 0x6041, 0x607A, 0x6064
OFF = 1 << 31
NO_RTR = 1 << 30


def objects() -> list[Entry]:
    """What an axis carries in PDOs, and what it does not."""
    return [
        entry(CONTROL, 0, DataType.UNSIGNED16, access=Access.RWW, pdo=True),
        entry(STATUS, 0, DataType.UNSIGNED16, access=Access.RO, pdo=True),
        entry(SET_POINT, 0, DataType.INTEGER32, access=Access.RWW, pdo=True),
        entry(ACTUAL, 0, DataType.INTEGER32, access=Access.RO, pdo=True),
        entry(0x2000, 1, DataType.BOOLEAN, access=Access.RW, pdo=True),
        entry(0x2000, 2, DataType.UNSIGNED24, access=Access.RW, pdo=True),
        entry(0x2000, 3, DataType.UNSIGNED64, access=Access.RW, pdo=True),
        entry(0x2000, 4, DataType.UNSIGNED8, access=Access.WO, pdo=True),
        entry(0x2000, 5, DataType.UNSIGNED8, access=Access.CONST, pdo=True),
        entry(0x2000, 6, DataType.UNSIGNED8, access=Access.RW),
        entry(0x2000, 8, DataType.UNSIGNED8, access=Access.RWR, pdo=True),
        Entry(0x2000, 7, "text", DataType.VISIBLE_STRING, Access.RW, b"axis", b"axis", pdo=True),
    ]


def mapped(index: int, *values: int, room: int = 4) -> list[Entry]:
    """A mapping object."""
    padded = [*values, *([0] * room)][:room]
    return [u8(index, 0, len(values)), *(u32(index, n + 1, v) for n, v in enumerate(padded))]


def parameters(index: int, cob_id: int, kind: int) -> list[Entry]:
    """A communication parameter object."""
    return [
        u8(index, 0, 6, Access.CONST),
        u32(index, 1, cob_id),
        u8(index, 2, kind),
        u16(index, 3),
        u16(index, 5),
        u8(index, 6),
    ]


class Axis:
    """An axis that started at 0 and entered a state then.

    RPDO 1 carries control and set-point (six bytes), RPDO 2 is off; TPDO 1 carries status
    and actual value, TPDO 2 the actual value, TPDO 3 is off.
    """

    def __init__(
        self,
        rpdo: int = 255,
        tpdo: int = 255,
        second: int = 255,
        overflow: int = 0,
        state: NmtState = NmtState.OPERATIONAL,
        turnaround_ns: int = 0,
    ) -> None:
        self.od = ObjectDictionary(
            [
                u32(0x1005, 0, 0x80),
                u32(0x1006),
                u32(0x1007),
                u8(0x1019, 0, overflow),
                *objects(),
                *parameters(0x1400, 0x205, rpdo),
                *mapped(0x1600, 0x60400010, 0x607A0020),
                *parameters(0x1401, OFF | 0x305, 255),
                *mapped(0x1601),
                *parameters(0x1800, 0x185, tpdo),
                *mapped(0x1A00, 0x60410010, 0x60640020),
                *parameters(0x1801, NO_RTR | 0x285, second),
                *mapped(0x1A01, 0x60640020),
                *parameters(0x1802, OFF, 255),
                *mapped(0x1A02),
            ]
        )
        self.reports = Reports()
        self.applied: list[tuple[int, int, int]] = []
        self.sync = SyncService(self.od, self.reports, US)
        self.pdos = PdoService(
            self.od, self.reports, self.sync, self.hear, turnaround_ns=turnaround_ns
        )
        self.sync.start(0)
        self.pdos.start(0)
        self.first = self.enter(state, 0)

    def hear(self, index: int, sub: int, now: int) -> None:
        """The application: it hears what RPDOs bring, and echoes the set-point."""
        self.applied.append((index, sub, now))
        if index == SET_POINT:
            self.od.put(ACTUAL, 0, self.od.get(SET_POINT))
            self.pdos.written(ACTUAL, 0, now)

    def enter(self, state: NmtState, now: int) -> list[str]:
        """What it sends on a change of state."""
        frames = (*self.sync.enter(state, now), *self.pdos.enter(state, now))
        return [str(frame) for frame in frames]

    def put(self, index: int, value: int, now: int) -> None:
        """The application writes one of its objects."""
        self.od.put_number(index, 0, value)
        self.pdos.written(index, 0, now)

    def tick(self, now: int, counter: int | None = None) -> list[str]:
        """What a SYNC makes it send at once."""
        return feed(self.sync, now, Frame(0x80, b"" if counter is None else bytes((counter,))))

    def bring(self, text: str, now: int) -> list[str]:
        """What it answers to data for RPDO 1."""
        return feed(self.pdos, now, Frame(0x205, bytes.fromhex(text)))
