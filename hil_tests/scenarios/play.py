"""Scenarios as tests: everything that is wrong, the first thing first, and how to see it again."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace

from hil_tests.api import (
    MS,
    DeviceFailure,
    InconclusiveResult,
    Interval,
    KeypadBench,
    Outcome,
    Verdict,
)
from hil_tests.scenarios.blame import better
from hil_tests.scenarios.player import LeftOpen, Player
from hil_tests.scenarios.scenario import Scenario

EVIDENCE_NS = 250 * MS
"""How long before a fault its evidence begins."""

_ASIDE = frozenset(("NMT-20", "LED-05", "LED-06", "LED-20", "LED-21"))
"""Our own readings from which nothing else follows: a device that differs there is judged on."""

GONE = "ROB-01"
"""Requirement of a device that no longer acknowledges: it was there when the scenario began."""


def play(bench: KeypadBench, scenario: Scenario, *, doubts: bool = True) -> list[Verdict]:
    """Play a scenario; everything that was wrong, the first first.

    Args:
        bench: its test or example has begun.
        scenario: what to play.
        doubts: ask also what is wrong only if every doubt goes against the device.

    Raises:
        NotRun: the bench cannot play it.
    """
    return _verdicts(_played(bench, scenario, doubts=doubts))


def judge(bench: KeypadBench, scenario: Scenario, *claims: str) -> None:
    """Play a scenario, and end the test with the first thing that is wrong.

    Args:
        bench: its test or example has begun.
        scenario: what to play.
        claims: the requirements that the test is about. Doubt ends a test only where it
            concerns them; what is certainly wrong ends it always.

    Raises:
        DeviceFailure: something is certainly wrong.
        InconclusiveResult: doubt decides over one of `claims`.
        NotRun: the bench cannot play it.
    """
    conclude(bench, _played(bench, scenario, doubts=True), scenario, *claims)


def conclude(bench: KeypadBench, player: Player, scenario: Scenario, *claims: str) -> None:
    """End the test with the first thing that was wrong with what was played; see `judge`."""
    # A device that differs from a reading of ours must not hide what it breaks besides.
    for verdict in sorted(_verdicts(player), key=lambda each: each.requirement in _ASIDE):
        if verdict.outcome is Outcome.FAIL or verdict.requirement in claims:
            try:
                bench.conclude(verdict, _look_from(bench, verdict))
            except (DeviceFailure, InconclusiveResult) as error:
                error.add_note(f"to see it again: nodeproof play {str(scenario)!r}")
                raise
    for name in claims:
        bench.record(Verdict(name, Outcome.PASS, "everything is as it must be"))


def _played(bench: KeypadBench, scenario: Scenario, *, doubts: bool) -> Player:
    player = Player(bench, doubts=doubts)
    try:
        player.begin(scenario)
        with suppress(LeftOpen):
            for step in scenario.steps:
                player.do(step)
    except (DeviceFailure, InconclusiveResult) as error:
        player.found.append(error.verdict)
    return player


def _verdicts(player: Player) -> list[Verdict]:
    found = player.finish()
    named = [each if each.requirement else replace(each, requirement=GONE) for each in found]
    if not player.begun:
        return named  # the device could not even be brought to where the scenario begins
    return [better(player.bench, player.node_id, each) for each in named]


def _look_from(bench: KeypadBench, verdict: Verdict) -> Interval:
    """From where on the evidence is shown."""
    at = bench.now() if verdict.at is None else verdict.at
    return Interval(at - EVIDENCE_NS, at)
