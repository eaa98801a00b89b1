"""Error frames of SocketCAN as bus events (<linux/can/error.h>)."""

from __future__ import annotations

from hil_tests.trace import BusEvent, EventKind

_CLASSES = {
    0x001: "transmit time-out",
    0x002: "lost arbitration",
    0x004: "controller",
    0x008: "protocol violation",
    0x010: "transceiver",
    0x020: "no acknowledge",
    0x040: "bus off",
    0x080: "bus error",
    0x100: "controller restarted",
    0x200: "error counters",
}
_CONTROLLER = {
    0x01: "receive buffer overflow",
    0x02: "transmit buffer overflow",
    0x04: "receive error warning",
    0x08: "transmit error warning",
    0x10: "receive error passive",
    0x20: "transmit error passive",
    0x40: "error active again",
}
_BUS_OFF = 0x040
_CONTROLLER_CLASS = 0x004
_RX_OVERFLOW = 0x01


def error_event(word: int, data: bytes, at: int) -> BusEvent:
    """What an error frame tells.

    Args:
        word: its identifier without the flags: the error classes.
        data: its eight bytes; byte 1 details the controller's state.
        at: its stamp in ns.
    """
    names = [name for bit, name in _CLASSES.items() if word & bit]
    detail = data[1] if word & _CONTROLLER_CLASS else 0
    names += [name for bit, name in _CONTROLLER.items() if detail & bit]
    text = f"{', '.join(names) or 'unknown'} (class {word:#x}, data {data.hex()})"
    if word & _BUS_OFF:
        return BusEvent(EventKind.BUS_OFF, at, text)
    if detail & _RX_OVERFLOW:
        return BusEvent(EventKind.OVERFLOW, at, text)
    return BusEvent(EventKind.ERROR, at, text)
