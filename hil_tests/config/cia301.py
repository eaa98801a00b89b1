"""Profiles of devices with an object dictionary (CiA 301): the drive, and any other.

A drive's profile says which objects carry its motion, in which unit its synchronous window
is given, and which errors a bench can raise in it. The model reads the same files with a
reader of its own, so that a slip in one reader shows as a difference.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Annotated

import attrs

from hil_tests.clock import MS, US
from hil_tests.config.device import DeviceFault, DeviceProfile, Identity
from hil_tests.config.limits import Cia301Limits
from hil_tests.config.parameters import CIA301_NODE_IDS, Cia301Parameters
from hil_tests.config.reading import structure
from hil_tests.config.report import Problem, Wrong, near_miss, refuse
from hil_tests.config.rules import NAME, OneOf, Whole

WINDOW_UNITS = MappingProxyType({"us": US, "ms": MS})
"""Unit of 1007h in ns: CiA 301 says microseconds, some makers' manuals milliseconds."""

REGISTER_BITS = MappingProxyType(
    {
        "current": 1,
        "voltage": 2,
        "temperature": 3,
        "communication": 4,
        "profile": 5,
        "manufacturer": 7,
    }
)
"""Bits of the error register 1001h besides bit 0 (CiA 301 4.2.0, 7.5.2.2)."""

GENERIC_BIT = 1
"""Bit 0 of 1001h: set with every other one."""

_MANUFACTURER_BYTES = 5
_HEX = re.compile(r"(?:[0-9A-Fa-f]{2}){0,5}")


@dataclass(frozen=True, slots=True)
class Address:
    """An object: [index, sub-index]."""

    def read(self, value: object) -> tuple[int, int]:
        """See `rules.Rule`."""
        if not isinstance(value, list) or len(value) != 2:
            raise Wrong.one(value, "write [index, sub-index], e.g. [0x6040, 0]")
        index, sub = Whole(0x1000, 0xFFFF), Whole(0, 254)
        return index.read(value[0]), sub.read(value[1])


@dataclass(frozen=True, slots=True)
class FaultTable:
    """The table [faults]: errors by the names that the bench uses."""

    def read(self, value: object) -> Mapping[str, DeviceFault]:
        """See `rules.Rule`."""
        if not isinstance(value, dict):
            raise Wrong.one(value, f"write a table of errors, e.g. over = {_EXAMPLE}")
        problems: list[Problem] = []
        faults = {}
        for name, entry in value.items():
            if not NAME.fullmatch(name):
                what = "write names of 1..32 letters, digits, _ or -"
                problems.append(Problem((name,), what))
            try:
                faults[name] = _fault(entry)
            except Wrong as wrong:
                problems += (
                    Problem((name, *one.path), one.what, one.value) for one in wrong.problems
                )
        if problems:
            raise Wrong(problems)
        return MappingProxyType(faults)


_EXAMPLE = '{ code = 0x2310, register = ["current"], manufacturer = "0102030405" }'
_FAULT_KEYS = ("code", "register", "manufacturer")


def _fault(entry: object) -> DeviceFault:
    """One error of the table."""
    if not isinstance(entry, dict):
        raise Wrong.one(entry, f"write {_EXAMPLE}")
    problems = [
        Problem((key,), f"unknown key; {near_miss(key, _FAULT_KEYS)}")
        for key in sorted(entry.keys() - set(_FAULT_KEYS))
    ]
    try:
        code = Whole(0x0001, 0xFFFF).read(entry.get("code"))
    except Wrong as wrong:
        code = 0
        problems += (Problem(("code",), one.what, one.value) for one in wrong.problems)
    register = _register(entry.get("register", []), problems)
    maker = entry.get("manufacturer", "")
    if not isinstance(maker, str) or not _HEX.fullmatch(maker):
        what = f"write up to {_MANUFACTURER_BYTES} bytes in hexadecimal digits"
        problems.append(Problem(("manufacturer",), f'{what}, e.g. "0102030405"', maker))
        maker = ""
    if problems:
        raise Wrong(problems)
    return DeviceFault(code, register, bytes.fromhex(maker).ljust(_MANUFACTURER_BYTES, b"\0"))


