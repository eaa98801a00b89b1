"""A frame in one line of words, for messages that a person reads.

The tester's own reading of CiA 301 (4.2.0), CiA 305 and the keypad's source; nothing is
judged by it. A frame that breaks its layout is shown with what is odd about it, never hidden.
"""

from __future__ import annotations

from collections.abc import Callable

from hil_tests.clock import S
from hil_tests.decode_keypad import decode_keypad
from hil_tests.decode_sdo import count_bytes, lss, sdo_answer, sdo_request, show_bytes
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

_PDOS = ("TPDO1", "RPDO1", "TPDO2", "RPDO2", "TPDO3", "RPDO3", "TPDO4", "RPDO4")
"""Of the pre-defined connection set from 180h on, 80h apart."""

_LSS_REQUEST, _LSS_ANSWER = 0x7E5, 0x7E4


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
    fixed = _FIXED.get(frame.can_id)
    if fixed and not frame.remote:
        return fixed(frame.data)
    base, node = frame.can_id & 0x780, frame.can_id & 0x7F
    named = _BY_BASE.get(base) if node else None
    if named is None:
        return f"unknown{_remote(frame)}: {_raw(frame)}"
    name, read = named
    if frame.remote:
        return f"remote request to node {node} for {name}"
    return read(node, frame.data)


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


def _nmt(data: bytes) -> str:
    if len(data) < 2:
        return f"NMT command of {count_bytes(len(data))} instead of 2: {show_bytes(data)}"
    command = _COMMANDS.get(data[0], f"unknown command {data[0]:02X}h")
    target = f"node {data[1]}" if data[1] else "all"
    return f"NMT {command} -> {target}{_odd(data, 2)}"


def _sync(data: bytes) -> str:
    if len(data) == 1:
        return f"SYNC, counter {data[0]}"
    return f"SYNC{_odd(data, 0)}"


def _time(data: bytes) -> str:
    if len(data) != 6:
        return f"TIME{_odd(data, 6)}: {show_bytes(data)}"
    ms = int.from_bytes(data[:4], "little") & 0x0FFF_FFFF
    days = int.from_bytes(data[4:], "little")
    return f"TIME: {ms} ms after midnight, day {days} since 1984-01-01"


_FIXED: dict[int, Callable[[bytes], str]] = {
    0x000: _nmt,
    0x080: _sync,
    0x100: _time,
    _LSS_REQUEST: lambda data: lss(data, "LSS request"),
    _LSS_ANSWER: lambda data: lss(data, "LSS answer"),
}


# Services of a node in the pre-defined connection set.


def _emcy(node: int, data: bytes) -> str:
    if len(data) < 3:
        return f"EMCY of node {node}{_odd(data, 8)}: {show_bytes(data)}"
    code = int.from_bytes(data[:2], "little")
    meaning = _EMCY.get(code) or _EMCY.get(code >> 8) or "unknown code"
    more = f", {show_bytes(data[3:])}" if any(data[3:]) else ""
    return (
        f"EMCY of node {node}: {code:04X}h {meaning}, register {data[2]:02X}h{more}{_odd(data, 8)}"
    )


def _error_control(node: int, data: bytes) -> str:
    if len(data) != 1:
        return f"error control of node {node}{_odd(data, 1)}: {show_bytes(data)}"
    if data[0] == 0:
        return f"boot-up of node {node}"
    state = _STATES.get(data[0] & 0x7F, f"unknown state {data[0] & 0x7F:02X}h")
    if data[0] & 0x80:
        return f"guarding answer of node {node}: {state}, toggle 1"
    return f"heartbeat of node {node}: {state}"


def _pdo(name: str) -> Callable[[int, bytes], str]:
    end = "of" if name.startswith("T") else "to"
    return lambda node, data: f"{name} {end} node {node}: {show_bytes(data)}"


_BY_BASE: dict[int, tuple[str, Callable[[int, bytes], str]]] = {
    0x080: ("EMCY", _emcy),
    **{0x180 + 0x80 * place: (name, _pdo(name)) for place, name in enumerate(_PDOS)},
    0x580: ("SDO answer", sdo_answer),
    0x600: ("SDO request", sdo_request),
    0x700: ("error control (guarding)", _error_control),
}
