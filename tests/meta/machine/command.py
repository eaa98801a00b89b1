"""Machine-made mutants: does the acceptance suite find faults that nobody had in mind?

    python -m tests.meta.machine                  every mutant of the keypad
    python -m tests.meta.machine NAME [NAME ...]  some: operation, Operation.fire, operation-17

Each mutant is the keypad with one small change in its source, served as the device under test
in virtual time. It is killed when, with --can-strict, a test fails on a requirement that is not
left to the maker. What survives on the usual keypad must stand in `equivalents.toml`, with the
reason why it is no fault, or be killed on a keypad with other hardware; and what stands there
must survive.

The mutants are made here, by few and plain operators, and not by a library: mutmut changes
functions alone, and half of a keypad is tables; cosmic-ray leaves no statement out and returns
nothing else, and changes annotations; both number what they make, so that a list of reasons
would not outlive an edit, and bring some forty packages along.
"""

from __future__ import annotations

import sys
import tempfile
import time
import tomllib
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TextIO

import pytest

from tests.meta.machine.mutating import Key, Mutant
from tests.meta.machine.serving import all_mutants
from tests.meta.machine.trial import HUNG, KILLED, SURVIVED, UNDECIDED, Result, Trials

ROOT = Path(__file__).parents[3]
HERE = Path(__file__).parent
WORKERS = 2
HARDWARE = {"keypad": "keypad", "other hardware": str(HERE / "other_hardware.toml")}
"""Name for people -> profile: the usual one, and one in which everything is different that
the source leaves to the hardware."""

EQUIVALENTS = HERE / "equivalents.toml"

Trial = Callable[[str, Sequence[Mutant], TextIO], Iterator[Result]]
"""Tries mutants on the hardware of a profile; results in order."""


def explained(path: Path = EQUIVALENTS) -> Mapping[Key, str]:
    """Mutants that are no fault -> why not.

    Raises:
        ValueError: an entry without a reason, or twice the same.
    """
    found: dict[Key, str] = {}
    for entry in tomllib.loads(path.read_text("utf-8")).get("equivalent", ()):
        module, _, function = entry["where"].partition(" ")
        key = (f"node_model.{module}", function, entry["was"], entry["becomes"])
        key_of_turn: Key = (*key, entry.get("turn", 1))
        if not entry["why"].strip():
            raise ValueError(f"{entry['where']}: {entry['becomes']!r} without a reason")
        if key_of_turn in found:
            raise ValueError(f"{entry['where']}: {entry['becomes']!r} stands there twice")
        found[key_of_turn] = entry["why"]
    return found


def chosen(names: Sequence[str], mutants: Sequence[Mutant]) -> list[Mutant]:
    """The mutants that are meant: by module, function or name; all where none is named.

    Raises:
        ValueError: a name means none.
    """
    if not names:
        return list(mutants)
    vain = [name for name in names if not any(_is_meant(each, name) for each in mutants)]
    if vain:
        raise ValueError(f"no mutant is called {', '.join(vain)}")
    return [each for each in mutants if any(_is_meant(each, name) for name in names)]


def _is_meant(mutant: Mutant, name: str) -> bool:
    module = mutant.module.rpartition(".")[2]
    named = {mutant.module, module, mutant.function, mutant.name}
    return name in named or mutant.name.endswith(f".{name}")


def try_on(profile: str, mutants: Sequence[Mutant], out: TextIO) -> Iterator[Result]:
    """Put mutants under the acceptance suite, in a pytest of their own."""
    results: list[Result] = []

    def job(trials: Trials) -> None:
        trials.survey()
        for mutant, result in zip(mutants, trials.try_all(mutants), strict=True):
            print(_row(mutant, result), file=out, flush=True)
            results.append(result)

    with tempfile.TemporaryDirectory() as folder:
        options = ["-p", "no:terminal", "-p", "no:cacheprovider", "-o", "addopts=", "-s"]
        options += ["--import-mode=importlib", "--assert=plain", f"--rootdir={ROOT}"]
        options += ["--can-strict", f"--can-reports={folder}", f"--can-profile={profile}"]
        suite = str(ROOT / "hil_tests" / "acceptance")
        status = pytest.main([*options, suite], plugins=[Trials(WORKERS, job)])
    if len(results) != len(mutants):
        raise RuntimeError(f"pytest gave up with status {status}")
    yield from results


