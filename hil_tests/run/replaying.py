"""A recorded run goes through the same tests again: plan, selection, bench, differences.

Nothing is moved and nobody waits. Limits are those of the profile given now. A property's
examples are not kept but for the one that failed: the rest is counted as recorded.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import attrs
import pytest

from hil_tests.bench.identity import Told
from hil_tests.config import DeviceProfile, load_profile
from hil_tests.errors import BenchError, ConfigError
from hil_tests.judge.verdict import DeviceFailure, InconclusiveResult, NotRun, Outcome, Verdict
from hil_tests.replay.record import load_record
from hil_tests.replay.runs import RecordedRun, RecordedTest, open_runs
from hil_tests.replay.stage import ReplayStage
from hil_tests.replay.standing import setup_of, stand
from hil_tests.reporting.results_reader import RESULTS, load_results
from hil_tests.reporting.rows import PASSING, TestResult
from hil_tests.reporting.tally import pairs
from hil_tests.run import outcome, stash
from hil_tests.run.options import Settings
from hil_tests.run.plan import Plan, asked_of
from hil_tests.run.session import Run

if TYPE_CHECKING:
    from hil_tests.bench.bench import Bench
    from hil_tests.run.ledger import Ledger

RECORDING = "recording"
_FROM_RECORD = (
    "can_profile",
    "can_strict",
    "can_seed",
    "can_scenario",
    "can_budget",
    "can_mutant",
    "can_eds",
    "can_node_id",
    "can_serial",
    "can_firmware",
)
"""What was chosen then and is kept, unless something else is chosen now."""
_NOT_WITH = ("can_iface", "can_interface", "can_device", "can_bench", "can_bitrate")
_JUDGED = {outcome.PASSED, outcome.FAILED, outcome.OBSERVATION, outcome.INCONCLUSIVE}
_BLOB = re.compile(r"@reproduce_failure\(('[^']*'), (b'[^']*'|b\"[^\"]*\")\)")


# The plan.


def plan_of_recording(settings: Settings) -> Plan:
    """The plan of a replay: the bench as it was recorded, limits as they are now.

    Raises:
        ConfigError: no recording, or options that do not go with one.
    """
    wrong = [key for key in _NOT_WITH if settings.origins[key] == "command line"]
    if wrong:
        names = ", ".join(f"--{key.replace('_', '-')}" for key in wrong)
        raise ConfigError(
            f"--can-replay takes bus and bench from the recording; leave out {names}"
        )
    recorded = open_runs(settings["can_replay"])
    sample = recorded.sample()
    settings = _as_recorded(settings, recorded)
    profile = _profile(settings)
    requirements, by_sheet = asked_of(profile)
    virtual: bool = sample.fact("virtual", bool)
    return Plan(
        device=recorded.device if (recorded.device == "virtual") is virtual else "external",
        why="as recorded",
        interface="virtual time" if virtual else RECORDING,
        channel=sample.fact("name", str, "port"),
        bit_rate=sample.fact("bit_rate", int),
        exclusive=sample.fact("exclusive", bool),
        timed=sample.fact("timed", bool, "port"),
        profile=profile,
        home=setup_of(profile, sample, "home"),
        facilities=tuple(map(str, sample.fact("facilities", list))),
        bench_name=sample.fact("bench", str),
        bench_file=None,
        mutant=settings["can_mutant"],
        requirements=requirements,
        settings=settings,
        by_sheet=by_sheet,
        recording=recorded,
    )


def _profile(settings: Settings) -> DeviceProfile:
    """The profile, with the electronic data sheet that the run had.

    Raises:
        ConfigError: no such file.
    """
    profile, sheet = load_profile(settings["can_profile"]), settings["can_eds"]
    if sheet and not Path(sheet).is_file():
        raise ConfigError(
            f"--can-replay: the run had the EDS {sheet}, and it is not there; name one with"
            " --can-eds"
        )
    return attrs.evolve(profile, eds=sheet) if sheet else profile


def _as_recorded(settings: Settings, recorded: RecordedRun) -> Settings:
    values, origins = dict(settings.values), dict(settings.origins)
    for key in _FROM_RECORD:
        known = recorded.options.get(key)
        if origins[key] == "default" and known and known != values[key]:
            values[key], origins[key] = known, RECORDING
    return Settings(values, origins)


# The selection.


def choose(
    items: Iterable[pytest.Item], recorded: RecordedRun
) -> tuple[list[pytest.Item], list[pytest.Item]]:
    """The tests that were recorded, and the others."""
    chosen: list[pytest.Item] = []
    others: list[pytest.Item] = []
    for item in items:
        known = stash.is_ours(item) and recorded.find(item.nodeid) is not None
        (chosen if known else others).append(item)
    return chosen, others


def repeat_examples(items: Iterable[pytest.Item], recorded: RecordedRun) -> None:
    """Let properties of which a failing example is recorded run that one, and nothing else."""
    for item in items:
        test = recorded.find(item.nodeid)
        function: Any = getattr(item, "obj", None)
        example = example_of(test) if test and hasattr(function, "hypothesis") else None
        if example is not None:
            import hypothesis  # noqa: PLC0415 - it is there

            hypothesis.reproduce_failure(*example)(function)
            recorded.repeated.add(item.nodeid)


def example_of(test: RecordedTest) -> tuple[str, bytes] | None:
    """The failing example of a property: version of Hypothesis, and its choices.

    None where there is none, or where this version of Hypothesis would not understand it.
    """
    if test.trace is None:
        return None
    import hypothesis  # noqa: PLC0415 - where a property is replayed

    found = _BLOB.search(_example_in(test.trace))
    if found is None:
        return None
    version, blob = map(ast.literal_eval, found.groups())
    return (version, blob) if version == hypothesis.__version__ else None


def _example_in(trace: Path) -> str:
    """How the record of a property's example says that it can be repeated; "" = it does not."""
    end = load_record(trace).end
    return str(end.detail.get("example", "")) if end else ""


