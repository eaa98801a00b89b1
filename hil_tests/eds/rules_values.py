"""Rules about values: defaults and limits, and what the file says about the device."""

from __future__ import annotations

from collections.abc import Iterator

from hil_tests.eds.findings import Finding, Severity
from hil_tests.eds.objects import Object
from hil_tests.eds.sheet import Sheet
from hil_tests.eds.values import Value

RULE = "C-EDS-03"
NODE_IDS = (1, 127)
"""A formula must hold for the least and the greatest node id."""


def defaults(sheet: Sheet) -> Iterator[Finding]:
    """C-EDS-03: values fit their type, and stand between their limits."""
    for each in sheet:
        if each.kind.is_number:
            yield from _fitting(sheet, each)
            yield from _ordered(sheet, each)


def _values(each: Object) -> tuple[tuple[str, Value | None], ...]:
    return (
        ("LowLimit", each.low),
        ("HighLimit", each.high),
        ("DefaultValue", each.default),
        ("ParameterValue", each.configured),
    )


def _fitting(sheet: Sheet, each: Object) -> Iterator[Finding]:
    for name, value in _values(each):
        if value is not None and not all(value.fits(node_id) for node_id in NODE_IDS):
            text = f"{name} of {each.place} is {value.text}, which no {each.kind.name} can be"
            remedy = f"write a value of {8 * each.kind.size} bits, or another DataType"
            yield Finding(sheet.file, value.line, RULE, text, remedy)


def _ordered(sheet: Sheet, each: Object) -> Iterator[Finding]:
    low, high = each.low, each.high
    for node_id in NODE_IDS:
        if low is not None and high is not None and low.at(node_id) > high.at(node_id):
            text = f"LowLimit {low.text} of {each.place} is above HighLimit {high.text}"
            yield Finding(sheet.file, low.line, RULE, text, "exchange them")
            return
    for name, value in (("DefaultValue", each.default), ("ParameterValue", each.configured)):
        if value is None:
            continue
        what = f"{name} of {each.place} is {value.text}"
        if low is not None and any(value.at(n) < low.at(n) for n in NODE_IDS):
            text = f"{what}, below its LowLimit {low.text}"
            yield Finding(sheet.file, value.line, RULE, text, "change one of them")
        if high is not None and any(value.at(n) > high.at(n) for n in NODE_IDS):
            text = f"{what}, above its HighLimit {high.text}"
            yield Finding(sheet.file, value.line, RULE, text, "change one of them")


def device_facts(sheet: Sheet) -> Iterator[Finding]:
    """C-EDS-10, as far as the file alone shows it: bit rates, granularity, identity."""
    section = sheet.document.section("DeviceInfo")
    if section is None:
        text, remedy = "there is no section [DeviceInfo]", "add it"
        yield Finding(sheet.file, 0, "C-EDS-01", text, remedy)
        return
    device = sheet.device
    if not device.bit_rates:
        text, remedy = "no BaudRate_... is 1", "set BaudRate_125=1 or what the device can"
        yield Finding(sheet.file, section.line, "C-EDS-10", text, remedy)
    if not 0 <= device.granularity <= 64:
        option = section.get("Granularity")
        line = option.line if option else section.line
        text, remedy = f"Granularity is {device.granularity}", "write 0..64"
        yield Finding(sheet.file, line, "C-EDS-10", text, remedy)
    told = ((1, "VendorNumber", device.vendor), (2, "ProductNumber", device.product),
            (3, "RevisionNumber", device.revision))  # fmt: skip
    for sub, name, number in told:
        entry = sheet.get(0x1018, sub)
        if entry is None or entry.default is None or number is None or not entry.default.at(0):
            continue
        if number != entry.default.at(0):
            text = f"{name} is {number:#x}, and {entry.place} is {entry.default.text}"
            remedy = "write the number that the device has"
            yield Finding(
                sheet.file, entry.default.line, "C-EDS-10", text, remedy, Severity.WARNING
            )
