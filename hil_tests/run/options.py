"""The options of the plugin: one table for command line, environment and ini file.

Precedence: command line, environment, ini, bench file, built-in default. Every value
remembers where it came from, and the header of a run says so.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

PREFIX = "nodeproof_"
_YES = frozenset(("1", "yes", "true", "on"))
_SEVERAL = frozenset(("list", "lines"))
_INI_TYPES = {"list": "args", "lines": "linelist", "switch": "bool"}
"""pytest's words; all other kinds are strings there."""
_NO = frozenset(("0", "no", "false", "off", ""))


@dataclass(frozen=True, slots=True)
class Option:
    """One option.

    Args:
        name: on the command line, without dashes, e.g. "can-iface".
        help: for a bench technician.
        metavar: what stands behind it; "" = a switch.
        kind: "text", "int", "switch", "list" (of words) or "lines".
        choices: the only values; () = any.
        default: where nobody says anything.
    """

    name: str
    help: str
    metavar: str = ""
    kind: str = "text"
    choices: tuple[str, ...] = ()
    default: Any = None

    @property
    def dest(self) -> str:
        """Its attribute in pytest's options."""
        return PREFIX + self.name.replace("-", "_")

    @property
    def key(self) -> str:
        """Its key in an ini file and in the settings."""
        return self.name.replace("-", "_")

    @property
    def variable(self) -> str:
        """Its environment variable."""
        return f"NODEPROOF_{self.key.upper()}"


OPTIONS = (
    Option(
        "can-iface",
        "CAN channel to test on, e.g. vcan0, can0, PCAN_USBBUS1; left out: model and bus in"
        " virtual time, no hardware needed",
        "NAME",
    ),
    Option(
        "can-interface",
        "kind of CAN adapter, in python-can's words: socketcan, pcan, kvaser, udp_multicast ...",
        "TYPE",
    ),
    Option("can-bitrate", "bit rate of the bus in bit/s, to set or to assume", "N", "int"),
    Option(
        "can-device",
        "who is under test: 'model' = the bundled one, in a process of its own; 'external' = your"
        " device; default: model on vcan*, virtual and udp_multicast, else external",
        "WHO",
        choices=("model", "external"),
    ),
    Option(
        "can-profile",
        "facts and limits of the device: a bundled name (keypad, drive, generic) or a TOML file",
        "NAME|FILE",
        default="keypad",
    ),
    Option("can-node-id", "node id of the device; overrides bench file and profile", "N", "int"),
    Option(
        "can-serial",
        "serial number of the device, as it stands on its label: its runs are kept together by it",
        "TEXT",
    ),
    Option("can-firmware", "firmware version of the device, for the history of its runs", "TEXT"),
    Option(
        "can-eds", "EDS file of the device; a generic one needs it, a keypad may have one", "FILE"
    ),
    Option(
        "can-bench",
        "bench file (TOML): bus, device, and how power, keys, LEDs and bit rate are moved",
        "FILE",
    ),
    Option(
        "can-clause",
        "only requirements whose id begins so, e.g. HB or KEY-04; may be repeated",
        "ID",
        "list",
    ),
    Option("can-strict", "observations (our own readings of the source) fail, too", kind="switch"),
    Option(
        "can-require-all",
        "tests that are not run or not applicable fail, too: nothing may stay unseen",
        kind="switch",
    ),
    Option(
        "can-allow-writes",
        "allow tests that write the non-volatile memory or the bit rate of an external device;"
        " what was there is put back",
        kind="switch",
    ),
    Option(
        "can-mutant",
        "put a named faulty (or deliberately different) model under test, to see the suite react;"
        " 'list' names them all",
        "NAME",
    ),
    Option(
        "can-seed",
        "seed of everything random; the same seed repeats a run (default 0; on a real bus the"
        " date, e.g. 20261126)",
        "N",
        "int",
        default=0,
    ),
    Option(
        "can-budget",
        "real benches: time for stored scenarios, e.g. 3min; the most telling ones that fit are"
        " played, the others are named (default 10min)",
        "TIME",
    ),
    Option(
        "can-scenario",
        "play this scenario, as a finding printed it, and nothing else; may be repeated",
        "TEXT",
        "lines",
    ),
    Option(
        "can-replay",
        "judge a recorded run again: its folder, or traces of it; nothing is moved, limits are"
        " those given now; may be repeated",
        "RUN|TRACE",
        "lines",
    ),
    Option(
        "can-report-pdf",
        "write certificate.pdf, too: verdict and requirements, for a signature (extra: pdf)",
        kind="switch",
    ),
    Option(
        "can-reports",
        "folder in which each run gets a folder of its own",
        "DIR",
        default="reports",
    ),
)


TAKE_VALUES = frozenset(f"--{option.name}" for option in OPTIONS if option.kind != "switch")
"""Words of the command line that the next word belongs to."""


