"""LSS frames in one line of words (CiA 305, 6)."""

from __future__ import annotations

from hil_tests.decode_sdo import count_bytes, show_bytes

_SERVICES = {
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
_MODES = {0: "waiting", 1: "configuration"}
_BIT_RATES = {0: 1000, 1: 800, 2: 500, 3: 250, 4: 125, 6: 50, 7: 20, 8: 10}
"""kbit/s in table 0 of CiA 305."""

_NUMBERED = frozenset((*range(0x40, 0x44), *range(0x46, 0x4C), *range(0x5A, 0x5E)))
"""Services that carry a number of an identity: vendor, product, revision, serial number."""

_STORED = (0x11, 0x13, 0x17)
"""Services that are answered with an error code."""


def show_lss(data: bytes, name: str) -> str:
    """A frame of layer setting services.

    Args:
        data: of the frame.
        name: "LSS request" or "LSS answer".
    """
    if not data:
        return f"{name} without data (0 bytes instead of 8)"
    service = _SERVICES.get(data[0], f"unknown service {data[0]:02X}h")
    detail = _asked(data) if name.endswith("request") else _answered(data)
    if detail is None:
        detail = f" ({show_bytes(data[1:])})" if any(data[1:]) else ""
    odd = "" if len(data) == 8 else f" ({count_bytes(len(data))} instead of 8)"
    return f"{name}: {service}{detail}{odd}"


def _asked(data: bytes) -> str | None:
    """What a master says; None = nothing better than its bytes."""
    service, argument = data[0], data[1] if len(data) > 1 else 0
    if service == 0x04:
        return f", {_MODES.get(argument, f'mode {argument}')}"
    if service == 0x11:
        return f" {argument}"
    if service == 0x13 and len(data) > 2:
        rate = _BIT_RATES.get(data[2])
        shown = f" ({rate} kbit/s)" if rate and not argument else ""
        return f", table {argument} index {data[2]}{shown}"
    if service == 0x15 and len(data) > 2:
        return f" after {int.from_bytes(data[1:3], 'little')} ms"
    if service == 0x51 and len(data) == 8:
        number = int.from_bytes(data[1:5], "little")
        return f" {number:08X}h, bit {data[5]}, part {data[6]}, next part {data[7]}"
    return _number(data) if service < 0x50 else None


def _answered(data: bytes) -> str | None:
    """What a device says; None = nothing better than its bytes."""
    service, argument = data[0], data[1] if len(data) > 1 else 0
    if service in _STORED:
        return ", done" if not argument else f", error {argument}"
    if service == 0x5E and len(data) > 1:
        return f" {argument}"
    return _number(data)


def _number(data: bytes) -> str | None:
    """The number of an identity."""
    if data[0] not in _NUMBERED or len(data) < 5:
        return None
    return f" {int.from_bytes(data[1:5], 'little'):08X}h"
