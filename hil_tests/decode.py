"""A frame in one line of words, for messages that a person reads.

The tester's own reading of CiA 301 (4.2.0), CiA 305 and the keypad's source; nothing is
judged by it. A frame that breaks its layout is shown with what is odd about it, never hidden.
"""

from __future__ import annotations

from collections.abc import Callable

from hil_tests.clock import S
from hil_tests.decode_facts import (
    ERROR_CONTROL,
    LSS_ANSWER,
    LSS_REQUEST,
    SDO_ANSWER,
    SDO_REQUEST,
    UNKNOWN,
    Facts,
    facts,
)
from hil_tests.decode_keypad import decode_keypad
from hil_tests.decode_lss import show_lss
from hil_tests.decode_sdo import count_bytes, show_bytes, show_sdo
from hil_tests.trace import Trace
from node_model.frame import Frame

_COMMANDS = {
    0x01: "start",
    0x02: "stop",
    0x80: "enter pre-operational",
    0x81: "reset node",
    0x82: "reset communication",
}
"""NMT node control, CiA 301, 7.2.8.3.1."""

_STATES = {0x00: "initialising", 0x04: "stopped", 0x05: "operational", 0x7F: "pre-operational"}
"""NMT states as error control tells them, CiA 301, 7.2.8.3.2."""

_EMCY = {
    0x8110: "CAN overrun",
    0x8120: "CAN error passive",
    0x8130: "life guard or heartbeat error",
    0x8140: "recovered from bus-off",
    0x8150: "CAN-ID collision",
    0x8210: "PDO not processed: too short",
    0x8220: "PDO too long",
    0x8230: "DAM MPDO: no such destination",
    0x8240: "SYNC of unexpected length",
    0x8250: "RPDO time-out",
    0x00: "no error",
    0x10: "generic",
    0x20: "current",
    0x21: "current, input side",
    0x22: "current, inside",
    0x23: "current, output side",
    0x30: "voltage",
    0x31: "mains voltage",
    0x32: "voltage inside",
    0x33: "output voltage",
    0x40: "temperature",
    0x41: "ambient temperature",
    0x42: "device temperature",
    0x50: "hardware",
    0x60: "software",
    0x61: "internal software",
    0x62: "user software",
    0x63: "data set",
    0x70: "additional modules",
    0x80: "monitoring",
    0x81: "communication",
    0x82: "protocol",
    0x90: "external",
    0xF0: "additional functions",
    0xFF: "device specific",
}
"""Error codes, or their high byte where the low one is free (CiA 301, table 26)."""


def decode(frame: Frame, node_id: int | None, kind: str = "keypad") -> str:
    """What a frame means.

    Args:
        frame: any frame.
        node_id: the device under test; None = not known, any node may be it.
        kind: of the device; a "keypad" gives meaning to some identifiers, for every other
            word they are PDOs.

    Returns:
        One line without line breaks; raw bytes in hex where nothing better is known.
    """
    if frame.extended:
        return f"extended identifier{_remote(frame)}: {_raw(frame)}"
    known = decode_keypad(frame, node_id) if kind == "keypad" else ""
    if known:
        return known
    seen = facts(frame)
    if seen.function == UNKNOWN or (frame.remote and seen.node is None):
        return f"unknown{_remote(frame)}: {_raw(frame)}"
    if frame.remote:
        name = _ASKED_FOR.get(seen.function, seen.function)
        return f"remote request to node {seen.node} for {name}"
    return _WORDS.get(seen.function, _pdo)(seen)