def _row(mutant: Mutant, result: Result) -> str:
    """One line of the table."""
    where = f"{mutant.name} line {mutant.line} {mutant.function or '(module)'}"
    what = f"{mutant.was}  ->  {mutant.becomes}"
    by = result.test.rpartition("::")[2]
    told = f"{result.requirement} {by}".strip() or f"{result.tests} tests pass"
    crash = f"; the device {result.crash}" if result.crash else ""
    more = f": {result.text}" if result.outcome in {HUNG, UNDECIDED} else ""
    return f"{result.outcome:9s} {where}: {what}  |  {told}{more}{crash}, {result.seconds:.1f} s"


@dataclass(slots=True)
class Verdict:
    """What is wrong with the suite, or with the list of reasons.

    Args:
        survivors: without a reason.
        undecided: tests could not judge them, and none failed.
        stale: reasons for mutants that are killed, or that there are not.
        counts: how many there are of each outcome.
    """

    survivors: list[str] = field(default_factory=list)
    undecided: list[str] = field(default_factory=list)
    stale: list[str] = field(default_factory=list)
    counts: Counter[str] = field(default_factory=Counter)

    @property
    def lines(self) -> list[str]:
        """For the end of the table."""
        return [
            *(f"SURVIVES without a reason: {each}" for each in self.survivors),
            *(f"UNDECIDED without a reason: {each}" for each in self.undecided),
            *(f"STALE reason: {each}" for each in self.stale),
            ", ".join(f"{count} {what}" for what, count in self.counts.items()),
        ]

    @property
    def good(self) -> bool:
        """Every mutant is killed, or explained; every reason is needed."""
        return not (self.survivors or self.undecided or self.stale)


def judge(
    results: Sequence[tuple[Mutant, Result]],
    reasons: Mapping[Key, str],
    everything: Sequence[Mutant],
) -> Verdict:
    """Hold the results against the list of reasons."""
    verdict = Verdict()
    known = {each.key for each in everything}
    verdict.stale += [
        f"no such mutant: {' | '.join(map(str, key))}" for key in reasons.keys() - known
    ]
    verdict.counts["mutants"] = len(results)
    for mutant, result in results:
        text = f"{mutant.name} {mutant.function}: {mutant.was}  ->  {mutant.becomes}"
        found = result.outcome in {KILLED, HUNG}
        if found and mutant.key in reasons:
            verdict.stale.append(f"{text} is {result.outcome} by {result.test}")
        elif not found and mutant.key not in reasons:
            unexplained = {UNDECIDED: verdict.undecided, SURVIVED: verdict.survivors}
            unexplained[result.outcome].append(text)
        verdict.counts[_heading(result, explained=mutant.key in reasons)] += 1
    return verdict


def _heading(result: Result, *, explained: bool) -> str:
    if result.outcome == SURVIVED:
        return "survive with a reason" if explained else "survive without"
    if result.outcome == UNDECIDED and explained:
        return "undecided with a reason"
    if result.outcome != KILLED or not result.crash:
        return result.outcome
    return (
        "killed standing still, spun"
        if "spins" in result.crash
        else "killed standing still, crashed"
    )


@dataclass(frozen=True, slots=True)
class _Watch:
    """Time since it was made."""

    began: float = field(default_factory=time.perf_counter)

    def __str__(self) -> str:
        return f"{time.perf_counter() - self.began:.0f} s"


def main(
    names: Sequence[str],
    trial: Trial = try_on,
    reasons: Mapping[Key, str] | None = None,
    out: TextIO = sys.stdout,
) -> int:
    """Print the table; exit status 1 where a mutant survives unexplained or a reason is stale."""
    watch = _Watch()
    everything = all_mutants()
    mutants = chosen(names, everything)
    results: dict[Key, tuple[Mutant, Result]] = {}
    seconds = 0.0
    given = explained() if reasons is None else reasons
    left = mutants
    for name, profile in HARDWARE.items():
        print(f"== {len(left)} mutants on {name}", file=out, flush=True)
        for mutant, result in zip(left, trial(profile, left, out), strict=True):
            seconds += result.seconds
            results[mutant.key] = mutant, result
        left = [
            mutant
            for mutant, result in results.values()
            if result.outcome == SURVIVED and mutant.key not in given
        ]
        if not left:
            break
    verdict = judge(list(results.values()), given, everything)
    for line in verdict.lines:
        print(line, file=out)
    print(f"{watch} by the clock, {seconds:.0f} s of processor time", file=out)
    return int(not verdict.good)
