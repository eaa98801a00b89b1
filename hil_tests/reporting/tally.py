"""Sums over the results of a run: of tests, of verdicts, and for each requirement.

Both are functions of the results alone, so a reader can work them out again.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

from hil_tests.reporting.rows import OUTCOMES, known

GRAVITY = (
    "failed",
    "error",
    "inconclusive",
    "observation",
    "passed",
    "characteristic",
    "not run",
    "not applicable",
)
"""The worst first. One test that passed says more than ten that were not run; how many there
were of each stands beside it."""

_UNFINISHED = ("error", "not run", "not applicable")
_BLAMING = ("failed", "inconclusive", "observation")

_COUNTED = ("seconds", "bus_ns", "frames", "error_frames", "losses", "lost")


def worst(outcomes: Iterable[str]) -> str:
    """The gravest of some outcomes.

    Raises:
        ValueError: there are none, or one that no report knows.
    """
    return min(outcomes, key=GRAVITY.index)


def pairs(result: Mapping[str, Any]) -> dict[str, str]:
    """What a test says of each requirement: of those that it claims, and those it judged.

    A requirement that the test judged has the worst of these verdicts. One that it claims and
    did not judge passed with a test that passed. What passed so far in a test that could not
    be ended, or was not run to its end, has not passed. Where a test failed, the claims that
    it had not come to are left open: they are not named.

    Args:
        result: of the test, as results.json has it.
    """
    judged: dict[str, list[str]] = {}
    for row in result.get("verdicts", ()):
        judged.setdefault(row["requirement"], []).append(row["outcome"])
    found = {name: worst(outcomes) for name, outcomes in judged.items() if name}
    outcome, claims = result["outcome"], result.get("requirements", ())
    if outcome in _UNFINISHED:
        found |= {name: outcome for name in claims if found.get(name, "passed") == "passed"}
    elif outcome in _BLAMING:
        if claims and outcome not in found.values():
            # An assertion of the test's own: it speaks of what the test claims first.
            found[claims[0]] = worst([outcome, found.get(claims[0], outcome)])
    else:
        found = dict.fromkeys(claims, outcome) | found
    return found


@dataclass(frozen=True, slots=True)
class Totals:
    """Sums over the results so far."""

    tests: int = 0
    outcomes: Mapping[str, int] = field(default_factory=lambda: dict.fromkeys(OUTCOMES, 0))
    verdicts: Mapping[str, int] = field(default_factory=lambda: dict.fromkeys(OUTCOMES, 0))
    sums: Mapping[str, float] = field(default_factory=lambda: dict.fromkeys(_COUNTED, 0))
    busy_ns: int = 0
    watched_ns: int = 0
    """Bus time of the tests of which `busy_ns` is known."""

    def plus(self, result: Mapping[str, Any]) -> Totals:
        """The sums with one result more.

        Raises:
            KeyError, TypeError, ValueError: no result, or an outcome that no report knows.
        """
        outcomes, verdicts = dict(self.outcomes), dict(self.verdicts)
        outcomes[known(str(result["outcome"]))] += 1
        for row in result.get("verdicts", ()):
            verdicts[known(str(row["outcome"]))] += 1
        sums = {key: self.sums[key] + (result.get(key) or 0) for key in _COUNTED}
        busy_ns, watched_ns = self.busy_ns, self.watched_ns
        if result.get("busy_ns") is not None:
            busy_ns += result["busy_ns"]
            watched_ns += result["bus_ns"]
        return Totals(self.tests + 1, outcomes, verdicts, sums, busy_ns, watched_ns)

    def to_json(self) -> dict[str, object]:
        """As plain data."""
        sums = {**self.sums, "seconds": round(self.sums["seconds"], 6)}
        load = round(self.busy_ns / self.watched_ns, 6) if self.watched_ns else None
        counts = {"tests": self.tests, **self.outcomes, "verdicts": dict(self.verdicts)}
        return {**counts, **sums, "bus_load": load}


@dataclass(slots=True)
class Standing:
    """How a requirement stands after the results so far."""

    pairs: Counter[str] = field(default_factory=Counter)
    checks: Counter[str] = field(default_factory=Counter)
    tests: list[int] = field(default_factory=list)
    """Numbers of the results that say something of it."""
    margin: Mapping[str, Any] | None = None
    """The worst one in units of its doubt, with the number of its result and what was measured."""
    narrowest: Mapping[str, Any] | None = None
    """The worst one as a share of what the limits allow."""
    characteristics: dict[str, None] = field(default_factory=dict)
    """What the device does where the source leaves it open; each text once, in order."""

    @property
    def outcome(self) -> str:
        """The worst one."""
        return worst(self.pairs)

    def to_json(self) -> dict[str, object]:
        """As plain data."""
        return {
            "outcome": self.outcome,
            "pairs": dict(self.pairs),
            "checks": dict(self.checks),
            "tests": self.tests,
            "margin": self.margin,
            "narrowest": self.narrowest,
            "characteristics": list(self.characteristics),
        }


class Tally:
    """Standings of all requirements that a run had to do with, by id."""

    def __init__(self) -> None:
        self.standings: dict[str, Standing] = {}

    def add(self, number: int, result: Mapping[str, Any]) -> list[str]:
        """Count a result.

        Args:
            number: of the result in the file.
            result: as results.json has it.

        Returns:
            The requirements whose standing changed.
        """
        found = pairs(result)
        for name, outcome in found.items():
            standing = self.standings.setdefault(name, Standing())
            standing.pairs[outcome] += 1
            standing.tests.append(number)
        for row in result.get("verdicts", ()):
            if row["requirement"]:
                _count(self.standings[row["requirement"]], number, row)
        return list(found)

    def to_json(self) -> dict[str, object]:
        """As plain data."""
        return {name: standing.to_json() for name, standing in self.standings.items()}


def _count(standing: Standing, number: int, row: Mapping[str, Any]) -> None:
    standing.checks[row["outcome"]] += 1
    if row["outcome"] == "characteristic":
        standing.characteristics[row.get("what") or row.get("text", "")] = None
    margin = row.get("margin")
    if not margin:
        return
    told = {**margin, "test": number, "what": row.get("what", "")}
    if standing.margin is None or margin["doubts"] < standing.margin["doubts"]:
        standing.margin = told
    if margin["share"] is None:
        return
    if standing.narrowest is None or margin["share"] < standing.narrowest["share"]:
        standing.narrowest = told
