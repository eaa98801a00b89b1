"""The requirements that a device is judged by: what they say, where, and what they weigh.

Read from the TOML files of the device's kind; nothing is kept between calls. Standard
library only, because judging from a recording needs these texts and nothing else.
"""

from __future__ import annotations

import difflib
import importlib.resources
import re
import tomllib
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from enum import Enum
from types import MappingProxyType
from typing import NamedTuple

from hil_tests.errors import ConfigError

FACILITIES = ("power", "keys", "leds", "faults", "bitrate")
"""What a requirement can need of the bench."""

ORIGINS = ("source", "cia301", "reading")

KINDS: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "keypad": ("keypad",),
        "drive": ("nmt", "sync_emcy", "cia301"),
        "generic": ("nmt", "cia301"),
    }
)
"""The catalogues that a kind of device is judged by: one file for each source."""

WITH_SHEET: Mapping[str, tuple[str, tuple[str, ...]]] = MappingProxyType(
    {
        "keypad": (
            "cia301",
            (
                *("C-OD", "C-SD-01", "C-SD-02", "C-SD-03", "C-SD-04", "C-SD-05", "C-SD-06"),
                *("C-SD-07", "C-SD-08", "C-SD-17", "C-SD-18", "C-SD-20", "C-RB-09"),
                *("C-NMT-11", "C-NMT-12", "C-NMT-14", "C-NMT-15", "C-NMT-16", "C-NMT-17"),
                *("C-HB-01", "C-HB-03", "C-HB-06", "C-HB-09"),
            ),
        ),
    }
)
"""What is asked besides of a device whose objects are known: a file, and beginnings of ids.

A keypad need not have an SDO server. Where an electronic data sheet says that it has one, it
is held to the rules of object dictionary, SDO and 1017h, but for blocks and long values; what
else it does is for its own source to say.
"""

_ID = re.compile(r"(?:C-)?[A-Z]{2,4}-[0-9]{2}")
_TEXTS = ("text", "source", "clause", "class", "origin")
_FIELDS = (*_TEXTS, "limits", "needs", "untested")


class Kind(Enum):
    """What a result outside a requirement means."""

    MUST = "must"
    """FAIL."""
    TIMING = "timing"
    """PASS, FAIL or INCONCLUSIVE: a must with limits and doubt."""
    SET = "set"
    """Several answers are accepted; FAIL outside them."""
    DERIVED = "derived"
    """An observation; FAIL with --can-strict."""
    CHOICE = "choice"
    """Recorded as a characteristic of the device, never a verdict."""


LENIENT = frozenset((Kind.DERIVED, Kind.CHOICE))
"""A device outside one of these is observed; it fails with --can-strict only."""


class LimitDefault(NamedTuple):
    """A limit of the device profile, and what it is where a profile leaves it out."""

    name: str
    """Key in the table [limits] of a profile."""
    default: str
    """With its unit, e.g. "50 ms"."""


@dataclass(frozen=True, slots=True)
class Requirement:
    """One thing that a device must do, may do, or that is written down about it."""

    id: str
    text: str
    """One or two sentences for a technician."""
    source: str
    clause: str
    """Where the source says it, for people."""
    kind: Kind
    origin: str
    """Who says so: "source", "cia301", or "reading" (ours, where both are silent)."""
    limits: tuple[LimitDefault, ...] = ()
    needs: tuple[str, ...] = ()
    """Facilities of the bench without which it is not run."""
    untested: str = ""
    """Why no acceptance test can show it; "" = one does."""


def load(kind: str) -> Mapping[str, Requirement]:
    """The requirements of a kind of device, by id, in the order of its files.

    Raises:
        ConfigError: there is no such kind, or every problem of its files, one a line.
    """
    if kind not in KINDS:
        raise ConfigError(f"no requirements for {kind!r}; there are some for: {', '.join(KINDS)}")
    return _joined(KINDS[kind])


def load_with_sheet(kind: str) -> Mapping[str, Requirement]:
    """What is asked of a kind of device besides, where it has an electronic data sheet."""
    name, beginnings = WITH_SHEET.get(kind, ("", ()))
    found = _joined((name,)) if name else {}
    return {key: each for key, each in found.items() if key.startswith(beginnings)}


