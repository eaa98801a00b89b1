"""A recorded run: which tests it had, what came of each, and where its record is."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from hil_tests.errors import ConfigError
from hil_tests.replay.record import TestRecord, load_record
from hil_tests.reporting.files import RecordUnreadable
from hil_tests.reporting.results_reader import RESULTS, load_results
from hil_tests.reporting.rows import TestResult, VerdictRow
from hil_tests.trace import Mark

_UNKNOWN = "interrupted"
IDENTITY = "identity"
"""What the record is called in which the device says who it is."""


@dataclass(frozen=True, slots=True)
class RecordedTest:
    """One test of a recorded run.

    Args:
        name: its node id.
        result: what came of it; None = the run was killed in it.
        trace: its record; None = there is none.
    """

    name: str
    result: TestResult | None
    trace: Path | None


@dataclass(frozen=True, slots=True)
class RecordedRun:
    """A run, or traces of several.

    Args:
        tests: by node id, in the order in which they ran.
        options: what was chosen, as `--can-...` options, by key.
        device: who was under test: "virtual", "model" or "external".
        identity: the record of how the device was asked who it is; None = it was not.
        repeated: properties whose failing example is run again.
    """

    tests: Mapping[str, RecordedTest]
    options: Mapping[str, Any]
    device: str
    identity: TestRecord | None = None
    repeated: set[str] = field(default_factory=set)
    _sample: list[TestRecord] = field(default_factory=list)

    def sample(self) -> TestRecord:
        """The record of any of its tests: the facts of the bench are the same in all.

        Raises:
            ConfigError: it has none.
        """
        if not self._sample:
            traces = (test.trace for test in self.tests.values() if test.trace is not None)
            first = next(traces, None)
            if first is None:
                raise ConfigError("--can-replay: the run has no record of any test")
            self._sample.append(_load(first))
        return self._sample[0]

    def find(self, name: str) -> RecordedTest | None:
        """The test of that node id, wherever its file lay then."""
        return (
            self.tests.get(name) or self.tests.get(_tail(name)) or self._by_tail().get(_tail(name))
        )

    def _by_tail(self) -> Mapping[str, RecordedTest]:
        return {_tail(name): test for name, test in self.tests.items()}


def _tail(name: str) -> str:
    """A node id without the folders of its file."""
    file, separator, rest = name.partition("::")
    return f"{file.rpartition('/')[2]}{separator}{rest}"


def open_runs(paths: Sequence[str]) -> RecordedRun:
    """The recorded run in a folder, or the one that some traces are of.

    Raises:
        ConfigError: nothing of the kind, or damage; with the remedy.
    """
    given = [_fixed(Path(path)) for path in paths]
    try:
        return _from_folder(given[0]) if _is_only_run(given) else _from_traces(given)
    except RecordUnreadable as error:
        raise ConfigError(f"--can-replay: {error}") from None


def _fixed(path: Path) -> Path:
    """Where it leads now: `reports/latest` will name the replay itself as soon as that begins."""
    return path.resolve() if path.exists() else path


def _is_only_run(paths: Sequence[Path]) -> bool:
    return len(paths) == 1 and (paths[0].is_dir() or paths[0].name == RESULTS)


def _load(path: Path) -> TestRecord:
    try:
        return load_record(path)
    except RecordUnreadable as error:
        raise ConfigError(f"--can-replay: {error}") from None


def _from_folder(path: Path) -> RecordedRun:
    folder = path if path.is_dir() else path.parent
    found = load_results(folder / RESULTS)
    tests = {}
    for result in found.results:
        trace = _inside(folder, result.trace.path) if result.trace else None
        tests[result.test] = RecordedTest(result.test, result, trace)
    under_way = found.under_way or {}
    name, trace = under_way.get("test"), under_way.get("trace")
    if isinstance(name, str) and name not in tests:
        record = _inside(folder, trace) if isinstance(trace, str) else None
        tests[name] = RecordedTest(name, None, record)
    options = found.run.get("options")
    chosen = {
        str(key): each.get("value")
        for key, each in (options.items() if isinstance(options, dict) else ())
        if isinstance(each, dict)
    }
    device = found.run.get("device")
    known: Mapping[str, Any] = device if isinstance(device, dict) else {}
    for name in ("serial", "firmware"):
        if known.get(f"{name}_from") == "bench file":
            chosen[f"can_{name}"] = known.get(name)
    return RecordedRun(tests, chosen, str(known.get("kind")), _identity(folder, known))


def _identity(folder: Path, device: Mapping[str, Any]) -> TestRecord | None:
    facts = device.get("identity")
    name = facts.get("trace") if isinstance(facts, dict) else None
    path = _inside(folder, name) if isinstance(name, str) else None
    return load_record(path) if path else None


def _inside(folder: Path, name: str) -> Path | None:
    """A file of a run; None where it is not there."""
    path = folder / name
    if not path.resolve().is_relative_to(folder.resolve()):
        raise RecordUnreadable(f"{folder / RESULTS}: the trace {name!r} lies outside the folder")
    return path if path.is_file() else None


def _from_traces(paths: Sequence[Path]) -> RecordedRun:
    tests: dict[str, RecordedTest] = {}
    first: TestRecord | None = None
    identity: TestRecord | None = None
    for path in paths:
        record = load_record(path)
        first = first or record
        if record.test == IDENTITY:
            identity = record
            continue
        tests[record.test] = RecordedTest(record.test, _result_of(record), path)
    assert first is not None
    settings = first.opening.detail.get("settings")
    virtual = first.fact("virtual", bool)
    device = "virtual" if virtual else "external"
    options = settings if isinstance(settings, dict) else {}
    return RecordedRun(tests, options, device, identity, _sample=[first])


def _result_of(record: TestRecord) -> TestResult | None:
    """What the trace itself says came of the test."""
    outcome = str(record.end.detail.get("outcome")) if record.end else _UNKNOWN
    if record.end is None or outcome == _UNKNOWN:
        return None
    claims = record.opening.detail.get("requirements")
    claimed = [str(each) for each in claims] if isinstance(claims, list) else []
    return TestResult(
        record.test,
        outcome,
        requirements=claimed,
        verdicts=list(_rows(record.marks, claimed)),
        text=str(record.end.detail.get("text", "")),
    )


def _rows(marks: Sequence[Mark], claimed: Sequence[str]) -> Iterator[VerdictRow]:
    for mark in marks:
        if mark.data.get("kind") == "verdict":
            requirement = str(mark.data.get("requirement") or (claimed[0] if claimed else ""))
            yield VerdictRow(requirement, str(mark.data.get("outcome")), text=mark.text)