@dataclass(frozen=True, slots=True)
class Settings:
    """What was chosen, and who chose it."""

    values: Mapping[str, Any]
    origins: Mapping[str, str]

    def __getitem__(self, key: str) -> Any:
        return self.values[key]

    def chosen(self) -> list[str]:
        """Every setting that is not a default, with its origin, for the header."""
        return [
            f"{key.replace('_', '-')} {self.values[key]} ({origin})"
            for key, origin in self.origins.items()
            if origin != "default"
        ]


def register(parser: pytest.Parser) -> None:
    """Tell pytest of every option and of its ini twin."""
    group = parser.getgroup("nodeproof", "nodeproof: acceptance test of a CANopen device")
    for option in OPTIONS:
        text = option.help + f" [env {option.variable}, ini {option.key}]"
        extra: dict[str, Any] = {"dest": option.dest, "default": None, "help": text}
        if option.kind == "switch":
            extra["action"] = "store_true"
        else:
            extra["metavar"] = option.metavar
            if option.kind in _SEVERAL:
                extra["action"] = "append"
            elif option.kind == "int":
                extra["type"] = int
            elif option.choices:
                extra["choices"] = option.choices
        group.addoption(f"--{option.name}", **extra)
        kind: Any = _INI_TYPES.get(option.kind, "string")
        parser.addini(option.key, option.help, type=kind, default=None)


def respelled(words: Sequence[str], folder: Path) -> list[str] | None:
    """The command line with `--can-x FILE` as `--can-x=FILE`; None where nothing must change.

    Before pytest knows of our options it takes every word that is a path for a place to look
    for tests, and with it for the place of its ini file. A bench file elsewhere would so lead
    it away from the tests of this folder.

    Args:
        words: the command line.
        folder: where it was given.
    """
    found, misleads, rest = [], False, iter(words)
    for word in rest:
        value = next(rest, None) if word in TAKE_VALUES else None
        if value is None:
            found.append(word)
            continue
        found.append(f"{word}={value}")
        misleads |= _is_there(folder, value)
    return found if misleads else None


def _is_there(folder: Path, name: str) -> bool:
    try:
        return (folder / name).exists()
    except (OSError, ValueError):  # no name that a file can have
        return False


def wants_mutant_list(config: pytest.Config) -> bool:
    """Whether all that was asked for is the list of mutants."""
    option = next(each for each in OPTIONS if each.key == "can_mutant")
    return bool(_find(config, option)[0] == "list")


def settle(config: pytest.Config) -> Settings:
    """Find out what was chosen.

    Raises:
        pytest.UsageError: values of environment or ini that are none; all of them at once.
    """
    values: dict[str, Any] = {}
    origins: dict[str, str] = {}
    wrong: list[str] = []
    for option in OPTIONS:
        try:
            values[option.key], origins[option.key] = _find(config, option)
        except ValueError as error:
            wrong.append(str(error))
    wrong += _out_of_range(values, origins)
    if wrong:
        raise pytest.UsageError("\n".join(wrong))
    return Settings(values, origins)


def _find(config: pytest.Config, option: Option) -> tuple[Any, str]:
    given = config.getoption(option.dest)
    if given is not None:
        return given, "command line"
    if option.variable in os.environ:
        name = f"environment variable {option.variable}"
        return _parse(option, os.environ[option.variable], name), "environment"
    written = config.getini(option.key)
    if written not in {None, ""} if not isinstance(written, list) else written:
        return _parse(option, written, f"ini setting {option.key}"), "ini"
    empty: Any = [] if option.kind in _SEVERAL else False
    return empty if option.kind in _INI_TYPES else option.default, "default"


def _parse(option: Option, text: Any, where: str) -> Any:
    if not isinstance(text, str):
        return text
    parsers: dict[str, Callable[[str], Any]] = {
        "int": _whole,
        "switch": _switch,
        "list": str.split,
        "lines": str.splitlines,
        "text": str,
    }
    try:
        value = parsers[option.kind](text)
    except ValueError as error:
        raise ValueError(f"{where} = {text!r}: {error}") from None
    if option.choices and value not in option.choices:
        raise ValueError(f"{where} = {text!r}: choose from {', '.join(option.choices)}")
    return value


def _whole(text: str) -> int:
    try:
        return int(text)
    except ValueError:
        raise ValueError("write a whole number") from None


def _switch(text: str) -> bool:
    word = text.strip().lower()
    if word in _YES or word in _NO:
        return word in _YES
    raise ValueError("write yes or no")


_RANGES = {
    "can_node_id": (1, 127),
    "can_bitrate": (10_000, 1_000_000),
    "can_seed": (0, (1 << 63) - 1),
}


def _out_of_range(values: Mapping[str, Any], origins: Mapping[str, str]) -> list[str]:
    wrong = []
    for key, (low, high) in _RANGES.items():
        value = values.get(key)
        if value is not None and not low <= value <= high:
            name = key.replace("_", "-")
            wrong.append(
                f"--{name} {value} (from {origins[key]}): out of range; allowed {low} .. {high}"
            )
    return wrong
