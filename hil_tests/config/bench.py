"""The bench file: the bus, the device on it, and how its facilities are worked.

Format: docs/bench.md. A facility exists if its section does. What the file leaves out is
None here, because command line, environment and ini settings are asked before it.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import attrs

from hil_tests.clock import MS, S
from hil_tests.config.document import read_document
from hil_tests.config.parameters import Parameters, PartialParameters
from hil_tests.config.reading import structure, table
from hil_tests.config.report import Problem, Wrong, refuse
from hil_tests.config.rules import Flag, OneOf, Span, Text, Texts, Whole

FACILITIES = ("power", "keys", "leds", "faults", "bitrate")
"""Sections of facilities, in the order in which they are listed to users."""

_LATER_POWER = ("labgrid", "scpi")
_LONGEST_UNIX_PATH = 107
"""Bytes; Linux has room for 108 with the closing zero (unix(7))."""

_TCP = re.compile(r"tcp:(?P<host>\[[0-9A-Fa-f:.%]+\]|[^\s:\[\]]+):(?P<port>[0-9]{1,5})")

Timeout = Annotated[int | None, Span(1 * MS, 24 * 3600 * S)]
Command = Annotated[tuple[str, ...] | None, Texts(1, 50)]


@dataclass(frozen=True, slots=True)
class Address:
    """Where a control server listens: tcp:HOST:PORT or unix:PATH."""

    def read(self, value: object) -> str:
        """See `rules.Rule`."""
        text = Text(300).read(value)
        if text.startswith("unix:"):
            return _unix(text)
        found = _TCP.fullmatch(text)
        if not found:
            raise Wrong.one(value, "write tcp:HOST:PORT (IPv6: tcp:[::1]:5555) or unix:PATH")
        if not 1 <= int(found["port"]) <= 65535:
            raise Wrong.one(value, "port out of range; allowed: 1..65535")
        return text


def _unix(text: str) -> str:
    size = len(text.removeprefix("unix:").encode())
    if not 1 <= size <= _LONGEST_UNIX_PATH:
        raise Wrong.one(text, f"the path has {size} bytes; allowed: 1..{_LONGEST_UNIX_PATH}")
    return text


@attrs.frozen
class BusSection:
    """[bus]: the adapter and its channel, in python-can's words."""

    interface: Annotated[str | None, Text(60)] = None
    channel: Annotated[str | None, Text(100)] = None
    bitrate: Annotated[int | None, Whole(10_000, 1_000_000, "bit/s")] = None
    exclusive: Annotated[bool, Flag()] = False
    """Nothing else lives on this bus: garbage, broadcasts and full load may be sent."""


@attrs.frozen
class DeviceSection:
    """[device]: who is under test, and what it is commissioned to at present."""

    profile: Annotated[str | None, Text(300)] = None
    node_id: Annotated[int | None, Whole(1, 127)] = None
    parameters: PartialParameters | None = None
    serial: Annotated[str | None, Text(60)] = None
    """Serial number, as it stands on the label."""
    firmware: Annotated[str | None, Text(60)] = None

    @property
    def commissioned(self) -> Parameters | None:
        """The parameters with the node id, or None where a part of them is not known."""
        return self.parameters.complete(self.node_id) if self.parameters else None


@attrs.frozen
class ControlSection:
    """[control]: the server of every facility whose driver is "control"."""

    address: Annotated[str, Address()]


@attrs.frozen
class PowerSection:
    """[power]: the supply of the device."""

    driver: Annotated[str, OneOf(("control", "command", "operator"), later=_LATER_POWER)]
    timeout_ns: Timeout = None
    on: Command = None
    """Program and arguments that switch the supply on; driver "command" only."""
    off: Command = None


@attrs.frozen
class FacilitySection:
    """[keys], [leds] or [faults]."""

    driver: Annotated[str, OneOf(("control", "operator"))]
    timeout_ns: Timeout = None


@attrs.frozen
class BitRateSection:
    """[bitrate]: the rate of the tester's own adapter."""

    driver: Annotated[str, OneOf(("control", "interface", "operator"))]
    timeout_ns: Timeout = None


@attrs.frozen
class _Bench:
    name: Annotated[str | None, Text(60)] = None


@attrs.frozen
class _File:
    """The tables of a bench file."""

    bench: _Bench = attrs.field(factory=_Bench)
    bus: BusSection = attrs.field(factory=BusSection)
    device: DeviceSection = attrs.field(factory=DeviceSection)
    control: ControlSection | None = None
    power: PowerSection | None = None
    keys: FacilitySection | None = None
    leds: FacilitySection | None = None
    faults: FacilitySection | None = None
    bitrate: BitRateSection | None = None


@attrs.frozen
class BenchFile:
    """A bench as its file describes it; a section that the file lacks is None."""

    name: str
    path: str
    bus: BusSection
    device: DeviceSection
    control: ControlSection | None
    power: PowerSection | None
    keys: FacilitySection | None
    leds: FacilitySection | None
    faults: FacilitySection | None
    bitrate: BitRateSection | None

    @property
    def facilities(self) -> tuple[str, ...]:
        """The sections of facilities that the file has."""
        return tuple(name for name in FACILITIES if getattr(self, name) is not None)


def load_bench(path: str) -> BenchFile:
    """The bench that a file describes; without a name it is called like its file.

    Raises:
        ConfigError: the file cannot be read, or every problem of it, one a line.
    """
    return bench_from(read_document(path), path)


def bench_from(document: Mapping[str, object], path: str) -> BenchFile:
    """The bench in the tables of a file; `path` names it.

    Raises:
        ConfigError: every problem of the tables, one a line.
    """
    file = structure(document, _File)
    problems = file if isinstance(file, list) else []
    refuse(path, [*problems, *_without_server(document), *_commands(document)])
    assert isinstance(file, _File)
    sections = {name: getattr(file, name) for name in FACILITIES}
    return BenchFile(
        name=file.bench.name or Path(path).stem,
        path=path,
        bus=file.bus,
        device=file.device,
        control=file.control,
        **sections,
    )


def _without_server(document: Mapping[str, object]) -> Iterable[Problem]:
    """Facilities that are worked through a server which the file does not name."""
    if "control" in document:
        return
    for name in FACILITIES:
        if table(document, name).get("driver") == "control":
            what = 'needs [control] with address = "tcp:HOST:PORT" or "unix:PATH"'
            yield Problem((name, "driver"), what, "control")


def _commands(document: Mapping[str, object]) -> Iterable[Problem]:
    """The driver "command" needs both commands, the others take none."""
    power = table(document, "power")
    driver = power.get("driver")
    for key in ("on", "off"):
        if driver == "command" and key not in power:
            what = f'is missing; the driver "command" needs e.g. {key} = ["relay", "1", "{key}"]'
            yield Problem(("power", key), what)
        elif driver in ("control", "operator") and key in power:
            what = f'belongs to the driver "command"; remove it, or change the driver {driver}'
            yield Problem(("power", key), what, power[key])
