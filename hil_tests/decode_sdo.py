"""SDO frames taken apart, and in one line of words (CiA 301 4.2.0, 7.2.4.3).

Each frame is read by itself: the data frames inside an SDO block transfer have no command
byte, and only a decoder that follows the transfer could tell them apart.
"""

from __future__ import annotations

from dataclasses import dataclass

ABORTS = {
    0x05030000: "toggle bit not alternated",
    0x05040000: "SDO time-out",
    0x05040001: "unknown command specifier",
    0x05040002: "invalid block size",
    0x05040003: "invalid sequence number",
    0x05040004: "CRC error",
    0x05040005: "out of memory",
    0x06010000: "access not supported",
    0x06010001: "read of a write-only object",
    0x06010002: "write of a read-only object",
    0x06020000: "no such object",
    0x06040041: "cannot be mapped",
    0x06040042: "PDO would be too long",
    0x06040043: "incompatible parameters",
    0x06040047: "incompatible inside the device",
    0x06060000: "hardware error",
    0x06070010: "length does not match",
    0x06070012: "too long",
    0x06070013: "too short",
    0x06090011: "no such sub-index",
    0x06090030: "invalid value",
    0x06090031: "value too high",
    0x06090032: "value too low",
    0x06090036: "maximum below minimum",
    0x060A0023: "resource not available",
    0x08000000: "general error",
    0x08000020: "cannot be transferred or stored",
    0x08000021: "local control forbids it",
    0x08000022: "device state forbids it",
    0x08000023: "no object dictionary",
    0x08000024: "no data available",
}
"""Abort codes, CiA 301, table 22."""

_SHORTEST = 4
"""Bytes with which a frame names an object; below that it is shown raw."""

_REQUESTS = {
    0: "segment",
    1: "write",
    2: "read",
    3: "next segment",
    4: "abort",
    5: "block read",
    6: "block write",
}
_ANSWERS = {
    0: "segment",
    1: "segment written",
    2: "value of",
    3: "written",
    4: "abort",
    5: "block write",
    6: "block read",
}
"""By the command specifier, the top three bits of byte 0."""

_SUBCOMMANDS = {
    ("block read", True): (0b11, ("begin", "end", "received", "start")),
    ("block write", True): (0b01, ("begin", "end")),
    ("block write", False): (0b11, ("begin", "end", "received")),
    ("block read", False): (0b01, ("begin", "end")),
}
"""Command, whether from the client -> bits of byte 0 that tell its steps apart, and the steps."""

_NAMING = {"write", "read", "value of", "written", "abort"}
_CRC = 0b100
_SIZED = 0b10


@dataclass(frozen=True, slots=True)
class SdoFrame:
    """An SDO frame taken apart; None = it has no such thing, or is too short for it.

    Args:
        command: what it is, in a word or two; "" = a command specifier that nobody knows.
        step: of a block transfer: "begin", "received", "start" or "end"; "" = none.
        index: of the object.
        sub: its sub-index.
        abort: code of an abort.
        toggle: of a segment.
        last: no segment follows.
        value: data that the frame carries.
        size: how many bytes will be transferred.
        segments: of a block that are asked for next.
        received: segment up to which all has arrived.
        crc: checksum of a block transfer.
        checked: a block transfer has a checksum.
        unused: bytes of the last segment that are no data.
    """

    command: str
    step: str = ""
    index: int | None = None
    sub: int | None = None
    abort: int | None = None
    toggle: int | None = None
    last: bool = False
    value: bytes | None = None
    size: int | None = None
    segments: int | None = None
    received: int | None = None
    crc: int | None = None
    checked: bool = False
    unused: int | None = None


def read_sdo(data: bytes, *, from_client: bool) -> SdoFrame | None:
    """Take an SDO frame apart.

    Args:
        data: of the frame.
        from_client: it is a request; else an answer of the server.

    Returns:
        None where it is too short to be one.
    """
    if len(data) < _SHORTEST:
        return None
    specifier = data[0] >> 5
    command = (_REQUESTS if from_client else _ANSWERS).get(specifier, "")
    if command.startswith("block"):
        return _block(data, command, from_client=from_client)
    if command in _NAMING:
        return _named(data, command)
    toggle = data[0] >> 4 & 1 if command else None
    if command != "segment":
        return SdoFrame(command, toggle=toggle)
    end = 8 - (data[0] >> 1 & 7)
    return SdoFrame(command, toggle=toggle, last=bool(data[0] & 1), value=data[1:end])


