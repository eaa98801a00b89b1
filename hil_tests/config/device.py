"""What a profile of every kind of device says: who it is, where it starts, what it is held to."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated

import attrs

from hil_tests.config.limits import DeviceLimits
from hil_tests.config.parameters import Setup
from hil_tests.config.rules import OneOf, Text

KINDS = ("keypad", "drive", "generic")
"""Kinds of device that there are requirements for."""


@attrs.frozen
class Identity:
    """The table [device] of a profile."""

    name: Annotated[str, Text(60)]
    kind: Annotated[str, OneOf(KINDS)]
    description: Annotated[str, Text()] = "no description"
    eds: Annotated[str | None, Text(300)] = None
    """Electronic data sheet: a path relative to the profile."""

    def sheet_of(self, path: str) -> str | None:
        """Where the data sheet lies: beside the profile at `path`, unless it says otherwise."""
        return None if self.eds is None else str(Path(path).parent / self.eds)


@attrs.frozen
class DeviceFault:
    """An error that a bench can raise and heal.

    Args:
        code: emergency error code.
        register: everything that it sets in 1001h, the generic bit included.
        manufacturer: byte 3 to 7 of its EMCY.
    """

    code: int
    register: int
    manufacturer: bytes


@attrs.frozen(kw_only=True)
class DeviceProfile:
    """A device as its profile describes it; each kind adds what it has besides."""

    name: str
    kind: str
    description: str
    path: str
    """The file it was read from."""
    eds: str | None = None
    """Path of its electronic data sheet, where it has one."""
    factory: Setup
    """What it is set to when nobody has changed anything."""
    limits: DeviceLimits
    key_bits: Mapping[str, int] = attrs.field(factory=dict)
    """Keys that a bench can move, by name; none where the kind has none."""
    led_bits: Mapping[str, int] = attrs.field(factory=dict)
    """LEDs that a bench can look at, by name."""
    faults: Mapping[str, DeviceFault] = attrs.field(factory=dict)
    """Errors that a bench can raise, by name."""

    @property
    def node_ids(self) -> range:
        """Node ids that a device of this kind can have."""
        raise NotImplementedError
