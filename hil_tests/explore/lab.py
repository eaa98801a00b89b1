"""Benches for exploring: a model, right or faulty, in virtual time, without pytest."""

from __future__ import annotations

from dataclasses import dataclass

from hil_tests.bench.keypad import KeypadBench
from hil_tests.bench.virtual import VirtualStage
from hil_tests.config import load_keypad
from hil_tests.errors import ConfigError
from hil_tests.judge.verdict import NotRun, Outcome, Verdict
from hil_tests.scenarios.play import play
from hil_tests.scenarios.scenario import Scenario
from node_model import devices


@dataclass(frozen=True, slots=True)
class Finding:
    """A scenario in which a device broke something.

    Args:
        scenario: what was played.
        verdicts: everything that was certainly wrong, the first first; at least one.
    """

    scenario: Scenario
    verdicts: tuple[Verdict, ...]

    @property
    def requirements(self) -> frozenset[str]:
        """Everything that was broken."""
        return frozenset(verdict.requirement for verdict in self.verdicts)


class Lab:
    """A virtual bench on which scenario after scenario is played.

    Args:
        profile: name or file.
        model: mutant or variant; None = the right model.

    Raises:
        ConfigError: no such profile or model, or none that the bundled model can be.
    """

    def __init__(self, profile: str = "keypad", model: str | None = None) -> None:
        facts = load_keypad(profile)
        try:
            stage = VirtualStage(devices.read(facts.path, model))
        except ValueError as error:
            raise ConfigError(f"no such model: {error}") from error
        self.bench = KeypadBench(stage, facts, facts.factory)
        self.played = 0
        self.why_not = ""
        """Why the last scenario was not played; "" = it was."""

    def play(self, scenario: Scenario) -> Finding | None:
        """Play one scenario on a fresh device; None where nothing is found."""
        self.bench.begin_example()
        self.played += 1
        self.why_not = ""
        try:
            verdicts = play(self.bench, scenario, doubts=False)
        except NotRun as reason:
            self.why_not = str(reason)
            return None
        wrong = tuple(each for each in verdicts if each.outcome is Outcome.FAIL)
        return Finding(scenario, wrong) if wrong else None
