"""The device profile: what a board is, and the limits it is judged by.

Everything that the keypad's specification leaves to the hardware. The model reads the same
files with a reader of its own, so that a slip in one reader shows as a difference.
"""

from __future__ import annotations

import importlib.resources
import os
from collections.abc import Iterable, Mapping
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Annotated

import attrs

from hil_tests.clock import MS, S
from hil_tests.config.document import parse_document, read_document
from hil_tests.config.limits import SHORTEST_HEARTBEATS, HeartbeatTable, ProfileLimits
from hil_tests.config.parameters import NODE_IDS, Parameters
from hil_tests.config.reading import structure, table
from hil_tests.config.report import Problem, near_miss, refusal, refuse
from hil_tests.config.rules import BitMap, Flag, OneOf, Span, Text, Texts, Whole

KINDS = ("keypad",)
"""Kinds of device that this version has requirements for."""

_BLINK = Span(1 * MS, 60 * S)
_FRAME_BYTES = Whole(1, 8, "bytes")
_SHIPPED_IN = ("node_model", "profiles")


@attrs.frozen
class _Identity:
    name: Annotated[str, Text(60)]
    kind: Annotated[str, OneOf(KINDS, later=("drive", "generic"))]
    description: Annotated[str, Text()] = "no description"


@attrs.frozen
class _Keys:
    bits: Annotated[Mapping[str, int], BitMap()]
    commissioning: Annotated[tuple[str, ...], Texts(2, 2, distinct=True)]
    frame_bytes: Annotated[int, _FRAME_BYTES]
    releases_reported: Annotated[bool, Flag()]


@attrs.frozen
class _Leds:
    bits: Annotated[Mapping[str, int], BitMap()]
    frame_bytes: Annotated[int, _FRAME_BYTES]
    both_set: Annotated[str, OneOf(("steady", "blink"))]
    blink_on_ns: Annotated[int, _BLINK]
    blink_off_ns: Annotated[int, _BLINK]


@attrs.frozen
class _File:
    """The tables of a profile. Facts of a device have no defaults; limits have."""

    device: _Identity
    keys: _Keys
    leds: _Leds
    factory: Parameters
    limits: ProfileLimits = attrs.field(factory=ProfileLimits)
    shortest_heartbeat: Annotated[Mapping[int, int], HeartbeatTable()] = SHORTEST_HEARTBEATS


@attrs.frozen
class DeviceProfile:
    """A device as its profile describes it."""

    name: str
    kind: str
    description: str
    path: str
    """The file it was read from."""
    key_bits: Mapping[str, int]
    """Bit in the key frame by name of the key."""
    key_frame_bytes: int
    releases_reported: bool
    """False: the board reports presses only (KEY-20)."""
    commissioning_keys: frozenset[str]
    led_bits: Mapping[str, int]
    """Bit in both LED frames by name of the LED."""
    led_frame_bytes: int
    both_set: str
    """Who wins where both bits of an LED are set, "steady" or "blink" (LED-20)."""
    blink_on_ns: int
    blink_off_ns: int
    factory: Parameters
    limits: ProfileLimits
    shortest_heartbeat: Mapping[int, int]
    """Shortest heartbeat period in ns that is asked of the board, by bit/s."""

    @property
    def node_ids(self) -> range:
        """Node ids that a device of this kind can have."""
        return NODE_IDS


def load_profile(name_or_path: str) -> DeviceProfile:
    """The profile of that shipped name, or of that TOML file.

    A shipped name wins over a file of the same name; write ./NAME for the file.

    Raises:
        ConfigError: no such profile or file, or every problem of the file, one a line.
    """
    shipped = _shipped()
    if name_or_path in shipped:
        path = shipped[name_or_path]
        return profile_from(parse_document(path.read_text("utf-8"), str(path)), str(path))
    if _looks_like_a_file(name_or_path):
        return profile_from(read_document(name_or_path), name_or_path)
    hint = near_miss(name_or_path, shipped)
    what = f"no such profile; {hint}; or give a TOML file"
    raise refusal("profile", [Problem((), what, name_or_path)])


def _shipped() -> dict[str, Traversable]:
    """The profiles that come with the package, by name."""
    package, folder = _SHIPPED_IN
    files = importlib.resources.files(package).joinpath(folder).iterdir()
    found = {file.name.removesuffix(".toml"): file for file in files if _is_toml(file.name)}
    return dict(sorted(found.items()))


def _is_toml(name: str) -> bool:
    return name.lower().endswith(".toml")


def _looks_like_a_file(text: str) -> bool:
    separators = {"/", os.sep, os.altsep or os.sep}
    return _is_toml(text) or any(mark in text for mark in separators) or _exists(text)


def _exists(text: str) -> bool:
    try:
        return bool(text) and Path(text).exists()
    except (OSError, ValueError):  # too long, or with a NUL
        return False


def profile_from(document: Mapping[str, object], path: str) -> DeviceProfile:
    """The profile in the tables of a file; `path` names it.

    Raises:
        ConfigError: every problem of the tables, one a line.
    """
    file = structure(document, _File)
    problems = file if isinstance(file, list) else []
    refuse(
        path,
        [
            *problems,
            *_misfits(document, "keys"),
            *_misfits(document, "leds"),
            *_unknown_commissioning_keys(document),
        ],
    )
    assert isinstance(file, _File)
    return DeviceProfile(
        name=file.device.name,
        kind=file.device.kind,
        description=file.device.description,
        path=path,
        key_bits=file.keys.bits,
        key_frame_bytes=file.keys.frame_bytes,
        releases_reported=file.keys.releases_reported,
        commissioning_keys=frozenset(file.keys.commissioning),
        led_bits=file.leds.bits,
        led_frame_bytes=file.leds.frame_bytes,
        both_set=file.leds.both_set,
        blink_on_ns=file.leds.blink_on_ns,
        blink_off_ns=file.leds.blink_off_ns,
        factory=file.factory,
        limits=file.limits,
        shortest_heartbeat=file.shortest_heartbeat,
    )


def _misfits(document: Mapping[str, object], section: str) -> Iterable[Problem]:
    """Bits that the frame has no room for."""
    frame_bytes = table(document, section).get("frame_bytes")
    if type(frame_bytes) is not int or not 1 <= frame_bytes <= 8:
        return  # said already
    for name, bit in table(document, section, "bits").items():
        if type(bit) is int and 8 * frame_bytes <= bit <= 63:
            what = f"does not fit into {frame_bytes} byte(s): bits 0..{8 * frame_bytes - 1}; "
            yield Problem((section, "bits", name), f"{what}raise {section}.frame_bytes", bit)


def _unknown_commissioning_keys(document: Mapping[str, object]) -> Iterable[Problem]:
    """Commissioning keys that the board does not have."""
    keys = table(document, "keys", "bits")
    names = table(document, "keys").get("commissioning")
    for name in names if keys and isinstance(names, list) else ():
        if isinstance(name, str) and name not in keys:
            what = f"is no key of [keys] bits; {near_miss(name, keys)}"
            yield Problem(("keys", "commissioning"), what, name)
