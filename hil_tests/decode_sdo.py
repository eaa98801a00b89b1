"""SDO and LSS frames in one line of words (CiA 301, 7.2.4.3; CiA 305, 6).

Each frame is read by itself: the data frames inside an SDO block transfer have no command
byte, and only a decoder that follows the transfer could tell them apart.
"""

from __future__ import annotations

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

_MULTIPLEXER_END = 4

_REQUESTS = {1: "write", 2: "read", 5: "block read", 6: "block write"}
_ANSWERS = {2: "value of", 3: "written", 5: "block write", 6: "block read"}
"""Command specifiers (top three bits of byte 0) that carry a multiplexer."""

_BLOCK = {5: 0b11, 6: 0b01}
"""Bits of byte 0 that are all 0 only where a block transfer begins, and the object is named."""

_LSS = {
    0x04: "switch mode global",
    0x11: "configure node id",
    0x13: "configure bit timing",
    0x15: "activate bit timing",
    0x17: "store configuration",
    0x40: "switch mode selective: vendor",
    0x41: "switch mode selective: product",
    0x42: "switch mode selective: revision",
    0x43: "switch mode selective: serial number",
    0x44: "switch mode selective: selected",
    0x46: "identify remote device: vendor",
    0x47: "identify remote device: product",
    0x48: "identify remote device: revision low",
    0x49: "identify remote device: revision high",
    0x4A: "identify remote device: serial number low",
    0x4B: "identify remote device: serial number high",
    0x4C: "identify non-configured device",
    0x4F: "identified",
    0x50: "non-configured device identified",
    0x51: "fastscan",
    0x5A: "inquire vendor",
    0x5B: "inquire product",
    0x5C: "inquire revision",
    0x5D: "inquire serial number",
    0x5E: "inquire node id",
}
_LSS_MODES = {0: "waiting", 1: "configuration"}
_LSS_BIT_RATES = {0: 1000, 1: 800, 2: 500, 3: 250, 4: 125, 6: 50, 7: 20, 8: 10}
"""kbit/s in table 0 of CiA 305."""


def count_bytes(number: int) -> str:
    """A number of bytes in words."""
    return f"{number} byte" if number == 1 else f"{number} bytes"


def show_bytes(data: bytes) -> str:
    """Bytes in hex."""
    return data.hex(" ").upper() or "no data"


def sdo_request(node: int, data: bytes) -> str:
    """A frame from a client to the server of a node."""
    return f"SDO request to node {node}: {_sdo(data, _REQUESTS, client=True)}"


def sdo_answer(node: int, data: bytes) -> str:
    """A frame from the server of a node."""
    return f"SDO answer of node {node}: {_sdo(data, _ANSWERS, client=False)}"


def lss(data: bytes, name: str) -> str:
    """A frame of layer setting services."""
    if not data:
        return f"{name} without data"
    service = _LSS.get(data[0], f"unknown service {data[0]:02X}h")
    return f"{name}: {service}{_lss_detail(data, request=name.endswith('request'))}"


def _lss_detail(data: bytes, *, request: bool) -> str:
    service, argument = data[0], data[1] if len(data) > 1 else 0
    if request and service == 0x04:
        return f", {_LSS_MODES.get(argument, f'mode {argument}')}"
    if request and service == 0x11:
        return f" {argument}"
    if request and service == 0x13 and len(data) > 2:
        rate = _LSS_BIT_RATES.get(data[2])
        return f", table {argument} index {data[2]}" + (
            f" ({rate} kbit/s)" if rate and not argument else ""
        )
    if not request and service in (0x11, 0x13, 0x17):
        return ", done" if not argument else f", error {argument}"
    rest = data[1:].hex(" ").upper()
    return f" ({rest})" if any(data[1:]) else ""


def _sdo(data: bytes, names: dict[int, str], *, client: bool) -> str:
    odd = "" if len(data) == 8 else f" ({count_bytes(len(data))} instead of 8)"
    if len(data) < _MULTIPLEXER_END:
        return f"{show_bytes(data)}{odd}"
    return f"{_command(data, names, client=client)}{odd}"


def _command(data: bytes, names: dict[int, str], *, client: bool) -> str:
    specifier = data[0] >> 5
    index, sub = int.from_bytes(data[1:3], "little"), data[3]
    place = f"{index:04X}h:{sub:02X}"
    if specifier == 4:
        code = int.from_bytes(data[4:], "little")
        return f"abort of {place}: {code:08X}h {ABORTS.get(code, 'unknown code')}"
    if specifier == 0 or (specifier == 3 and client) or (specifier == 1 and not client):
        return _segment(data)
    name = names.get(specifier)
    if specifier in _BLOCK and data[0] & _BLOCK[specifier]:
        return f"block transfer, command {data[0]:02X}h: {show_bytes(data[1:])}"
    if name is None:
        return f"unknown command {data[0]:02X}h: {show_bytes(data[1:])}"
    transfers = specifier == (1 if client else 2)
    return f"{name} {place}{_value(data) if transfers else ''}"


def _segment(data: bytes) -> str:
    return f"segment, command {data[0]:02X}h: {show_bytes(data[1:])}"


def _value(data: bytes) -> str:
    """What an initiate frame carries: an expedited value, or the size of what will come."""
    expedited, sized = data[0] >> 1 & 1, data[0] & 1
    if not expedited:
        told = sized and len(data) == 8
        size = f", {count_bytes(int.from_bytes(data[4:], 'little'))}" if told else ""
        return f" in segments{size}"
    used = 4 - (data[0] >> 2 & 3) if sized else 4
    value = data[4 : 4 + used]
    if not value:
        return " without a value"
    number = int.from_bytes(value, "little")
    return f" = {show_bytes(value)} ({number})"