def _named(data: bytes, command: str) -> SdoFrame:
    """A frame that names an object."""
    index, sub = int.from_bytes(data[1:3], "little"), data[3]
    number = _number(data, 4, 4)
    if command == "abort":
        code = int.from_bytes(data[4:], "little")
        return SdoFrame(command, index=index, sub=sub, abort=code)
    if command not in {"write", "value of"}:
        return SdoFrame(command, index=index, sub=sub)
    expedited, sized = data[0] >> 1 & 1, data[0] & 1
    if not expedited:
        return SdoFrame(command, index=index, sub=sub, size=number if sized else None)
    used = 4 - (data[0] >> 2 & 3) if sized else 4
    return SdoFrame(command, index=index, sub=sub, value=data[4 : 4 + used])


def _block(data: bytes, command: str, *, from_client: bool) -> SdoFrame:
    """A frame of a block transfer, as far as it can be told by itself."""
    mask, steps = _SUBCOMMANDS[command, from_client]
    place = data[0] & mask
    if place >= len(steps):
        return SdoFrame("")
    step = steps[place]
    if step == "begin":
        return _beginning(data, command, from_client=from_client)
    if step == "received":
        return SdoFrame(command, step, received=data[1], segments=data[2])
    # Whoever sent the data ends the transfer with their checksum; the other one confirms.
    if step == "end" and mask == 1:
        crc = int.from_bytes(data[1:3], "little")
        return SdoFrame(command, step, crc=crc, unused=data[0] >> 2 & 7)
    return SdoFrame(command, step)


def _beginning(data: bytes, command: str, *, from_client: bool) -> SdoFrame:
    """The one that receives says how long a block may be, the one that sends how much comes."""
    receives = (command == "block read") == from_client
    return SdoFrame(
        command,
        "begin",
        index=int.from_bytes(data[1:3], "little"),
        sub=data[3],
        checked=bool(data[0] & _CRC),
        segments=_number(data, 4, 1) if receives else None,
        size=_number(data, 4, 4) if not receives and data[0] & _SIZED else None,
    )


def _number(data: bytes, place: int, size: int) -> int | None:
    part = data[place : place + size]
    return int.from_bytes(part, "little") if len(part) == size else None


# In words.


def count_bytes(number: int) -> str:
    """A number of bytes in words."""
    return f"{number} byte" if number == 1 else f"{number} bytes"


def show_bytes(data: bytes) -> str:
    """Bytes in hex."""
    return data.hex(" ").upper() or "no data"


def show_sdo(sdo: SdoFrame | None, data: bytes) -> str:
    """An SDO frame in words; what is odd about its length is said.

    Args:
        sdo: taken apart, or None.
        data: of the frame.
    """
    odd = "" if len(data) == 8 else f" ({count_bytes(len(data))} instead of 8)"
    return f"{show_bytes(data) if sdo is None else _words(sdo, data)}{odd}"


def _words(sdo: SdoFrame, data: bytes) -> str:
    if not sdo.command:
        return f"unknown command {data[0]:02X}h: {show_bytes(data[1:])}"
    if sdo.abort is not None:
        code = f"{sdo.abort:08X}h {ABORTS.get(sdo.abort, 'unknown code')}"
        return f"abort of {_place(sdo)}: {code}"
    if sdo.step:
        return ", ".join(_block_words(sdo))
    if sdo.toggle is not None:
        value = "" if sdo.value is None else f": {show_bytes(sdo.value)}"
        return f"{sdo.command}, toggle {sdo.toggle}{', last' if sdo.last else ''}{value}"
    return f"{sdo.command} {_place(sdo)}{_value(sdo)}"


def _place(sdo: SdoFrame) -> str:
    return f"{sdo.index:04X}h:{sdo.sub:02X}"


def _value(sdo: SdoFrame) -> str:
    """What an initiate frame carries: an expedited value, or the size of what will come."""
    if sdo.command not in {"write", "value of"}:
        return ""
    if sdo.value is None:
        return " in segments" + (f", {count_bytes(sdo.size)}" if sdo.size is not None else "")
    if not sdo.value:
        return " without a value"
    return f" = {show_bytes(sdo.value)} ({int.from_bytes(sdo.value, 'little')})"


def _block_words(sdo: SdoFrame) -> list[str]:
    words = [f"{sdo.command} {_place(sdo)}"] if sdo.step == "begin" else [sdo.command]
    if sdo.step in {"start", "end"}:
        words.append(sdo.step)
    if sdo.received is not None:
        words.append(f"received up to segment {sdo.received}")
    if sdo.size is not None:
        words.append(count_bytes(sdo.size))
    if sdo.segments is not None:
        words.append(f"{sdo.segments} segments a block")
    if sdo.checked:
        words.append("with CRC")
    if sdo.crc is not None:
        words.append(f"CRC {sdo.crc:04X}h, {count_bytes(sdo.unused or 0)} unused")
    return words
