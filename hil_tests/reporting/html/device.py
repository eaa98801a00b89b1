"""Who was tested, in words: the name of the device, what stands in for it, and its identity."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from hil_tests.reporting.html.facts import fact, table_of, words

_STANDS_FOR = {
    "virtual": "the bundled model in virtual time",
    "model": "the bundled model in a process of its own",
    "external": "a device on the bus",
}
_NUMBERS = ("vendor", "product", "revision")


def device_name(run: Mapping[str, Any]) -> str:
    """The device in a word or two: what it calls itself, its EDS, or its profile."""
    device = table_of(run, "device")
    identity = table_of(device, "identity")
    names = (identity.get("name"), identity.get("product_name"), fact(device, "profile", "name"))
    named = next((str(name) for name in names if name), "device")
    serial = device.get("serial")
    mutant = device.get("mutant")
    parts = [named, f"no. {serial}" if serial else "", f"model {mutant}" if mutant else ""]
    return ", ".join(filter(None, parts))


def device_facts(run: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Rows of a table: what it is, and who says so."""
    return [(name, str(value)) for name, value in _facts(table_of(run, "device")) if value]


def _facts(device: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    identity, kind = table_of(device, "identity"), device.get("kind")
    profile = fact(device, "profile", "name")
    stands = _STANDS_FOR.get(str(kind), str(kind or ""))
    yield "Device", f"{profile or 'device'}: {stands}"
    yield "Faulty or different on purpose", device.get("mutant")
    vendor, product = identity.get("vendor_name"), identity.get("product_name")
    yield "Made as", ", ".join(str(each) for each in (vendor, product) if each)
    yield "Calls itself", identity.get("name")
    numbers = [
        f"{name} {identity[name]:08X}h" for name in _NUMBERS if isinstance(identity.get(name), int)
    ]
    yield "Identity", ", ".join(numbers)
    yield "Serial number", _with_source(device, "serial")
    yield "Firmware", _with_source(device, "firmware")
    yield "Hardware", identity.get("hardware")
    if identity:
        yield "Read from the device", _how_read(identity)


def _with_source(device: Mapping[str, Any], name: str) -> str:
    value, source = device.get(name), device.get(f"{name}_from")
    if not value:
        return ""
    return f"{value} ({source})" if source else str(value)


def _how_read(identity: Mapping[str, Any]) -> str:
    why = identity.get("not_read")
    read = identity.get("from") == "device"
    if why:
        return f"{'in part' if read else 'no'}: {why}"
    return "yes, over SDO" if read else ""


def device_warnings(run: Mapping[str, Any]) -> list[str]:
    """What of the device does not fit together."""
    return words(run, "device", "identity", "differs")
