"""Rules about sections: lists of objects, mandatory objects, sub-indices, unknown keys."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from difflib import get_close_matches

from hil_tests.eds.findings import Finding, Severity
from hil_tests.eds.lines import Section, numbered
from hil_tests.eds.objects import ARRAY, RECORD
from hil_tests.eds.sheet import Group, Sheet
from hil_tests.eds.values import Unreadable, number_of

MAKERS_LIST = "ManufacturerObjects"
LISTS = ("MandatoryObjects", "OptionalObjects", MAKERS_LIST)
"""Sections that list objects."""
MAKER = range(0x2000, 0x6000)
"""Indices of the maker's own objects, which stand in a list of their own."""
ALWAYS = (0x1000, 0x1001, 0x1018)
ERROR_FIELD = 0x1003
MAPPINGS = (range(0x1600, 0x1800), range(0x1A00, 0x1C00))

_OBJECT = (
    "ParameterName", "ObjectType", "DataType", "AccessType", "DefaultValue", "PDOMapping",
    "SubNumber", "LowLimit", "HighLimit", "ObjFlags", "CompactSubObj", "Denotation",
    "ParameterValue", "UploadFile", "DownloadFile", "ParamRefd",
)  # fmt: skip
_RATES = tuple(f"BaudRate_{rate}" for rate in (10, 20, 50, 125, 250, 500, 800, 1000))
_COMMISSIONING = (
    "NodeID", "NodeName", "NodeRefd", "Baudrate", "NetNumber", "NetworkName", "NetRefd",
    "CANopenManager", "LSS_SerialNumber",
)  # fmt: skip
KEYS: Mapping[str, tuple[str, ...]] = {
    "FileInfo": (
        "FileName", "FileVersion", "FileRevision", "EDSVersion", "Description", "CreationTime",
        "CreationDate", "CreatedBy", "ModificationTime", "ModificationDate", "ModifiedBy",
        "LastEDS",
    ),
    "DeviceInfo": (
        "VendorName", "VendorNumber", "ProductName", "ProductNumber", "ProductVersion",
        "RevisionNumber", "OrderCode", *_RATES, "SimpleBootUpMaster", "SimpleBootUpSlave",
        "Granularity", "DynamicChannelsSupported", "GroupMessaging", "NrOfRXPDO", "NrOfTXPDO",
        "LSS_Supported", "CompactPDO", "NG_Slave", "NG_Master", "NG_NrOfMonitoredNodes",
    ),
    "DeviceCommissioning": _COMMISSIONING,
    "DeviceComissioning": _COMMISSIONING,
    "DummyUsage": tuple(f"Dummy{code:04X}" for code in range(0x20)),
}  # fmt: skip
"""Options of the sections that have fixed ones (CiA 306, 4.4 to 4.6)."""
_SUB = re.compile(r"[0-9a-f]{1,4}(sub[0-9a-f]{1,2})?")
_FREE = re.compile(
    r"comments|tools|tool\d+|supportedmodules|dynamicchannels|standarddatatypes|"
    r"m\d+\w+|[0-9a-f]{4}(name|value|denotation|objectlinks)"
)
"""Sections whose options are names or numbers of somebody's own."""


def _finding(sheet: Sheet, line: int, rule: str, text: str, remedy: str) -> Finding:
    return Finding(sheet.file, line, rule, text, remedy)


def lists(sheet: Sheet) -> Iterator[Finding]:
    """C-EDS-01: the lists name every object once, each has a section, the counts are right."""
    listed: dict[int, int] = {}
    for name in LISTS:
        section = sheet.document.section(name)
        if section is None:
            if name != MAKERS_LIST:
                text, remedy = f"there is no section [{name}]", "add it with SupportedObjects"
                yield _finding(sheet, 0, "C-EDS-01", text, remedy)
            continue
        yield from _list(sheet, section, listed)
    for index, group in sheet.groups.items():
        if index not in listed:
            text = f"object {index:04X}h stands in no list"
            where = MAKERS_LIST if index in MAKER else "OptionalObjects"
            yield _finding(sheet, group.line, "C-EDS-01", text, f"add it to [{where}]")


def _list(sheet: Sheet, section: Section, listed: dict[int, int]) -> Iterator[Finding]:
    """One list; what it names is added to `listed`, with its line."""
    rule = "C-EDS-01"
    entries = dict(numbered(section))
    option = section.get("SupportedObjects")
    try:
        count = number_of(option.text) if option else None
    except Unreadable:
        count = None
    if count is None or count != len(entries):
        line = option.line if option else section.line
        told = "no number" if count is None else str(count)
        text = f"[{section.name}] SupportedObjects says {told}, and {len(entries)} are listed"
        yield _finding(sheet, line, rule, text, f"write SupportedObjects={len(entries)}")
    for number in sorted(set(range(1, len(entries) + 1)) - entries.keys())[:1]:
        text = f"[{section.name}] has no entry {number}"
        yield _finding(sheet, section.line, rule, text, f"number them 1 to {len(entries)}")
    for entry in entries.values():
        try:
            index = number_of(entry.text)
        except Unreadable as error:
            text = f"entry {entry.name} of [{section.name}] is {entry.text[:40]!r}"
            yield _finding(sheet, entry.line, rule, text, str(error))
            continue
        if index in listed:
            text = f"object {index:04X}h is listed in line {listed[index]} too"
            yield _finding(sheet, entry.line, rule, text, "keep one")
        listed.setdefault(index, entry.line)
        if index not in sheet.groups:
            text = f"object {index:04X}h has no section"
            yield _finding(sheet, entry.line, rule, text, f"add [{index:04X}], or drop the entry")
        elif (index in MAKER) != (section.name.lower() == MAKERS_LIST.lower()):
            text = f"object {index:04X}h does not belong into [{section.name}]"
            yield _finding(sheet, entry.line, rule, text, "move it to the list of its range")