def show_frames(
    trace: Trace,
    start: int,
    stop: int,
    node_id: int | None,
    origin_at: int,
    *,
    most: int = 40,
    kind: str = "keypad",
) -> list[str]:
    """Frames `start` up to, not including, `stop`, one a line, in columns.

    Args:
        trace: where they are.
        start: index of the first.
        stop: index after the last; past the end means the end.
        node_id: the device under test.
        origin_at: the instant that is shown as +0.
        most: with more frames, those in the middle are left out and counted.
        kind: of the device, as in `decode`.
    """
    indices = range(*slice(start, stop).indices(len(trace)))
    left_out = len(indices) - most
    head, tail = indices, indices[:0]
    if left_out > 0:
        head, tail = indices[: most // 2], indices[len(indices) - (most - most // 2) :]
    rows = []
    for index in (*head, *tail):
        frame, at, _, own = trace.frame(index)
        arrow = "->" if own else "<-"
        rows.append((_seconds(at - origin_at), arrow, str(frame), decode(frame, node_id, kind)))
    times = max((len(row[0]) for row in rows), default=0)
    frames = max((len(row[2]) for row in rows), default=0)
    lines = [
        f"{time:>{times}} s  {arrow} {raw:<{frames}}  {said}" for time, arrow, raw, said in rows
    ]
    if left_out > 0:
        lines.insert(len(head), f"... {left_out} frame{'s' * (left_out > 1)} left out")
    return lines


def _seconds(span_ns: int) -> str:
    """Signed seconds with four decimals, rounded to the nearest; exact for any size."""
    whole, rest = divmod((abs(span_ns) + 50_000) // 100_000, S // 100_000)
    return f"{'-' if span_ns < 0 else '+'}{whole}.{rest:04d}"


def _raw(frame: Frame) -> str:
    if frame.remote:
        return f"{count_bytes(frame.dlc)} asked for"
    return show_bytes(frame.data)


def _remote(frame: Frame) -> str:
    return " (remote)" if frame.remote else ""


def _odd(data: bytes, size: int) -> str:
    """A remark where the length is not the one that the clause gives."""
    return "" if len(data) == size else f" ({count_bytes(len(data))} instead of {size})"


# Services of CiA 301 with an identifier of their own.


def _nmt(seen: Facts) -> str:
    data = seen.data
    if seen.command is None or seen.target is None:
        return f"NMT command of {count_bytes(len(data))} instead of 2: {show_bytes(data)}"
    command = _COMMANDS.get(seen.command, f"unknown command {seen.command:02X}h")
    target = f"node {seen.target}" if seen.target else "all"
    return f"NMT {command} -> {target}{_odd(data, 2)}"


def _sync(seen: Facts) -> str:
    if seen.counter is not None:
        return f"SYNC, counter {seen.counter}"
    return f"SYNC{_odd(seen.data, 0)}"


def _time(seen: Facts) -> str:
    data = seen.data
    if len(data) != 6:
        return f"TIME{_odd(data, 6)}: {show_bytes(data)}"
    ms = int.from_bytes(data[:4], "little") & 0x0FFF_FFFF
    days = int.from_bytes(data[4:], "little")
    return f"TIME: {ms} ms after midnight, day {days} since 1984-01-01"


# Services of a node in the pre-defined connection set.


def _emcy(seen: Facts) -> str:
    data, code = seen.data, seen.code
    if code is None or seen.register is None:
        return f"EMCY of node {seen.node}{_odd(data, 8)}: {show_bytes(data)}"
    meaning = _EMCY.get(code) or _EMCY.get(code >> 8) or "unknown code"
    more = f", {show_bytes(data[3:])}" if any(data[3:]) else ""
    told = f"{code:04X}h {meaning}, register {seen.register:02X}h{more}{_odd(data, 8)}"
    return f"EMCY of node {seen.node}: {told}"


def _error_control(seen: Facts) -> str:
    node, data, told = seen.node, seen.data, seen.state
    if told is None:
        return f"error control of node {node}{_odd(data, 1)}: {show_bytes(data)}"
    if told == 0 and not seen.toggle:
        return f"boot-up of node {node}"
    state = _STATES.get(told, f"unknown state {told:02X}h")
    if seen.toggle:
        return f"guarding answer of node {node}: {state}, toggle 1"
    return f"heartbeat of node {node}: {state}"


def _pdo(seen: Facts) -> str:
    end = "of" if seen.function.startswith("T") else "to"
    return f"{seen.function} {end} node {seen.node}: {show_bytes(seen.data)}"


_ASKED_FOR = {ERROR_CONTROL: "error control (guarding)"}

_WORDS: dict[str, Callable[[Facts], str]] = {
    "NMT": _nmt,
    "SYNC": _sync,
    "TIME": _time,
    "EMCY": _emcy,
    ERROR_CONTROL: _error_control,
    SDO_REQUEST: lambda seen: f"SDO request to node {seen.node}: {show_sdo(seen.sdo, seen.data)}",
    SDO_ANSWER: lambda seen: f"SDO answer of node {seen.node}: {show_sdo(seen.sdo, seen.data)}",
    LSS_REQUEST: lambda seen: show_lss(seen.data, LSS_REQUEST),
    LSS_ANSWER: lambda seen: show_lss(seen.data, LSS_ANSWER),
}
"""By function; all others are PDOs."""
