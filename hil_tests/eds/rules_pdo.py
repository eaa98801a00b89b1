"""Rules about PDOs: default mappings, directions, numbers of PDOs."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from hil_tests.eds.findings import Finding, Severity
from hil_tests.eds.objects import Object
from hil_tests.eds.sheet import Sheet
from hil_tests.eds.values import KINDS

RECEIVE, TRANSMIT = 0x1600, 0x1A00
"""First mapping parameter of each direction."""
MOST_PDOS = 0x200
MOST_ENTRIES = 64
PDO_BITS = 64
_BOOLEAN = 0x01


@dataclass(frozen=True, slots=True)
class Mapped:
    """An entry of a default mapping: where it stands, and what it maps."""

    entry: Object
    line: int
    index: int
    sub: int
    bits: int

    @property
    def place(self) -> str:
        """The mapped object."""
        return f"{self.index:04X}h:{self.sub:02X}"


def _default_mappings(sheet: Sheet) -> Iterator[tuple[int, list[Mapped]]]:
    """Mapping parameter index, and its entries that are in use by default."""
    for index in sheet.groups:
        if index & 0xFE00 not in {RECEIVE, TRANSMIT}:
            continue
        count = sheet.get(index, 0)
        if count is None or count.default is None or not count.kind.is_number:
            continue
        used = int(count.default.at(0))
        if not 0 < used <= MOST_ENTRIES:  # FEh and FFh are multiplexed PDOs
            continue
        entries = []
        for sub in range(1, used + 1):
            entry = sheet.get(index, sub)
            value = entry.default if entry else None
            if entry is None or value is None or entry.kind is not KINDS[0x07]:
                continue
            number = int(value.at(0))
            if number:
                entries.append(
                    Mapped(entry, value.line, number >> 16, number >> 8 & 0xFF, number & 0xFF)
                )
        yield index, entries


def mappings(sheet: Sheet) -> Iterator[Finding]:
    """C-EDS-05: default mappings name objects that exist and can be mapped, up to 64 bits."""
    rule = "C-EDS-05"
    for index, entries in _default_mappings(sheet):
        for mapped in entries:
            problem = _problem(sheet, index, mapped)
            if problem is not None:
                text = f"{mapped.entry.place} maps {mapped.place}, {problem[0]}"
                yield Finding(sheet.file, mapped.line, rule, text, problem[1])
        bits = sum(mapped.bits for mapped in entries)
        if bits > PDO_BITS:
            text = f"{index:04X}h maps {bits} bits by default"
            yield Finding(
                sheet.file, entries[0].line, rule, text, "a PDO has 64: map fewer objects"
            )


def _problem(sheet: Sheet, index: int, mapped: Mapped) -> tuple[str, str] | None:
    """What is wrong with an entry, and the remedy."""
    if mapped.index < 0x20 and mapped.sub == 0 and mapped.index in KINDS:
        return _dummy_problem(sheet, index, mapped)
    target = sheet.get(mapped.index, mapped.sub)
    if target is None:
        return "which does not exist", "map an object of this file"
    if not target.pdo:
        return "which cannot be mapped", f"write PDOMapping=1 in line {target.line} and below"
    size = 8 * target.kind.size
    fitting = {1, size} if target.data_type == _BOOLEAN else {size}
    if size and mapped.bits not in fitting:
        return f"with {mapped.bits} bits; it has {size}", f"write {size:02X} as the last byte"
    return None


def _dummy_problem(sheet: Sheet, index: int, mapped: Mapped) -> tuple[str, str] | None:
    if index >= TRANSMIT:
        return "a dummy, in a TPDO", "dummies are for RPDOs"
    if mapped.index not in sheet.device.dummies:
        return "a dummy that [DummyUsage] does not allow", f"set Dummy{mapped.index:04}=1"
    return None


def directions(sheet: Sheet) -> Iterator[Finding]:
    """C-EDS-06: an RPDO maps what can be written, a TPDO what can be read."""
    for index, entries in _default_mappings(sheet):
        transmit = index >= TRANSMIT
        good = {"ro", "rwr", "const"} if transmit else {"wo", "rww"}
        for mapped in entries:
            target = sheet.get(mapped.index, mapped.sub)
            if target is None or target.access in good:
                continue
            kind, word = ("TPDO", "rwr") if transmit else ("RPDO", "rww")
            severity = Severity.WARNING if target.access == "rw" else Severity.ERROR
            text = f"{mapped.entry.place}, a {kind}, maps {mapped.place}, which is {target.access}"
            yield Finding(
                sheet.file, mapped.line, "C-EDS-06", text, f"AccessType {word} fits", severity
            )


def pdo_counts(sheet: Sheet) -> Iterator[Finding]:
    """C-EDS-10: NrOfRXPDO and NrOfTXPDO count the PDOs, each with both parameters."""
    rule = "C-EDS-10"
    device, section = sheet.device, sheet.document.section("DeviceInfo")
    for name, told, first in (
        ("NrOfRXPDO", device.rx_pdos, 0x1400),
        ("NrOfTXPDO", device.tx_pdos, 0x1800),
    ):
        there = [index for index in sheet.groups if first <= index < first + MOST_PDOS]
        if told is not None and told != len(there) and section is not None:
            option = section.get(name)
            line = option.line if option else section.line
            text = f"{name} is {told}, and {len(there)} are described"
            yield Finding(sheet.file, line, rule, text, f"write {name}={len(there)}")
        for index in there:
            if index + MOST_PDOS not in sheet.groups:
                text = f"{index:04X}h has no mapping parameter {index + MOST_PDOS:04X}h"
                line = sheet.groups[index].line
                yield Finding(sheet.file, line, rule, text, f"add [{index + MOST_PDOS:04X}]")