def mandatory(sheet: Sheet) -> Iterator[Finding]:
    """C-EDS-02: 1000h, 1001h, 1018h and one error control protocol (CiA 301, 7.2.8.2.2)."""
    rule = "C-EDS-02"
    for index in ALWAYS:
        if index not in sheet.groups:
            text = f"mandatory object {index:04X}h is missing"
            yield _finding(sheet, 0, rule, text, f"add [{index:04X}]")
    for sub in (0, 1):
        if 0x1018 in sheet.groups and sheet.get(0x1018, sub) is None:
            text = f"mandatory object 1018h:{sub:02X} is missing"
            yield _finding(sheet, sheet.groups[0x1018].line, rule, text, f"add [1018sub{sub}]")
    guarding = 0x100C in sheet.groups and 0x100D in sheet.groups
    if 0x1017 not in sheet.groups and not guarding:
        text = "there is neither heartbeat (1017h) nor guarding (100Ch and 100Dh)"
        yield _finding(sheet, 0, rule, text, "add [1017]")


def sub_numbers(sheet: Sheet) -> Iterator[Finding]:
    """C-EDS-04: SubNumber counts the sub-indices, sub-index 0 names the highest one."""
    for group in sheet.groups.values():
        if group.object_type in {ARRAY, RECORD}:
            yield from _sub_numbers(sheet, group)


def _sub_numbers(sheet: Sheet, group: Group) -> Iterator[Finding]:
    rule = "C-EDS-04"
    there = {each.sub for each in group.objects}
    if not group.compact and group.sub_number != len(there):
        told = "missing" if group.sub_number is None else str(group.sub_number)
        text = f"SubNumber of {group.index:04X}h is {told}, and it has {len(there)} sub-indices"
        yield _finding(sheet, group.line, rule, text, f"write SubNumber={len(there)}")
    first = sheet.get(group.index, 0)
    if first is None:
        text = f"{group.index:04X}h has no sub-index 0"
        yield _finding(sheet, group.line, rule, text, f"add [{group.index:04X}sub0]")
        return
    highest = max(there - {0xFF}, default=0)
    if first.default is None or group.index == ERROR_FIELD:
        return
    told_highest = first.default.at(0) if first.kind.is_number else -1
    mapping = any(group.index in each for each in MAPPINGS)
    if told_highest != highest and not (mapping and 0 <= told_highest <= highest):
        text = f"{first.place} is {first.default.text}, and the highest sub-index is {highest}"
        yield _finding(sheet, first.default.line, rule, text, f"write DefaultValue={highest}")


def unknown_keys(sheet: Sheet) -> Iterator[Finding]:
    """C-EDS-07: options and sections that CiA 306 does not know."""
    known_sections = (*KEYS, *LISTS, "Comments")
    for name, section in sheet.document.sections.items():
        keys = _keys_of(name)
        if keys is None:
            if not _FREE.fullmatch(name):
                text = f"section [{section.name[:40]}] is not known"
                yield _unknown(sheet, section.line, text, section.name, known_sections)
            continue
        lower = {key.lower() for key in keys}
        for key, option in section.options.items():
            if key not in lower and not (name in _NUMBERED and key.isdecimal()):
                text = f"option {option.name[:40]} of [{section.name}] is not known"
                yield _unknown(sheet, option.line, text, option.name, keys)


_FIXED = {name.lower(): keys for name, keys in KEYS.items()}
_NUMBERED = {name.lower() for name in LISTS}


def _keys_of(name: str) -> tuple[str, ...] | None:
    """The options that a section may have; None where there is no rule for it."""
    if name in _FIXED:
        return _FIXED[name]
    if name in _NUMBERED:
        return ("SupportedObjects",)
    return _OBJECT if _SUB.fullmatch(name) else None


def _unknown(sheet: Sheet, line: int, text: str, name: str, known: tuple[str, ...]) -> Finding:
    by_lower = {each.lower(): each for each in known}
    near = get_close_matches(name.lower()[:40], by_lower, n=1)
    remedy = f"is {by_lower[near[0]]} meant?" if near else "drop it"
    return Finding(sheet.file, line, "C-EDS-07", text, remedy, Severity.WARNING)
