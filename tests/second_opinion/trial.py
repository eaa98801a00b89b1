"""The acceptance suite on a device that nobody here wrote: what it found, by requirement."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

from hil_tests.bench.kinds import bench_for
from hil_tests.bench.virtual import VirtualStage
from hil_tests.run import outcome
from tests.meta.proving import Suite, collect, try_case
from tests.second_opinion.third_party import ThirdParty, blueprint

PROFILE = """
[device]
name = "{name}"
kind = "generic"
description = "a device that nobody here wrote"
eds = "{eds}"

[factory]
node_id = 5
bit_rate = 250000
heartbeat_ms = {heartbeat_ms}
"""


@dataclass(frozen=True, slots=True)
class Opinion:
    """What the suite says of a device.

    Args:
        outcomes: how many tests ended so, by outcome.
        blamed: tests that found something, by the requirement that they hold it against.
        texts: the first finding, by requirement.
        claimed: requirements that a blaming test claims, by requirement.
    """

    outcomes: Mapping[str, int]
    blamed: Mapping[str, list[str]]
    texts: Mapping[str, str]
    claimed: Mapping[str, bool]


def suite_for(folder: Path, name: str, eds: str, heartbeat_ms: int = 0) -> Suite:
    """The tests that concern a device with that electronic data sheet.

    Args:
        folder: where the profile and the EDS are written.
        name: of the device.
        eds: content of its EDS.
        heartbeat_ms: with which it starts.
    """
    (folder / f"{name}.eds").write_text(eds, "utf-8")
    profile = folder / f"{name}.toml"
    text = PROFILE.format(name=name, eds=f"{name}.eds", heartbeat_ms=heartbeat_ms)
    profile.write_text(text, "utf-8")
    return collect("--can-profile", str(profile))


def opinion_of(suite: Suite, make: Callable[[int], ThirdParty]) -> Opinion:
    """Run every test of a suite on a device."""
    plan = suite.plan
    bench = bench_for(VirtualStage(blueprint(make), "third party"), plan.profile, plan.home)
    outcomes: dict[str, int] = {}
    blamed: dict[str, list[str]] = {}
    texts: dict[str, str] = {}
    claimed: dict[str, bool] = {}
    made: dict[str, object] = {}
    for case in suite.cases:
        result = try_case(case, bench, plan, made=made)
        outcomes[result.outcome] = outcomes.get(result.outcome, 0) + 1
        if result.outcome == outcome.ERROR:
            texts.setdefault("broken", f"{result.test}: {result.text}")
        for finding in result.findings:
            rule = finding.requirement
            blamed.setdefault(rule, []).append(result.test)
            texts.setdefault(rule, finding.text)
            claimed[rule] = claimed.get(rule, False) or rule in case.claims
    return Opinion(outcomes, blamed, texts, claimed)
