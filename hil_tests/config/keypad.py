"""The keypad's profile: its keys and LEDs, and the limits it is judged by.

Everything that the keypad's specification leaves to the hardware. The model reads the same
files with a reader of its own, so that a slip in one reader shows as a difference.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Annotated

import attrs

from hil_tests.clock import MS, S
from hil_tests.config.device import DeviceProfile, Identity
from hil_tests.config.limits import SHORTEST_HEARTBEATS, HeartbeatTable, KeypadLimits
from hil_tests.config.parameters import NODE_IDS, Parameters
from hil_tests.config.reading import structure, table
from hil_tests.config.report import Problem, near_miss, refuse
from hil_tests.config.rules import BitMap, Flag, OneOf, Span, Texts, Whole

_BLINK = Span(1 * MS, 60 * S)
_FRAME_BYTES = Whole(1, 8, "bytes")


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

    device: Identity
    keys: _Keys
    leds: _Leds
    factory: Parameters
    limits: KeypadLimits = attrs.field(factory=KeypadLimits)
    shortest_heartbeat: Annotated[Mapping[int, int], HeartbeatTable()] = SHORTEST_HEARTBEATS


@attrs.frozen(kw_only=True)
class KeypadProfile(DeviceProfile):
    """A keypad as its profile describes it."""

    factory: Parameters
    limits: KeypadLimits
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
    shortest_heartbeat: Mapping[int, int]
    """Shortest heartbeat period in ns that is asked of the board, by bit/s."""

    @property
    def node_ids(self) -> range:
        """See `DeviceProfile`."""
        return NODE_IDS


def keypad_from(document: Mapping[str, object], path: str) -> KeypadProfile:
    """The keypad in the tables of a file; `path` names it.

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
    return KeypadProfile(
        name=file.device.name,
        kind=file.device.kind,
        description=file.device.description,
        path=path,
        eds=file.device.sheet_of(path),
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
