"""A device that an EDS file describes: all services that its objects ask for."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import ClassVar

from node_model.composition import Facts, Parts
from node_model.device import Cia301Device
from node_model.lss import BIT_RATES
from node_model.node import MS, US
from node_model.sheets import entries_of, sheet_of

WINDOW_UNITS = {"us": US, "ms": MS}
"""Unit of 1007h in ns, as profiles name it."""


@dataclass(frozen=True, slots=True)
class Factory:
    """How a device leaves the factory.

    Args:
        node_id: 1..127, or 255 for one that is to be configured over LSS.
        bit_rate: bit/s.
        heartbeat_ms: what a tester expects in 1017h; the device has what its EDS says.
    """

    node_id: int = 5
    bit_rate: int = 250_000
    heartbeat_ms: int = 0


@dataclass(frozen=True, slots=True)
class Profile:
    """What a profile says of a device with an EDS.

    Args:
        name: for people.
        eds: path of its EDS file; "" = none is known.
        factory: how it leaves the factory.
        window_unit_ns: what one step of 1007h is.
    """

    kind: ClassVar[str] = "generic"

    name: str = "generic"
    eds: str = ""
    factory: Factory = field(default_factory=Factory)
    window_unit_ns: int = US


def loads(text: str) -> Profile:
    """A profile from the text of a TOML file.

    Raises:
        ValueError, KeyError, TypeError: not TOML, or a value that the device needs is
            missing or of the wrong form.
    """
    table = tomllib.loads(text)
    device, sync = table["device"], table.get("sync", {})
    return Profile(
        device["name"],
        device.get("eds", ""),
        Factory(**table["factory"]),
        WINDOW_UNITS[sync.get("window_unit", "us")],
    )


def facts_of(profile: Profile) -> Facts:
    """What a device with that profile is.

    Raises:
        EdsError: its EDS file cannot be read.
    """
    info = sheet_of(profile.eds).info
    return Facts(
        profile.name,
        profile.factory.node_id,
        profile.factory.bit_rate,
        partial(entries_of, profile.eds),
        bit_rates=info.bit_rates or frozenset(BIT_RATES.values()),
        lss=info.lss,
        window_unit_ns=profile.window_unit_ns,
    )


def make(profile: Profile, image: bytes = b"", parts: Parts | None = None) -> Cia301Device:
    """A device, switched off."""
    return Cia301Device(facts_of(profile), image, parts)


def memory(device: Cia301Device, settings: Mapping[str, int]) -> bytes:
    """Content of the memory of such a device with these settings.

    Raises:
        TypeError: a setting that it has not.
    """
    strangers = settings.keys() - {"node_id", "bit_rate", "heartbeat_ms"}
    if strangers:
        raise TypeError(f"no setting {', '.join(sorted(strangers))}")
    return device.set_up(settings)