# The run.


class ReplayRun(Run):
    """A run whose bus is a recording; see `Run`."""

    _counts = False
    """The test under way is counted as it was recorded."""

    @property
    def recorded(self) -> RecordedRun:
        """What is replayed."""
        assert self.plan.recording is not None
        return self.plan.recording

    def _ask(self, bench: Bench) -> tuple[Told, str | None]:
        """See Run; the recording of that answers."""
        record = self.recorded.identity
        if record is None:
            return Told(not_read="the recorded run did not ask it"), None
        stand(bench, record)
        return super()._ask(bench)

    def begin(self, test: str, claims: Sequence[str], *, keep_trace: bool) -> None:
        """A test begins: the bench stands as it stood then.

        Raises:
            NotRun: there is no record of it.
        """
        recorded = self.recorded.find(test)
        assert recorded is not None
        self._counts = not keep_trace and test not in self.recorded.repeated
        if not self._counts:
            if recorded.trace is None:
                raise NotRun(_without_record(recorded))
            stand(self.bench, load_record(recorded.trace))
        super().begin(test, claims, keep_trace=keep_trace)

    def stand_in(self, test: str) -> bool:
        """Whether a test is counted as it was recorded, and not run.

        Raises:
            DeviceFailure, InconclusiveResult, NotRun: that is what it ended with then.
        """
        if not self._counts:
            return False
        recorded = self.recorded.find(test)
        result = recorded.result if recorded else None
        if result is None:
            raise NotRun(
                "the recorded run ended in it, and the examples of a property are not kept"
            )
        for verdict in _verdicts(result):
            self.bench.record(verdict)
        _end_as(result)
        return True

    def keep_last_example(self, error: BaseException | None) -> None:
        """See Run; the example is the recorded one, so that the replay can be replayed."""
        super().keep_last_example(error)
        recorded = self.recorded.find(self._test)
        if not self._example and recorded is not None and recorded.trace is not None:
            self._example = _example_in(recorded.trace)

    def end(self, error: BaseException | None, claimed: str) -> BaseException | None:
        """See Run; an example that fails no more is one that passes."""
        if type(error).__name__ == "DidNotReproduce":
            error = None
        bench = self.opened
        if bench is not None and isinstance(bench.stage, ReplayStage) and not self._counts:
            bench.stage.port.source.wind_up()
        return super().end(error, claimed)

    def _put_back(self, bench: Bench) -> None:
        """Nothing was moved."""


