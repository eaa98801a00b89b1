"""A run that pytest-xdist spreads over processes: one folder, one results.json.

The controller names the folder and writes the results; a worker opens a bench of its own,
writes the traces of its tests, and hands its rows over with pytest's reports. A real bus has
one tester at a time, so there the tests are not spread.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from hil_tests.errors import ConfigError
from hil_tests.reporting.rows import TestResult
from hil_tests.reporting.rundir import RunDirectory
from hil_tests.run import outcome, stash
from hil_tests.run.ledger import Account, Ledger

if TYPE_CHECKING:
    from hil_tests.run.session import Run

KEY = "nodeproof"
"""Of what is ours in what xdist carries to a worker and back."""


@dataclass(frozen=True, slots=True)
class Errand:
    """What a worker is told.

    Args:
        folder: of the run.
        command: the command line.
    """

    folder: str
    command: list[str]


def errand_of(config: pytest.Config) -> Errand | None:
    """What the controller told this process; None = it is no worker."""
    told = getattr(config, "workerinput", {}).get(KEY)
    return Errand(**told) if told else None


class Courier(Ledger):
    """The ledger of a worker: rows go into the next report instead of a file."""

    def __init__(self, folder: RunDirectory, started: datetime) -> None:
        super().__init__(folder, started)
        self._head: Mapping[str, Any] | None = None
        self._rows: list[tuple[Mapping[str, Any], str]] = []
        self.lines: list[str] = []
        """What people are told at the head of the run."""

    def open(self, head: Mapping[str, Any]) -> None:
        """Facts of the run travel with the first row."""
        self._head = head

    def add(self, row: Mapping[str, Any], why: str) -> None:
        """A test has ended: its row waits for the report."""
        super().add(row, why)
        self._rows.append((row, why))

    @property
    def waiting(self) -> bool:
        """There is something that no report has carried yet."""
        return self._head is not None or bool(self._rows)

    def parcel(self) -> dict[str, Any]:
        """What the next report carries: plain data."""
        parcel = {"head": self._head, "lines": self.lines, "rows": self._rows}
        self._head, self._rows = None, []
        return parcel

    def farewell(self) -> dict[str, Any]:
        """Last words of a worker, with what no report carried: plain data."""
        facts = {"account": asdict(self.account), "broken": self.broken}
        return {**self.parcel(), **facts, "problems": list(self.problems)}


class Gathering:
    """The controller's side of a spread run.

    Args:
        settings: of the run.
        command: the command line.
    """

    def __init__(self, settings: Mapping[str, Any], command: list[str]) -> None:
        self._settings = settings
        self._command = command
        self._started = datetime.now(UTC)
        self._place = RunDirectory.named(Path(settings["can_reports"]), self._started)
        self._begun = False
        self.ledger = Ledger(self._place, self._started)

    @property
    def begun(self) -> bool:
        """A worker had a test of ours."""
        return self._begun

    def errand(self) -> dict[str, Any]:
        """What every worker is told: plain data."""
        return asdict(Errand(str(self._place.path.absolute()), self._command))

    def take(self, parcel: Mapping[str, Any]) -> bool:
        """Rows that came with a report; True = it was the first parcel."""
        first = not self._begun and parcel["head"] is not None
        if first:
            self._begun = True
            try:
                self._place.point()
                self.ledger.open({**parcel["head"], "started": self._started.isoformat()})
            except ConfigError as error:
                self.ledger.problem(error)
        for row, why in parcel["rows"]:
            self.ledger.add(row, why)
        return first

    def bid_farewell(self, words: Mapping[str, Any]) -> None:
        """A worker has ended."""
        ledger = self.ledger
        self.take(words)
        ledger.account = ledger.account.plus(Account(**words["account"]))
        ledger.broken = ledger.broken or words["broken"]
        for problem in words["problems"]:
            ledger.problem(problem)

    def crashed(self, test: str, text: str) -> None:
        """A worker is gone without a word, in the middle of a test."""
        if self._begun:
            self.ledger.add(TestResult(test, outcome.ERROR, text=text).to_json(), text)

    def close(self, own: int) -> int:
        """Finish the results; see `Ledger.close`."""
        if not self._begun:
            return own
        return self.ledger.close(own, require_all=bool(self._settings["can_require_all"]))


def gather(config: pytest.Config, workers: int) -> Gathering:
    """The gathering of this controller, made when the first worker is.

    Raises:
        pytest.UsageError: several workers, and a bus that is not virtual.
    """
    settings = stash.settings_of(config)
    real = [key for key in ("can_iface", "can_bench") if settings[key]]
    if workers > 1 and real:
        key = real[0]
        name = f"--{key.replace('_', '-')}"
        raise pytest.UsageError(
            f"{name} {settings[key]} ({settings.origins[key]}): a bus has one tester at a time;"
            f" {workers} workers were asked for: leave out -n, or test in virtual time"
        )
    if stash.GATHERING not in config.stash:
        command = [str(part) for part in config.invocation_params.args]
        config.stash[stash.GATHERING] = Gathering(settings.values, command)
    return config.stash[stash.GATHERING]


# What the plugin's hooks hand on.


def receive(config: pytest.Config, report: pytest.TestReport) -> None:
    """A report has come to the controller."""
    gathering = stash.gathering_of(config)
    parcel = getattr(report, f"{KEY}_parcel", None)
    if gathering is None:
        return
    if parcel is not None:
        if gathering.take(parcel):
            _say(config, parcel["lines"])
    elif str(report.when) == "???":  # so xdist marks the report of a worker that crashed
        gathering.crashed(report.nodeid, str(report.longrepr))


def _say(config: pytest.Config, lines: Iterable[str]) -> None:
    """The head of the run, as the first worker tells it."""
    reporter: Any = config.pluginmanager.get_plugin("terminalreporter")
    for line in lines if reporter else ():
        reporter.write_line(line)


def introduce(run: Run, lines: list[str]) -> None:
    """A worker begins: what people should know of the run."""
    if isinstance(run.ledger, Courier):
        run.ledger.lines = lines


def hand_over(report: pytest.TestReport, ledger: Ledger) -> None:
    """A worker's report of a test's phase goes to the controller, with what waits for it.

    The first one does so before its test begins: from then on there are results, whatever
    ends the run.
    """
    if isinstance(ledger, Courier) and ledger.waiting:
        setattr(report, f"{KEY}_parcel", ledger.parcel())


def report_back(output: dict[str, Any], ledger: Ledger) -> None:
    """A worker ends."""
    if isinstance(ledger, Courier):
        output[KEY] = ledger.farewell()


def part(node: Any) -> None:
    """A worker has ended; one that was lost has no last words."""
    gathering = stash.gathering_of(node.config)
    words = getattr(node, "workeroutput", {}).get(KEY)
    if gathering is not None and words:
        gathering.bid_farewell(words)