def _register(names: object, problems: list[Problem]) -> int:
    """The bits of 1001h; what is wrong with their names goes to `problems`."""
    if not isinstance(names, list):
        what = f"write a list of {', '.join(REGISTER_BITS)}"
        problems.append(Problem(("register",), what, names))
        return 0
    bits = GENERIC_BIT
    for name in names:
        if isinstance(name, str) and name in REGISTER_BITS:
            bits |= 1 << REGISTER_BITS[name]
        else:
            hint = near_miss(str(name), REGISTER_BITS)
            problems.append(Problem(("register",), f"no bit of 1001h; {hint}", name))
    return bits


@attrs.frozen
class _Sync:
    window_unit: Annotated[str, OneOf(tuple(WINDOW_UNITS))]


@attrs.frozen
class _Axis:
    control: Annotated[tuple[int, int], Address()]
    status: Annotated[tuple[int, int], Address()]
    set_point: Annotated[tuple[int, int], Address()]
    actual: Annotated[tuple[int, int], Address()]


@attrs.frozen
class _GenericFile:
    """The tables of a generic device's profile. Facts have no defaults; limits have."""

    device: Identity
    factory: Cia301Parameters
    sync: _Sync = attrs.field(factory=lambda: _Sync("us"))
    limits: Cia301Limits = attrs.field(factory=Cia301Limits)


@attrs.frozen
class _DriveFile:
    """The tables of a drive's profile."""

    device: Identity
    factory: Cia301Parameters
    sync: _Sync
    axis: _Axis
    faults: Annotated[Mapping[str, DeviceFault], FaultTable()]
    limits: Cia301Limits = attrs.field(factory=Cia301Limits)


@attrs.frozen(kw_only=True)
class Cia301Profile(DeviceProfile):
    """A device with an object dictionary, as its profile describes it."""

    factory: Cia301Parameters
    limits: Cia301Limits
    window_unit_ns: int
    """What one step of the synchronous window length 1007h means (SYN-05)."""

    @property
    def node_ids(self) -> range:
        """See `DeviceProfile`."""
        return CIA301_NODE_IDS


@attrs.frozen(kw_only=True)
class GenericProfile(Cia301Profile):
    """Any device that its electronic data sheet describes."""


@attrs.frozen(kw_only=True)
class DriveProfile(Cia301Profile):
    """A small axis: the objects that carry its motion."""

    control: tuple[int, int]
    status: tuple[int, int]
    set_point: tuple[int, int]
    actual: tuple[int, int]


def drive_from(document: Mapping[str, object], path: str) -> DriveProfile:
    """The drive in the tables of a file; `path` names it.

    Raises:
        ConfigError: every problem of the tables, one a line.
    """
    file = structure(document, _DriveFile)
    refuse(path, file if isinstance(file, list) else [])
    assert isinstance(file, _DriveFile)
    return DriveProfile(
        name=file.device.name,
        kind=file.device.kind,
        description=file.device.description,
        path=path,
        eds=file.device.sheet_of(path),
        factory=file.factory,
        limits=file.limits,
        window_unit_ns=WINDOW_UNITS[file.sync.window_unit],
        faults=file.faults,
        control=file.axis.control,
        status=file.axis.status,
        set_point=file.axis.set_point,
        actual=file.axis.actual,
    )


def generic_from(document: Mapping[str, object], path: str) -> GenericProfile:
    """The generic device in the tables of a file; `path` names it.

    Raises:
        ConfigError: every problem of the tables, one a line.
    """
    file = structure(document, _GenericFile)
    refuse(path, file if isinstance(file, list) else [])
    assert isinstance(file, _GenericFile)
    return GenericProfile(
        name=file.device.name,
        kind=file.device.kind,
        description=file.device.description,
        path=path,
        eds=file.device.sheet_of(path),
        factory=file.factory,
        limits=file.limits,
        window_unit_ns=WINDOW_UNITS[file.sync.window_unit],
    )