def load_all() -> Mapping[str, Requirement]:
    """The requirements of every kind of device, by id.

    Raises:
        ConfigError: every problem of a file, one a line.
    """
    return _joined(dict.fromkeys(name for names in KINDS.values() for name in names))


def _joined(names: Iterable[str]) -> Mapping[str, Requirement]:
    """The requirements of some catalogues; no id stands in two of them."""
    found: dict[str, Requirement] = {}
    for name in names:
        file = importlib.resources.files(__package__).joinpath(f"{name}.toml")
        found |= parse(file.read_text("utf-8"), file.name)
    return MappingProxyType(found)


def parse(text: str, name: str) -> Mapping[str, Requirement]:
    """The requirements in a TOML text; `name` is the file's, for errors.

    Raises:
        ConfigError: every problem of the text, one a line.
    """
    try:
        document = tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        raise ConfigError(f"{name}: no TOML: {error}") from None
    problems = [line for key, value in document.items() for line in _problems(key, value)]
    if problems:
        raise ConfigError("\n".join(f"{name}: {line}" for line in problems))
    return MappingProxyType({key: _requirement(key, value) for key, value in document.items()})


def near(ids: Iterable[str], wrong: str) -> list[str]:
    """At most three of `ids` that may have been meant by `wrong`, the likeliest first.

    Letter case, blanks, underscores, a missing hyphen and missing zeros do not matter.
    """
    known = sorted(set(ids))
    plain = {_plain(name): name for name in known}
    wanted = _plain(wrong[:64])
    if wanted in plain:
        return [plain[wanted]]
    return [plain[name] for name in difflib.get_close_matches(wanted, plain, n=3, cutoff=0.6)]


def _plain(text: str) -> str:
    """An id without what people leave out or add: "hb 1" and "HB-01" become the same."""
    letters = "".join(re.findall(r"[A-Z]+", text.upper()))
    digits = "".join(re.findall(r"[0-9]+", text))
    return f"{letters}{digits.zfill(2)}"


def _requirement(key: str, table: Mapping[str, object]) -> Requirement:
    """A table that was found sound."""
    limits, needs = table.get("limits", {}), table.get("needs", [])
    assert isinstance(limits, dict)
    assert isinstance(needs, list)
    return Requirement(
        id=key,
        text=str(table["text"]),
        source=str(table["source"]),
        clause=str(table["clause"]),
        kind=Kind(table["class"]),
        origin=str(table["origin"]),
        limits=tuple(LimitDefault(*pair) for pair in limits.items()),
        needs=tuple(needs),
        untested=str(table.get("untested", "")),
    )


def _problems(key: str, table: object) -> Iterator[str]:
    """What is wrong with one entry, one line each."""
    if not _ID.fullmatch(key):
        yield f"{key!r}: is no id; write e.g. HB-01, or C-HB-01 for a rule of CiA 301"
    if not isinstance(table, dict):
        yield f"{key}: write a table, [{key}]"
        return
    for field in sorted(table.keys() - set(_FIELDS)):
        close = difflib.get_close_matches(field[:64], _FIELDS, n=1)
        yield f"{key}.{field}: unknown key; known: {', '.join(close or _FIELDS)}"
    for field in _TEXTS:
        value = table.get(field)
        if not isinstance(value, str) or not value.strip():
            yield f"{key}.{field}: write a text in quotes"
    reason = table.get("untested", "some")
    if not isinstance(reason, str) or not reason.strip():
        yield f"{key}.untested: write the reason in quotes, or leave it out"
    yield from _word_problems(key, table)


def _word_problems(key: str, table: Mapping[str, object]) -> Iterator[str]:
    """Words out of closed lists, and the shapes of limits and needs."""
    for field, words in (("class", [kind.value for kind in Kind]), ("origin", ORIGINS)):
        value = table.get(field)
        if isinstance(value, str) and value not in words:
            yield f"{key}.{field}: {value!r}: unknown; write one of {', '.join(words)}"
    needs = table.get("needs", [])
    if not isinstance(needs, list) or any(need not in FACILITIES for need in needs):
        yield f"{key}.needs: write a list of {', '.join(FACILITIES)}"
    limits = table.get("limits", {})
    if not isinstance(limits, dict) or any(not isinstance(v, str) for v in limits.values()):
        yield f'{key}.limits: write e.g. {{ command = "50 ms" }}'
