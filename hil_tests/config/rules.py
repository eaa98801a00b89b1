"""What a value in a file may be: one small rule a kind of value.

A rule turns what TOML gave into what the program uses, or raises `Wrong` with the remedy.
Rules are strict: nothing is converted quietly, because a profile decides verdicts.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Protocol, TypeVar

from hil_tests.clock import parse_span, show_span
from hil_tests.config.report import Problem, Wrong, near_miss, show

Value_co = TypeVar("Value_co", covariant=True)

NAME = re.compile(r"[A-Za-z0-9_-]{1,32}")
_SHARE = re.compile(r"([0-9]{1,6})(?:\.([0-9]{1,9}))?\s*%")
_LONGEST_QUANTITY = 32
PPM_PER_PERCENT = 10_000


class Rule(Protocol[Value_co]):
    """Reads one value of a file."""

    def read(self, value: object) -> Value_co:
        """The value as the program uses it.

        Raises:
            Wrong: it is none of this kind.
        """


@dataclass(frozen=True, slots=True)
class Flag:
    """true or false."""

    def read(self, value: object) -> bool:
        """See `Rule`."""
        if isinstance(value, bool):
            return value
        raise Wrong.one(value, "write true or false, without quotes")


@dataclass(frozen=True, slots=True)
class Whole:
    """A whole number from `lowest` to `highest`, both included."""

    lowest: int
    highest: int
    unit: str = ""
    """What it counts, for the message; the file writes the bare number."""

    def read(self, value: object) -> int:
        """See `Rule`."""
        kind = f"{self.lowest}..{self.highest}{self.unit and ' '}{self.unit}"
        if isinstance(value, bool) or not isinstance(value, int):
            raise Wrong.one(value, f"write a whole number, {kind}, without quotes or unit")
        if not self.lowest <= value <= self.highest:
            raise Wrong.one(value, f"out of range; allowed: {kind}")
        return value


@dataclass(frozen=True, slots=True)
class Text:
    """Printable text on one line."""

    longest: int = 200

    def read(self, value: object) -> str:
        """See `Rule`."""
        if not isinstance(value, str):
            raise Wrong.one(value, "write a text in quotes")
        if not value.strip() or len(value) > self.longest or not value.isprintable():
            raise Wrong.one(value, f"write 1..{self.longest} printable characters on one line")
        return value


@dataclass(frozen=True, slots=True)
class OneOf:
    """One of a few words."""

    words: tuple[str, ...]
    later: tuple[str, ...] = ()
    """Words that the format knows and this version does not."""

    def read(self, value: object) -> str:
        """See `Rule`."""
        if isinstance(value, str) and value in self.words:
            return value
        choice = ", ".join(f'"{word}"' for word in self.words)
        if value in self.later:
            raise Wrong.one(value, f"not built into this version; use one of {choice}")
        known = near_miss(value, self.words) if isinstance(value, str) else f"known: {choice}"
        raise Wrong.one(value, f"unknown word; {known}")


@dataclass(frozen=True, slots=True)
class Span:
    """A time with its unit, e.g. "500 ms", as integer ns."""

    lowest_ns: int
    highest_ns: int

    def read(self, value: object) -> int:
        """See `Rule`."""
        if not isinstance(value, str):
            raise Wrong.one(value, 'a time needs quotes and a unit, e.g. "500 ms"')
        if "%" in value:
            raise Wrong.one(value, 'a share, but a time belongs here; write e.g. "5 ms"')
        span_ns = _parsed(value)
        if not self.lowest_ns <= span_ns <= self.highest_ns:
            ends = f"{show_span(self.lowest_ns)} .. {show_span(self.highest_ns)}"
            raise Wrong.one(value, f"out of range; allowed: {ends}")
        return span_ns


def _parsed(text: str) -> int:
    if len(text) > _LONGEST_QUANTITY:
        raise Wrong.one(text, 'too long for a time; write e.g. "500 ms"')
    try:
        return parse_span(text)
    except ValueError as error:
        raise Wrong.one(text, str(error).removeprefix(f"{text!r} ")) from None


@dataclass(frozen=True, slots=True)
class Share:
    """A share of a period, e.g. "5 %", as integer parts per million."""

    highest_ppm: int

    def read(self, value: object) -> int:
        """See `Rule`."""
        if not isinstance(value, str):
            raise Wrong.one(value, 'a share needs quotes and a sign, e.g. "5 %"')
        found = _SHARE.fullmatch(value.strip())
        if not found:
            raise Wrong.one(value, _no_share(value))
        ppm, rest = divmod(int(found[1] + (found[2] or "").ljust(9, "0")), 10**5)
        if rest:
            raise Wrong.one(value, "finer than 0.0001 %; round it")
        if ppm > self.highest_ppm:
            raise Wrong.one(
                value, f"out of range; allowed: 0..{self.highest_ppm / PPM_PER_PERCENT:g} %"
            )
        return ppm


def _no_share(text: str) -> str:
    try:
        parse_span(text[:_LONGEST_QUANTITY])
    except ValueError:
        return 'is no share; write a number and %, e.g. "5 %"'
    return 'a time, but a share belongs here; write e.g. "5 %"'


@dataclass(frozen=True, slots=True)
class BitMap:
    """Names and their bits in a frame of at most eight bytes; no bit has two names."""

    def read(self, value: object) -> Mapping[str, int]:
        """See `Rule`."""
        if not isinstance(value, dict) or not value:
            raise Wrong.one(value, "write a table of names and bits, e.g. { on_off = 0, aut = 1 }")
        problems: list[Problem] = []
        owners: dict[int, str] = {}
        for name, bit in value.items():
            problems += _bit_problems(name, bit, owners)
        if problems:
            raise Wrong(problems)
        return MappingProxyType(dict(value))


def _bit_problems(name: str, bit: object, owners: dict[int, str]) -> list[Problem]:
    """What is wrong with one name; notes the owner of its bit."""
    problems = []
    if not NAME.fullmatch(name):
        what = "write names of 1..32 letters, digits, _ or -"
        problems.append(Problem((name,), what, bit))
    try:
        number = Whole(0, 63).read(bit)
    except Wrong as wrong:
        return [*problems, *(Problem((name,), one.what, one.value) for one in wrong.problems)]
    owner = owners.setdefault(number, name)
    if owner != name:
        problems.append(Problem((name,), f"bit {number} is taken by {show(owner)}; one each", bit))
    return problems


@dataclass(frozen=True, slots=True)
class Texts:
    """A list of texts, e.g. a command and its arguments."""

    fewest: int
    most: int
    distinct: bool = False

    def read(self, value: object) -> tuple[str, ...]:
        """See `Rule`."""
        if not isinstance(value, list):
            raise Wrong.one(value, 'write a list of texts, e.g. ["one", "two"]')
        if not self.fewest <= len(value) <= self.most:
            count = f"{self.fewest}" if self.fewest == self.most else f"{self.fewest}..{self.most}"
            raise Wrong.one(value, f"has {len(value)} entries; allowed: {count}")
        problems = [
            Problem((str(index),), "write a text in quotes, without control characters", entry)
            for index, entry in enumerate(value)
            if not isinstance(entry, str) or "\0" in entry
        ]
        if problems:
            raise Wrong(problems)
        if self.distinct and len(set(value)) != len(value):
            raise Wrong.one(value, "names one entry twice; name each once")
        return tuple(value)
