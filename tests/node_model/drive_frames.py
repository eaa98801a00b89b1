"""What a script says to a drive: frames, errors and power, each by a short word."""

from __future__ import annotations

from node_model.frame import Frame
from node_model.node import MS
from tests.node_model.driving import Step

ID = 5
ON, OFF = True, False
Script = tuple[Step, ...]
What = Frame | bool | frozenset[str] | None

IDENTITY = (0x7E57, 0x402, 0x0001_0000, 0x00C0_FFEE)


def frame(can_id: int, *data: int) -> Frame:
    """A data frame."""
    return Frame(can_id, bytes(data))


def remote(can_id: int, dlc: int = 0) -> Frame:
    """A remote frame."""
    return Frame(can_id, remote=True, dlc=dlc)


def nmt(command: int, node_id: int = ID) -> Frame:
    """An NMT command."""
    return frame(0, command, node_id)


def sdo(*data: int) -> Frame:
    """An SDO request."""
    return Frame(0x600 + ID, bytes(data).ljust(8, b"\0"))


def read(index: int, sub: int = 0) -> Frame:
    """Expedited or segmented upload."""
    return sdo(0x40, index & 0xFF, index >> 8, sub)


def write(index: int, sub: int, value: int, size: int) -> Frame:
    """Expedited download."""
    number = value.to_bytes(size, "little", signed=value < 0)
    return sdo(0x23 | 4 - size << 2, index & 0xFF, index >> 8, sub, *number)


def lss(*data: int) -> Frame:
    """An LSS request."""
    return Frame(0x7E5, bytes(data).ljust(8, b"\0"))


def lss_number(command: int, number: int, *rest: int) -> Frame:
    """An LSS request with a number."""
    return lss(command, *number.to_bytes(4, "little"), *rest)


def errors(*names: str) -> frozenset[str]:
    """Exactly these errors exist."""
    return frozenset(names)


def script(*whats: What, wait_ns: int = 3 * MS) -> Script:
    """Power-on, time to boot, then one thing after the other."""
    start = (Step(0, ON), Step(60 * MS, None))
    return (*start, *(Step(wait_ns, what) for what in whats), Step(130 * MS, None))


SYNC = frame(0x080)
OPERATIONAL = nmt(1)
SAVE, LOAD = 0x6576_6173, 0x6461_6F6C


BEAT = write(0x1017, 0, 10, 2)
"""So that each change of state shows."""
