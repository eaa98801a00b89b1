"""The facts of a keypad that its source leaves to the hardware, read from a TOML profile.

The device's reader: it takes what it needs to behave and trusts the rest; the tester has
a reader of its own that checks every key and reports all errors at once.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from importlib import resources
from pathlib import Path
from typing import ClassVar

from node_model.keypad.parameters import Parameters
from node_model.node import MS, US, S

_UNITS = {"ns": 1, "us": US, "ms": MS, "s": S}


def _span(text: str) -> int:
    """A span like "500 ms" in ns; a whole number and a unit."""
    number, unit = text.split()
    return int(number) * _UNITS[unit]


@dataclass(frozen=True, slots=True)
class Profile:
    """Keys, LEDs and factory settings of a keypad. Masks have a bit for each key or LED."""

    kind: ClassVar[str] = "keypad"

    name: str = "keypad"
    eds: str = ""
    """Path of the EDS file whose objects it has; "" = that of the shipped keypad."""
    keys: Mapping[str, int] = field(default_factory=dict)
    key_bytes: int = 1
    releases_reported: bool = True
    commissioning_keys: frozenset[str] = frozenset()
    leds: Mapping[str, int] = field(default_factory=dict)
    led_bytes: int = 1
    steady_wins: bool = True
    blink_on_ns: int = 500 * MS
    blink_off_ns: int = 500 * MS
    factory: Parameters = field(default_factory=Parameters)

    @property
    def led_mask(self) -> int:
        """All bits that have an LED."""
        return sum(1 << bit for bit in self.leds.values())


def loads(text: str) -> Profile:
    """A profile from the text of a TOML file.

    Raises:
        ValueError, KeyError: not TOML, or a value that the device needs is missing or of
            the wrong form.
    """
    table = tomllib.loads(text)
    keys, leds = table["keys"], table["leds"]
    return Profile(
        name=table["device"]["name"],
        eds=table["device"].get("eds", ""),
        keys=dict(keys["bits"]),
        key_bytes=keys["frame_bytes"],
        releases_reported=keys["releases_reported"],
        commissioning_keys=frozenset(keys["commissioning"]),
        leds=dict(leds["bits"]),
        led_bytes=leds["frame_bytes"],
        steady_wins=leds["both_set"] == "steady",
        blink_on_ns=_span(leds["blink_on"]),
        blink_off_ns=_span(leds["blink_off"]),
        factory=Parameters(**table["factory"]),
    )


def load(name: str = "keypad") -> Profile:
    """A bundled profile by name, or a file by its path.

    Raises:
        OSError: no such file.
        ValueError, KeyError: see `loads`.
    """
    bundled = resources.files("node_model.profiles") / f"{name}.toml"
    text = bundled.read_text("utf-8") if bundled.is_file() else Path(name).read_text("utf-8")
    return loads(text)
