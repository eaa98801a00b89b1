"""The tester's own reading of the frames that matter (CiA 301 4.2.0; keypad source)."""

from __future__ import annotations

from enum import Enum, IntEnum
from functools import cache

from node_model.frame import Frame, data_frame

NMT = 0x000
SYNC = 0x080
EMCY = 0x080
TIME = 0x100
KEYS = 0x180
LED_STEADY = 0x200
LED_BLINK = 0x300
ECHO = 0x3F8
COMMISSION = 0x4F8
SDO_ANSWER = 0x580
SDO_REQUEST = 0x600
ERROR_CONTROL = 0x700
LSS_ANSWER = 0x7E4

TPDOS = (0x180, 0x280, 0x380, 0x480)
RPDOS = (0x200, 0x300, 0x400, 0x500)
"""Transmit and receive PDOs of the pre-defined connection set (CiA 301 4.2.0, 7.3.3)."""


class Nmt(IntEnum):
    """NMT command specifiers (CiA 301, NMT node control)."""

    START = 0x01
    STOP = 0x02
    PRE_OPERATIONAL = 0x80
    RESET_NODE = 0x81
    RESET_COMMUNICATION = 0x82


class State(Enum):
    """Where a device can be; the value of the first three is what its heartbeat shows."""

    STOPPED = 0x04
    OPERATIONAL = 0x05
    PRE_OPERATIONAL = 0x7F
    STARTING = 0x100
    OFF = 0x101
    COMMISSIONING = 0x102

    # Members are singletons; hashing their names, as Enum does, costs more than the sets save.
    __hash__ = object.__hash__

    def __str__(self) -> str:
        return self.name.lower().replace("_", "-")


RESETS = (Nmt.RESET_NODE, Nmt.RESET_COMMUNICATION)
"""Commands after which the device boots anew."""

HARDWARE = 0x50
"""High byte of the EMCY codes that a keypad may send (NMT-02)."""

LEADS_TO = {
    Nmt.START: State.OPERATIONAL,
    Nmt.STOP: State.STOPPED,
    Nmt.PRE_OPERATIONAL: State.PRE_OPERATIONAL,
    Nmt.RESET_NODE: State.STARTING,
    Nmt.RESET_COMMUNICATION: State.STARTING,
}

_COMMANDS = {command.value: command for command in Nmt}

SHOWN = {state.value: state for state in State if state.value < 0x100}
"""Heartbeat byte -> state."""


def nmt_frame(command: int, node_id: int) -> Frame:
    """The NMT frame that gives `command` to a node; 0 = to all."""
    return data_frame(NMT, bytes((command, node_id)))


def nmt_for(frame: Frame, node_id: int) -> Nmt | None:
    """The command that a regular two-byte NMT frame gives to this node, or None."""
    if frame.can_id or frame.extended or frame.remote or len(frame.data) != 2:
        return None
    if frame.data[1] not in {0, node_id}:
        return None
    return _COMMANDS.get(frame.data[0])


def long_nmt_for(frame: Frame, node_id: int) -> Nmt | None:
    """The command that a longer NMT frame may give to this node; nodes differ (NMT-21)."""
    if frame.extended or frame.remote or len(frame.data) <= 2:
        return None
    return nmt_for(Frame(frame.can_id, frame.data[:2]), node_id)


@cache
def device_ids(node_id: int | None) -> frozenset[int]:
    """Every identifier under which a keypad with that node id may speak."""
    fixed = {ECHO}
    if node_id is None:
        return frozenset(fixed)
    bases = (EMCY, KEYS, SDO_ANSWER, ERROR_CONTROL)
    return frozenset(fixed | {base + node_id for base in bases})


def parameter_bytes(
    node_id: int,
    bit_rate_code: int,
    heartbeat_ms: int,
    sync_time: int,
    debounce: int,
) -> bytes:
    """The six bytes of 4F8h and 3F8h: heartbeat high byte first (keypad source)."""
    high, low = divmod(heartbeat_ms, 256)
    return bytes((node_id, bit_rate_code, high, low, sync_time, debounce))
