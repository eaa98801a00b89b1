"""What the trials say of the suite: who killed whom, who was blamed wrongly, who does nothing.

A mutant is killed by a test that claims a requirement which the mutant violates, and fails
on such a requirement. A FAIL on a requirement that the mutant does not violate is a false
blame; the few that cannot be helped stand in `matrix.toml`, each with its reason.
"""

from __future__ import annotations

import tomllib
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from hil_tests.errors import NotAcknowledged
from hil_tests.requirements import Kind
from hil_tests.run import outcome
from node_model.faults import Mutant, Variant
from tests.meta.models import KINDS
from tests.meta.models import Kind as DeviceKind
from tests.meta.proving import Result, Suite, Trial

BAD = (outcome.FAILED, outcome.ERROR, outcome.INCONCLUSIVE)


@dataclass(frozen=True, slots=True)
class Listed:
    """What is known and has a reason.

    Args:
        idle: tests that kill no mutant.
        collateral: mutant -> requirement that it does not violate and yet fails -> reason.
    """

    idle: Mapping[str, str]
    collateral: Mapping[str, Mapping[str, str]]


def load_listed(path: Path) -> Listed:
    """The reasons in a file."""
    document: dict[str, Any] = tomllib.loads(path.read_text("utf-8"))
    return Listed(document.get("idle", {}), document.get("collateral", {}))


def function_of(test: str) -> str:
    """The name of a test without its parameters."""
    return test.partition("[")[0]


def blames(claims: Iterable[str], failed: Iterable[str], violates: Sequence[str]) -> bool:
    """Whether a test claims one of these requirements and fails on one of them."""
    return bool(set(claims) & set(violates)) and bool(set(failed) & set(violates))


def failed_in(result: Result) -> list[str]:
    """The requirements on which a test failed."""
    return [each.requirement for each in result.findings if each.outcome == outcome.FAILED]


def _plays_scenarios(test: str) -> bool:
    return test.startswith(("test_exploration.py", "test_stored_scenarios.py"))


def _crashed(result: Result) -> bool:
    """The test or the bench broke; that a device has left the bus is no fault of theirs."""
    return result.outcome == outcome.ERROR and NotAcknowledged.__name__ not in result.text


@dataclass(slots=True)
class Proof:
    """The table, and what is wrong with it.

    Args:
        kind: of the devices.
        kills: mutant -> requirement -> the tests that claim it and fail on it.
        killers: mutant -> the tests that kill it, see `blames`.
        false: mutant -> requirement that it does not violate -> tests that fail on it.
        harmed: variant -> why it was not spared.
        broken: model -> what went wrong with the run itself.
        tests: test without parameters -> the requirements that it claims.
        claims: test with parameters -> the same, where they have claims of their own.
        readings: our own readings of the source. A scenario holds what follows from a step that
            the source leaves open against the reading that the step rests on: that softens a
            verdict to an observation, and is no false blame.
    """

    kind: DeviceKind = KINDS["keypad"]
    kills: dict[str, dict[str, list[str]]] = field(default_factory=dict)
    killers: dict[str, list[str]] = field(default_factory=dict)
    false: dict[str, dict[str, list[str]]] = field(default_factory=dict)
    harmed: dict[str, list[str]] = field(default_factory=dict)
    broken: dict[str, list[str]] = field(default_factory=dict)
    tests: dict[str, tuple[str, ...]] = field(default_factory=dict)
    claims: dict[str, tuple[str, ...]] = field(default_factory=dict)
    readings: frozenset[str] = frozenset()

    def add(self, trial: Trial) -> None:
        """Take in what came of one model."""
        errors = [f"{r.test}: {r.text}" for r in trial.results if _crashed(r)]
        if trial.broken or errors:
            self.broken[trial.model] = [trial.broken] if trial.broken else errors
        if trial.model in self.kind.mutants:
            self._add_mutant(self.kind.mutants[trial.model], trial)
        else:
            harm = list(harm_of(self.kind.variants.get(trial.model), trial))
            self.harmed[trial.model] = harm

    def _add_mutant(self, mutant: Mutant, trial: Trial) -> None:
        kills: defaultdict[str, list[str]] = defaultdict(list)
        false: defaultdict[str, list[str]] = defaultdict(list)
        killers = []
        for result in trial.results:
            claims = self.claims.get(result.test) or self.tests[function_of(result.test)]
            failed = failed_in(result)
            if blames(claims, failed, mutant.violates):
                killers.append(result.test)
            for requirement in failed:
                if requirement not in mutant.violates:
                    if not (_plays_scenarios(result.test) and requirement in self.readings):
                        false[requirement].append(result.test)
                elif requirement in claims:
                    kills[requirement].append(result.test)
        self.kills[mutant.name] = dict(kills)
        self.killers[mutant.name] = killers
        self.false[mutant.name] = dict(false)

    @property
    def survivors(self) -> list[str]:
        """Mutants that nobody killed."""
        return [name for name, killers in self.killers.items() if not killers]

    def killed_by(self) -> dict[str, list[str]]:
        """Test -> the mutants that it kills, tests without parameters."""
        found: dict[str, list[str]] = {test: [] for test in self.tests}
        for mutant, killers in self.killers.items():
            for test in dict.fromkeys(map(function_of, killers)):
                found[test].append(mutant)
        return found

    def sole_killers(self) -> dict[str, list[str]]:
        """Test -> the mutants that no other test kills."""
        found: defaultdict[str, list[str]] = defaultdict(list)
        for mutant, killers in self.killers.items():
            tests = set(map(function_of, killers))
            if len(tests) == 1:
                found[tests.pop()].append(mutant)
        return dict(found)


