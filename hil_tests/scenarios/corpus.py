"""Stored scenarios: for every known fault one that shows it, and every finding of the past.

On a real bench they take the place of exploration. They are data: `corpus/KIND.toml`, a list
of tables with the line of text, the requirements that it is about, and what it is known to
find.
"""

from __future__ import annotations

import importlib.resources
import tomllib
from collections.abc import Collection, Mapping, Sequence
from typing import NamedTuple

from hil_tests.clock import MS, S
from hil_tests.errors import ConfigError
from hil_tests.scenarios.scenario import Scenario, scenario

_START_NS = 1500 * MS
"""What a power cycle and a start take on a real bench, about."""

_LOOK_NS = 2500 * MS
_COMMISSION_NS = 4 * S
"""Bringing a device to other parameters, and back again."""

_CLAIMS: Mapping[str, tuple[str, ...]] = {
    "keys": ("KEY-06",),
    "nmt": ("NMT-07",),
    "led": ("LED-01",),
    "blink": ("LED-02",),
    "request": ("COM-05",),
    "power": ("NMT-02",),
    "send": ("ROB-01",),
    "load": ("ROB-03",),
}
"""What a scenario with a verb is about, where nobody says."""


class Stored(NamedTuple):
    """A scenario that is kept.

    Args:
        name: short, unique in its file.
        scenario: what to play.
        claims: ids of the requirements that it is about.
        finds: names of the faulty models that it is known to show.
    """

    name: str
    scenario: Scenario
    claims: tuple[str, ...]
    finds: tuple[str, ...]

    @property
    def cost_ns(self) -> int:
        """About how long it takes on a real bench."""
        steps = self.scenario.steps
        starts = 1 + sum(step.verb == "power" and step.what == "on" for step in steps)
        looks = sum(step.verb == "look" for step in steps)
        span = self.scenario.span_ns + starts * _START_NS + looks * _LOOK_NS
        return span + (_COMMISSION_NS if self.scenario.given or self.scenario.writes else 0)


def claims_of(story: Scenario) -> tuple[str, ...]:
    """What a scenario is about, judged by its verbs."""
    verbs = {step.verb for step in story.steps}
    found = [claim for verb, claims in _CLAIMS.items() if verb in verbs for claim in claims]
    return tuple(found) or ("HB-01",)


def stored(kind: str) -> tuple[Stored, ...]:
    """The scenarios for devices of a kind; none where there is no file.

    Raises:
        ConfigError: a file that cannot be read; names the entry and what is wrong with it.
    """
    path = importlib.resources.files("hil_tests.scenarios").joinpath("corpus", f"{kind}.toml")
    if not path.is_file():
        return ()
    return parsed(path.read_text("utf-8"), str(path))


def parsed(text: str, where: str) -> tuple[Stored, ...]:
    """The scenarios in the text of a file.

    Raises:
        ConfigError: it is no such file; all that is wrong with it.
    """
    try:
        document = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise ConfigError(f"{where}: {error}") from None
    tables = document.pop("scenario", [])
    if document or not isinstance(tables, list):
        raise ConfigError(f"{where}: write tables [[scenario]], and nothing besides")
    found: list[Stored] = []
    wrong: list[str] = []
    for index, table in enumerate(tables):
        try:
            found.append(_entry(table))
        except (KeyError, TypeError, ValueError) as error:
            wrong.append(f"{where}: scenario {index + 1}: {_said(error)}")
    names = [each.name for each in found]
    wrong += [f"{where}: two scenarios are called {n!r}" for n in set(names) if names.count(n) > 1]
    if wrong:
        raise ConfigError("\n".join(sorted(wrong)))
    return tuple(found)


def _said(error: Exception) -> str:
    return f"{error} is missing" if isinstance(error, KeyError) else str(error)


def _entry(table: object) -> Stored:
    if not isinstance(table, dict):
        raise TypeError(f"{table!r} is no table")
    unknown = set(table) - {"name", "play", "claims", "finds"}
    if unknown:
        raise ValueError(f"unknown key {', '.join(sorted(unknown))}")
    story = scenario(_text(table["play"]))
    claims = _names(table.get("claims", [])) or claims_of(story)
    return Stored(_text(table["name"]), story, claims, _names(table.get("finds", [])))


def _text(value: object) -> str:
    if not isinstance(value, str):
        raise TypeError(f"{value!r} is no text")
    return value


def _names(value: object) -> tuple[str, ...]:
    if not isinstance(value, list):
        raise TypeError(f"{value!r} is no list of names")
    return tuple(map(_text, value))


def written(entries: Sequence[Stored]) -> str:
    """The text of a file with these entries."""
    lines = ["# Scenarios that show faults: written by `nodeproof distil`, added to by hand."]
    for each in entries:
        lines += [
            "",
            "[[scenario]]",
            f'name = "{each.name}"',
            f'play = "{each.scenario}"',
            f"claims = [{_quoted(each.claims)}]",
            f"finds = [{_quoted(each.finds)}]",
        ]
    return "\n".join(lines) + "\n"


def _quoted(names: Sequence[str]) -> str:
    return ", ".join(f'"{name}"' for name in names)


def choose(entries: Sequence[Stored], budget_ns: int) -> list[Stored]:
    """The most telling scenarios that fit a time: most new faults a second, one after another.

    What shows nothing that others do not show is taken last, cheapest first.
    """
    left, chosen, known = list(entries), [], set[str]()
    while left:
        best = max(left, key=lambda each: _worth(each, known))
        left.remove(best)
        if best.cost_ns <= budget_ns:
            budget_ns -= best.cost_ns
            chosen.append(best)
            known |= set(best.finds)
    return [each for each in entries if each in chosen]


def _worth(each: Stored, known: Collection[str]) -> tuple[float, int]:
    new = len(set(each.finds) - set(known))
    return new / each.cost_ns, -each.cost_ns


def is_timed(each: Stored) -> bool:
    """Whether it needs a wire with arbitration and bit times."""
    return any(step.verb == "load" for step in each.scenario.steps)
