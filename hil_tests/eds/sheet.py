"""All that an EDS or DCF says about a device, as the tester understands it."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Protocol

from hil_tests.eds.findings import Finding
from hil_tests.eds.lines import Document, Option, Section, numbered, read_document
from hil_tests.eds.objects import (
    ARRAY,
    RECORD,
    STRUCTURE,
    VAR,
    Object,
    number_option,
    read_object,
    read_value,
)
from hil_tests.eds.values import KINDS, Value, value_of

BIT_RATES = (10, 20, 50, 125, 250, 500, 800, 1000)
"""kbit/s that an EDS can name."""
SUB_INDEX = re.compile(r"([0-9a-f]{4})sub([0-9a-f]{1,2})")
INDEX = re.compile(r"[0-9a-f]{4}")
_TYPES = range(0x1000)
"""Indices below are no objects but data types."""
_HIGHEST_SUB = 0xFE
MOST_OBJECTS = 50_000
"""Real devices have up to some thousands; a few lines can describe millions."""
DOMAIN_OBJECT = 2


@dataclass(frozen=True, slots=True)
class Device:
    """[DeviceInfo], [DummyUsage] and [DeviceCommissioning].

    Args:
        vendor_name: as written.
        product_name: as written.
        vendor: VendorNumber, for 1018h:01; None = not told.
        product: ProductNumber, for 1018h:02; None = not told.
        revision: RevisionNumber, for 1018h:03; None = not told.
        bit_rates: bit/s that it can.
        rx_pdos: NrOfRXPDO; None = not told.
        tx_pdos: NrOfTXPDO; None = not told.
        lss: LSS_Supported.
        granularity: bits of the smallest mapped object; 0 = no mapping.
        dummies: codes of data types that may be mapped as gaps.
        node_id: of a DCF; None = not told.
        bit_rate: of a DCF, bit/s; None = not told.
    """

    vendor_name: str = ""
    product_name: str = ""
    vendor: int | None = None
    product: int | None = None
    revision: int | None = None
    bit_rates: tuple[int, ...] = ()
    rx_pdos: int | None = None
    tx_pdos: int | None = None
    lss: bool = False
    granularity: int = 8
    dummies: frozenset[int] = frozenset()
    node_id: int | None = None
    bit_rate: int | None = None


@dataclass(frozen=True, slots=True)
class Group:
    """An index with all its sub-indices.

    Args:
        index: 0000h..FFFFh.
        name: ParameterName.
        line: of its section.
        object_type: 7 VAR, 8 ARRAY, 9 RECORD, 2 DOMAIN.
        sub_number: SubNumber; None = not told.
        compact: CompactSubObj; 0 = each sub-index has its own section.
        objects: by sub-index, in order.
    """

    index: int
    name: str
    line: int
    object_type: int
    sub_number: int | None
    compact: int
    objects: tuple[Object, ...]


class Printer(Protocol):
    """What pretty printers offer."""

    def text(self, text: str) -> None:
        """Print a text."""


@dataclass(frozen=True, slots=True)
class Sheet:
    """A file that was read.

    Args:
        file: its path.
        device: what it says about the device as a whole.
        groups: by index, in order.
        objects: by index and sub-index, in order.
        findings: what was wrong with the text, in order of lines; `lint` finds more.
        document: the sections, for those who want to know more.
    """

    file: str
    device: Device
    groups: Mapping[int, Group]
    objects: Mapping[tuple[int, int], Object]
    findings: tuple[Finding, ...]
    document: Document

    def __repr__(self) -> str:
        """Short: all that a sheet holds takes hundreds of kilobytes."""
        return f"Sheet({self.file!r})"

    def _repr_pretty_(self, printer: Printer, cycle: bool) -> None:  # noqa: ARG002
        """As IPython and Hypothesis ask for it."""
        printer.text(repr(self))

    def get(self, index: int, sub: int = 0) -> Object | None:
        """An object, or None."""
        return self.objects.get((index, sub))

    def __iter__(self) -> Iterator[Object]:
        return iter(self.objects.values())


def read_sheet(path: str | Path) -> Sheet:
    """Read an EDS or DCF as far as it can be understood.

    Raises:
        ConfigError: the file cannot be opened, or it is far too large.
    """
    return sheet_of(read_document(path))


@lru_cache(maxsize=4)  # a bench asks for it as often as it is opened
def sheet_of_device(path: str) -> Sheet:
    """The data sheet of a device under test: read once, for nobody changes it in a run.

    Raises:
        ConfigError: see `read_sheet`.
    """
    return read_sheet(path)


def sheet_of(document: Document) -> Sheet:
    """What the sections say."""
    subs: dict[int, dict[int, Section]] = {}
    heads: dict[int, Section] = {}
    for name, section in document.sections.items():
        if INDEX.fullmatch(name):
            heads[int(name, 16)] = section
        elif found := SUB_INDEX.fullmatch(name):
            index, sub = int(found[1], 16), int(found[2], 16)
            subs.setdefault(index, {}).setdefault(sub, section)
    for index in sorted(subs.keys() - heads.keys()):
        section = next(iter(subs[index].values()))
        document.error(
            section.line,
            STRUCTURE,
            f"[{section.name}] has no section [{index:04X}]",
            f"add [{index:04X}] with ObjectType=0x9 and SubNumber",
        )
        heads[index] = Section(f"{index:04X}", section.line)
    groups: dict[int, Group] = {}
    left = MOST_OBJECTS
    for index in sorted(heads):
        if index not in _TYPES and left > 0:
            group = groups[index] = _group(document, heads[index], index, subs.get(index, {}))
            left -= len(group.objects)
    if left <= 0:
        text = f"there are more than {MOST_OBJECTS} objects"
        document.error(0, STRUCTURE, text, "split the file; the rest was not read")
    objects = {(o.index, o.sub): o for group in groups.values() for o in group.objects}
    device = _device(document)
    findings = tuple(sorted(document.findings, key=lambda finding: finding.line))
    return Sheet(document.file, device, groups, objects, findings, document)


def _group(document: Document, head: Section, index: int, subs: Mapping[int, Section]) -> Group:
    object_type = number_option(document, head, "ObjectType", RECORD if subs else VAR)
    compact = number_option(document, head, "CompactSubObj", 0)
    if not 0 <= compact <= _HIGHEST_SUB:
        document.error(
            head.line, STRUCTURE, f"[{head.name}] CompactSubObj is {compact}", "write 0..254"
        )
        compact = min(max(compact, 0), _HIGHEST_SUB)
    objects: dict[int, Object] = {}
    if object_type in {ARRAY, RECORD} or subs:
        if compact:
            objects = {each.sub: each for each in _compact(document, head, index, compact)}
        for sub, section in subs.items():
            if found := read_object(document, section, index, sub):
                objects[sub] = found
    elif object_type == DOMAIN_OBJECT and head.get("DataType") is None:
        objects[0] = _domain(document, head, index)
    elif found := read_object(document, head, index, 0):
        objects[0] = found
    told = head.get("SubNumber")
    return Group(
        index=index,
        name=head.text("ParameterName"),
        line=head.line,
        object_type=object_type,
        sub_number=number_option(document, head, "SubNumber", 0) if told else None,
        compact=compact,
        objects=tuple(objects[sub] for sub in sorted(objects)),
    )


def _domain(document: Document, head: Section, index: int) -> Object:
    """An object of type DOMAIN needs no DataType."""
    typed = Section(head.name, head.line, dict(head.options))
    typed.options["datatype"] = Option("DataType", "0x000F", head.line)
    typed.options.setdefault("accesstype", Option("AccessType", "rw", head.line))
    found = read_object(document, typed, index, 0)
    assert found is not None
    return found


def _compact(document: Document, head: Section, index: int, count: int) -> list[Object]:
    """Sub-indices 1 to `count` that one section describes (CiA 306, 4.6.3.2.4)."""
    model = read_object(document, head, index, 1)
    if model is None:
        return []
    names = _entries(document, f"{index:04x}name")
    values = _values(document, f"{index:04x}value", model)
    kind = KINDS[0x05]
    first = Object(
        index, 0, "Highest sub-index", head.line, 0x05, kind, "ro",
        default=value_of(str(count), head.line, kind),
    )  # fmt: skip
    objects = [first]
    for sub in range(1, count + 1):
        each = replace(model, sub=sub, name=names.get(sub, f"{model.name}{sub}"))
        objects.append(replace(each, default=values[sub]) if sub in values else each)
    return objects


def _entries(document: Document, name: str) -> dict[int, str]:
    section = document.section(name)
    return {} if section is None else {sub: o.text for sub, o in numbered(section)}


def _values(document: Document, name: str, model: Object) -> dict[int, Value]:
    section = document.section(name)
    if section is None:
        return {}
    found = ((sub, read_value(document, o, model.kind)) for sub, o in numbered(section) if o.text)
    return {sub: value for sub, value in found if value is not None}


def _device(document: Document) -> Device:
    info = document.section("DeviceInfo") or Section("DeviceInfo", 0)
    dummy = document.section("DummyUsage") or Section("DummyUsage", 0)
    made = document.section("DeviceCommissioning", "DeviceComissioning") or Section("", 0)

    def told(section: Section, name: str) -> int | None:
        return None if section.get(name) is None else number_option(document, section, name, 0)

    rate = told(made, "Baudrate")
    return Device(
        vendor_name=info.text("VendorName"),
        product_name=info.text("ProductName"),
        vendor=told(info, "VendorNumber"),
        product=told(info, "ProductNumber"),
        revision=told(info, "RevisionNumber"),
        bit_rates=tuple(kbit * 1000 for kbit in BIT_RATES if told(info, f"BaudRate_{kbit}")),
        rx_pdos=told(info, "NrOfRXPDO"),
        tx_pdos=told(info, "NrOfTXPDO"),
        lss=bool(told(info, "LSS_Supported")),
        granularity=number_option(document, info, "Granularity", 8),
        dummies=frozenset(code for code in range(1, 8) if told(dummy, f"Dummy{code:04}")),
        node_id=told(made, "NodeID"),
        bit_rate=None if rate is None else rate * 1000,
    )
