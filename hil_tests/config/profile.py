"""Finds a device profile by name or file, and hands it to the reader of its kind."""

from __future__ import annotations

import importlib.resources
import os
from collections.abc import Callable, Mapping
from importlib.resources.abc import Traversable
from pathlib import Path
from types import MappingProxyType

import attrs

from hil_tests.config.cia301 import drive_from, generic_from
from hil_tests.config.device import DeviceProfile, Identity
from hil_tests.config.document import parse_document, read_document
from hil_tests.config.keypad import KeypadProfile, keypad_from
from hil_tests.config.reading import structure, table
from hil_tests.config.report import Problem, near_miss, refusal

_SHIPPED_IN = ("node_model", "profiles")

READERS: Mapping[str, Callable[[Mapping[str, object], str], DeviceProfile]] = MappingProxyType(
    {"keypad": keypad_from, "drive": drive_from, "generic": generic_from}
)
"""The reader of each kind of device."""


_TELLING = MappingProxyType({"keys": "keypad", "leds": "keypad", "axis": "drive"})
"""Sections that only one kind of device has."""


@attrs.frozen
class _Head:
    """What must be right before anything else can be said of a profile."""

    device: Identity


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


def load_keypad(name_or_path: str) -> KeypadProfile:
    """As `load_profile`, where only a keypad will do.

    Raises:
        ConfigError: as there, or it is another kind of device.
    """
    profile = load_profile(name_or_path)
    if isinstance(profile, KeypadProfile):
        return profile
    what = f"is a {profile.kind}; this is for keypads alone"
    raise refusal("profile", [Problem((), what, name_or_path)])


def profile_from(document: Mapping[str, object], path: str) -> DeviceProfile:
    """The profile in the tables of a file; `path` names it.

    Raises:
        ConfigError: every problem of the tables, one a line; of [device] alone where nothing
            tells which kind of device it is.
    """
    kind = str(table(document, "device").get("kind"))
    if kind not in READERS:  # read on all the same, to tell everything at once
        kind = next((kind for section, kind in _TELLING.items() if section in document), "")
    if kind:
        return READERS[kind](document, path)
    head = {key: value for key, value in document.items() if key == "device"}
    problems = structure(head, _Head)
    assert isinstance(problems, list)
    raise refusal(path, problems)


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
