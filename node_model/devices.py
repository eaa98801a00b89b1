"""The one place that makes a device: its kind, its facts, a fault, its memory.

A profile is read once, into a `Blueprint`; devices are then made from it, as many as are
needed. The virtual bench and the host both come here.
"""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from importlib import resources
from pathlib import Path
from types import MappingProxyType
from typing import Any, Generic, TypeVar

from node_model import drive, generic, keypad
from node_model.keypad.parameters import NODE_IDS
from node_model.node import Panel
from node_model.sheets import located, sheet_of
from node_model.storage import RecordStore

Settings = Mapping[str, int]
"""What a device is set to: `node_id`, `heartbeat_ms`, and what else its kind has: `bit_rate`
in bit/s of a drive; `bit_rate_code`, `sync_time`, `debounce` of a keypad."""

Maker = Callable[[Any, bytes], Panel]
"""Builds a device from the facts of its kind and the content of its memory."""

F = TypeVar("F")


class UnknownDeviceError(ValueError):
    """No such profile, model or setting; the text names what there is."""


@dataclass(frozen=True, slots=True)
class Kind(Generic[F]):
    """What there is to know of a kind of device.

    Args:
        name: as in [device] of a profile.
        loads: facts from the text of a profile.
        make: a right device from facts and the content of its memory.
        memory: content of the memory of one that was set to these settings.
        node_ids: node ids that it can have.
        with_node_id: the facts with another node id as it leaves the factory.
        needs_sheet: it is made from an EDS file; a keypad may be given one.
    """

    name: str
    loads: Callable[[str], F]
    make: Maker
    memory: Callable[[F, Settings], bytes]
    node_ids: range
    with_node_id: Callable[[F, int], F]
    needs_sheet: bool = True


@dataclass(frozen=True, slots=True)
class Blueprint(Generic[F]):
    """A kind of device with its facts, right or with a fault: what is left is to make one.

    Args:
        kind: its kind.
        facts: what its profile says.
        maker: builds the right one, or one with a fault or a difference.
    """

    kind: Kind[F]
    facts: F
    maker: Maker
    memories: dict[tuple[tuple[str, int], ...], bytes] = field(default_factory=dict, compare=False)
    """What `memory` has found: a bench makes many devices with few memories."""

    def make(self, image: bytes = b"") -> Panel:
        """A device, switched off.

        Args:
            image: content of its memory; b"" = as it left the factory.
        """
        return self.maker(self.facts, image)

    def memory(self, settings: Settings) -> bytes:
        """Content of the memory of a device that was set to these settings.

        Raises:
            UnknownDeviceError: a setting that its kind has not.
        """
        key = tuple(sorted(settings.items()))
        try:
            if key not in self.memories:
                self.memories[key] = self.kind.memory(self.facts, settings)
            return self.memories[key]
        except (TypeError, ValueError) as error:
            raise UnknownDeviceError(f"a {self.kind.name} is not set up so: {error}") from None

    def with_node_id(self, node_id: int) -> Blueprint[F]:
        """The same, with another node id as it leaves the factory.

        Raises:
            UnknownDeviceError: its kind cannot have that node id.
        """
        ids = self.kind.node_ids
        if node_id not in ids:
            raise UnknownDeviceError(
                f"node id {node_id} is none of a {self.kind.name}, {ids[0]}..{ids[-1]}"
            )
        return replace(self, facts=self.kind.with_node_id(self.facts, node_id), memories={})


def memory_with(record: bytes) -> bytes:
    """Content of a memory in which this record was stored long ago."""
    store = RecordStore(len(record), byte_ns=0)
    store.save(record, 0)
    store.advance(0)
    return bytes(store.memory)


def _keypad_memory(_: keypad.Profile, settings: Settings) -> bytes:
    return memory_with(keypad.Parameters(**settings).encode())


def _drive_memory(facts: drive.Profile, settings: Settings) -> bytes:
    return generic.memory(drive.Drive(facts), settings)


def _generic_memory(facts: generic.Profile, settings: Settings) -> bytes:
    return generic.memory(generic.make(facts), settings)