def prove(suite: Suite, trials: Iterable[Trial]) -> Proof:
    """The table of some trials."""
    kinds = suite.plan.requirements.items()
    proof = Proof(
        kind=KINDS[suite.plan.profile.kind],
        claims={case.test: case.claims for case in suite.cases},
        readings=frozenset(name for name, each in kinds if each.kind is Kind.DERIVED),
    )
    for case in suite.cases:
        name = function_of(case.test)
        known = proof.tests.get(name, ())
        proof.tests[name] = tuple(dict.fromkeys((*known, *case.claims)))
    for trial in trials:
        proof.add(trial)
    return proof


def harm_of(variant: Variant | None, trial: Trial) -> Iterator[str]:
    """Every verdict on a conforming model that is not right, but for what it departs from."""
    departs = variant.departs if variant else ()
    for result in trial.results:
        wrong = [each for each in result.findings if each.outcome in BAD]
        if result.outcome in BAD and not wrong:
            yield f"{result.test}: {result.outcome}: {result.text}"
        for finding in wrong:
            if finding.requirement not in departs:
                yield f"{result.test}: {finding.text}"


def without_mutant(kind: DeviceKind) -> list[str]:
    """Requirements that are to be proven, and that no mutant violates."""
    violated = {name for mutant in kind.mutants.values() for name in mutant.violates}
    return [name for name in kind.proven() if name not in violated]


def problems(proof: Proof, listed: Listed, *, whole: bool) -> Iterator[str]:
    """What fails the build, a line each.

    Args:
        proof: the table.
        listed: what is known and has a reason.
        whole: every mutant and every variant was tried; only then can tests be idle, and
            reasons be stale.
    """
    mutants = proof.kind.mutants
    for name, errors in proof.broken.items():
        yield f"broken: {name or proof.kind.title}: {errors[0]}" + (
            f" (and {len(errors) - 1} more)" * bool(errors[1:])
        )
    for name in proof.survivors:
        yield f"survivor: {name} violates {', '.join(mutants[name].violates)}; nobody says so"
    for name, harm in proof.harmed.items():
        if harm:
            yield f"harmed: {name or proof.kind.title}: {harm[0]} ({len(harm)} in all)"
    yield from _false_blames(proof, listed, whole=whole)
    if whole:
        yield from (f"no mutant: {name}" for name in without_mutant(proof.kind))
        yield from _idle(proof, listed)


def _false_blames(proof: Proof, listed: Listed, *, whole: bool) -> Iterator[str]:
    for name, false in proof.false.items():
        known = listed.collateral.get(name, {})
        for requirement, tests in false.items():
            if requirement not in known:
                yield f"false blame: {name} does not violate {requirement}; {_some(tests)} says so"
        for requirement in known:
            if requirement not in false:
                yield f"stale reason: {name} is not blamed for {requirement} any more"
    if whole:
        for name in listed.collateral.keys() - proof.kind.mutants.keys():
            yield f"stale reason: there is no mutant {name}"


def _idle(proof: Proof, listed: Listed) -> Iterator[str]:
    """Tests that kill nothing, though they claim what is to be proven."""
    proven = set(proof.kind.proven())
    idle = {
        test
        for test, mutants in proof.killed_by().items()
        if not mutants and proven.intersection(proof.tests[test])
    }
    yield from (f"idle: {test} kills no mutant" for test in sorted(idle - listed.idle.keys()))
    for test in sorted(listed.idle.keys() - idle):
        yield f"stale reason: {test} is not idle" if test in proof.tests else f"no test {test}"


def _some(tests: Sequence[str]) -> str:
    more = len(tests) - 1
    return f"{tests[0]} and {more} more" if more else tests[0]