def _without_record(recorded: RecordedTest) -> str:
    result = recorded.result
    if result is not None and result.outcome == "error":
        return f"the recorded test ended with an error of the bench: {result.text or 'no text'}"
    return "there is no record of this test"


def _verdicts(result: TestResult) -> Iterator[Verdict]:
    for row in result.verdicts:
        # An observation was a failed check of a requirement that is our own reading.
        found = Outcome.FAIL if row.outcome == "observation" else Outcome(row.outcome)
        yield Verdict(row.requirement, found, row.what or row.text, at=row.at)


def _end_as(result: TestResult) -> None:
    """Raise what a test ended with."""
    text = result.text.partition("\n")[0]
    bad = [
        each for each in _verdicts(result) if each.outcome in {Outcome.FAIL, Outcome.INCONCLUSIVE}
    ]
    if result.outcome == "inconclusive":
        raise InconclusiveResult(bad[-1] if bad else Verdict("", Outcome.INCONCLUSIVE, text))
    if result.outcome in {"failed", "observation"}:
        raise DeviceFailure(bad[-1] if bad else Verdict("", Outcome.FAIL, text))
    if result.outcome == "error":
        raise BenchError(f"as recorded: {text}")
    if result.outcome != "passed":
        raise NotRun(text)


# What came of it.


def compared(config: pytest.Config, ledger: Ledger) -> list[str]:
    """How the replay that has ended compares with the recording, in lines."""
    recorded = stash.plan_of(config).recording
    results = ledger.folder.path / RESULTS
    if recorded is None or not results.is_file():
        return ["there are no results to compare"]
    return closing_lines(recorded, results)


def closing_lines(recorded: RecordedRun, results: Path) -> list[str]:
    """How a replay compares with the recording.

    Args:
        recorded: the run that was replayed.
        results: of the replay.
    """
    now = load_results(results).results
    counted = sum(each.trace is None and each.outcome in _JUDGED for each in now)
    lines = []
    if counted:
        lines.append(
            f"{counted} tests are counted as recorded: examples of properties are not kept"
        )
    known = {id(recorded.find(each.test)) for each in now}
    lines += [
        f"{name}: was recorded, and there is no such test now"
        for name, test in recorded.tests.items()
        if id(test) not in known
    ]
    found = [line for each in now for line in _differences(recorded.find(each.test), each)]
    if found:
        return [*lines, f"{len(found)} verdicts differ:", *found]
    return [*lines, "every verdict is the recorded one"]


def _differences(recorded: RecordedTest | None, now: TestResult) -> list[str]:
    """What a test says now of a requirement and did not say then, a line each."""
    if recorded is None or recorded.result is None:
        return []
    then = recorded.result
    before, after = pairs(then.to_json()), pairs(now.to_json())
    lines = []
    for name in sorted({*before, *after}):
        was, is_now = before.get(name, "not judged"), after.get(name, "not judged")
        if was != is_now:
            why = _why(now if is_now != outcome.PASSED else then, name)
            lines.append(f"{then.test}: {name} was {was}, is {is_now} now: {why}")
    if then.outcome != now.outcome and not lines:
        lines.append(f"{then.test}: was {then.outcome}, is {now.outcome} now")
    return lines


def _why(result: TestResult, name: str) -> str:
    """The worst that a result says of a requirement."""
    texts = [
        row.text
        for row in result.verdicts
        if row.requirement == name and row.outcome not in PASSING
    ]
    return (texts[0] if texts else result.text or "no more is known").partition("\n")[0]