def _node_id(facts: Any, node_id: int) -> Any:
    return replace(facts, factory=replace(facts.factory, node_id=node_id))


IDS = range(1, 128)
KEYPAD: Kind[keypad.Profile] = Kind(
    "keypad",
    keypad.loads,
    keypad.Keypad,
    _keypad_memory,
    NODE_IDS,
    _node_id,
    needs_sheet=False,
)
DRIVE: Kind[drive.Profile] = Kind("drive", drive.loads, drive.Drive, _drive_memory, IDS, _node_id)
GENERIC: Kind[generic.Profile] = Kind(
    "generic", generic.loads, generic.make, _generic_memory, IDS, _node_id
)
KINDS: Mapping[str, Kind[Any]] = MappingProxyType(
    {kind.name: kind for kind in (KEYPAD, DRIVE, GENERIC)}
)
"""Kinds of device by name."""


def read(profile: str, model: str | None = None, eds: str | None = None) -> Blueprint[Any]:
    """The blueprint of a device.

    Args:
        profile: name of a bundled profile, or path of a TOML file.
        model: name of a mutant or variant of `node_model.faults`; None = the right device.
        eds: path of an EDS file that takes the place of the profile's.

    Raises:
        UnknownDeviceError: no such profile, kind, model or EDS file; one that is not usable.
    """
    text, folder = _text_of(profile)
    try:
        kind = _kind_of(text)
        facts = kind.loads(text)
    except (KeyError, ValueError, TypeError) as error:
        raise UnknownDeviceError(
            f"profile {profile!r} is not usable: {type(error).__name__}: {error}"
        ) from None
    if kind.needs_sheet or eds or facts.eds:
        facts = replace(facts, eds=_sheet_path(profile, eds or "", facts.eds, folder))
    return Blueprint(kind, facts, kind.make if model is None else _maker(model, kind.name))


def _sheet_path(profile: str, asked: str, named: str, folder: Path) -> str:
    """Where the EDS file is; it is read, and kept."""
    if not asked and not named:
        raise UnknownDeviceError(
            f"profile {profile!r} names no EDS file: give one with --eds FILE"
        )
    path = asked or located(named, folder)
    try:
        sheet_of(path)
    except ValueError as error:
        raise UnknownDeviceError(str(error)) from None
    return path


def _text_of(profile: str) -> tuple[str, Path]:
    """The text of a profile, and the folder that it is in."""
    bundled = Path(str(resources.files("node_model.profiles") / f"{profile}.toml"))
    path = bundled if bundled.is_file() else Path(profile)
    try:
        return path.read_text("utf-8"), path.parent
    except OSError:
        raise UnknownDeviceError(f"no profile {profile!r}: a bundled name or a file") from None


def _kind_of(text: str) -> Kind[Any]:
    name = tomllib.loads(text)["device"]["kind"]
    if name not in KINDS:
        raise ValueError(f"no kind of device {name!r}; there are {', '.join(KINDS)}")
    return KINDS[name]


def _maker(model: str, kind: str) -> Maker:
    """What builds a mutant or variant."""
    from node_model import faults  # noqa: PLC0415 - loaded only for a mutant

    try:
        return faults.find(model, kind).make
    except ValueError as error:
        raise UnknownDeviceError(str(error)) from None


def make_device(
    profile: str,
    *,
    model: str | None = None,
    node_id: int | None = None,
    settings: Settings | None = None,
    image: bytes | None = None,
    eds: str | None = None,
) -> Panel:
    """A device, switched off.

    Args:
        profile: name of a bundled profile, or path of a TOML file.
        model: name of a mutant or variant; None = the right device.
        node_id: as it leaves the factory; None = the profile's.
        settings: what it was set to, in its memory; None = nothing.
        image: content of its memory instead; None = as `settings` say.
        eds: path of an EDS file that takes the place of the profile's.

    Raises:
        UnknownDeviceError: there is no such profile, model, node id or setting.
    """
    blueprint = read(profile, model, eds)
    if node_id is not None:
        blueprint = blueprint.with_node_id(node_id)
    if image is None and settings is not None:
        image = blueprint.memory(settings)
    return blueprint.make(image or b"")
