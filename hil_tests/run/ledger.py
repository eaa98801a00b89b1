"""What a run has found so far, and the one place from which its results are written.

A run's tests hand in rows. Where pytest-xdist spreads the tests over processes, a worker's rows
travel to the controller (`courier`), which writes one results.json for all of them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import partial
from typing import Any

from hil_tests.errors import BenchError
from hil_tests.reporting.results import COMPLETE, INTERRUPTED, ResultsFile
from hil_tests.reporting.results_reader import RESULTS
from hil_tests.reporting.rundir import RunDirectory
from hil_tests.reporting.tally import Standing
from hil_tests.run import outcome

_STOPPED = {2, 3}
"""Exit statuses of pytest: somebody stopped it, or it broke."""

_PLAIN = {outcome.PASSED, outcome.FAILED, outcome.ERROR}
"""Outcomes that pytest itself tells."""


@dataclass(frozen=True, slots=True)
class Told:
    """What came of a test, for the closing sections.

    Args:
        test: its node id.
        outcome: in the words of every report.
        why: one line.
        trace: path of its record relative to the run's folder, "" = none.
    """

    test: str
    outcome: str
    why: str
    trace: str


@dataclass(frozen=True, slots=True)
class Account:
    """What a bench went through.

    Args:
        bus_ns: time that passed on the bus.
        frames: that were seen.
        stalls: how often the host stopped the suite.
        late_frames: how often the host of a simulated device was late.
        host_late_ns: the worst of these.
    """

    bus_ns: int = 0
    frames: int = 0
    stalls: int = 0
    late_frames: int = 0
    host_late_ns: int = 0

    def plus(self, other: Account) -> Account:
        """Both benches together."""
        return Account(
            self.bus_ns + other.bus_ns,
            self.frames + other.frames,
            self.stalls + other.stalls,
            self.late_frames + other.late_frames,
            max(self.host_late_ns, other.host_late_ns),
        )


class Ledger:
    """The findings of a run.

    Args:
        folder: of the run.
        started: now, with a time zone.
    """

    def __init__(self, folder: RunDirectory, started: datetime) -> None:
        self.folder = folder
        self.outcomes: dict[str, str] = {}
        """Of each test, by node id."""
        self.told: list[Told] = []
        """Tests of which pytest's own words do not say all."""
        self.failures: list[Mapping[str, Any]] = []
        """Rows of the tests that failed."""
        self.catalogue: Mapping[str, Mapping[str, Any]] = {}
        """The requirements, as results.json has them at its head."""
        self.broken = ""
        """Why the bench is broken; "" = it is not."""
        self.problems: list[str] = []
        """What went wrong besides the tests; each costs the run its good end."""
        self.papers: list[str] = []
        """What was written for people, for the closing lines."""
        self.account = Account()
        self.checks = 0
        self._started = started
        self._results: ResultsFile | None = None

    @property
    def standings(self) -> Mapping[str, Standing]:
        """How each requirement stands, by id."""
        return self._results.tally.standings if self._results is not None else {}

    def open(self, head: Mapping[str, Any]) -> None:
        """Begin the results with facts of the run."""
        self.catalogue = head["requirements"]
        path = self.folder.path / RESULTS
        try:
            self._results = ResultsFile(path, head)
        except BenchError as error:
            self.problem(error)

    def problem(self, what: object) -> None:
        """Remember a problem of the run, once."""
        if str(what) not in self.problems:
            self.problems.append(str(what))

    def begin(self, test: str, trace: str | None) -> None:
        """A test is under way."""
        if self._results is not None:
            self._try(partial(self._results.begin, test, trace))

    def add(self, row: Mapping[str, Any], why: str) -> None:
        """A test has ended.

        Args:
            row: as results.json has it.
            why: in one line.
        """
        self.outcomes[row["test"]] = row["outcome"]
        self.checks += len(row["verdicts"])
        if row["outcome"] not in _PLAIN:
            self.told.append(Told(row["test"], row["outcome"], why, row["trace"] or ""))
        if row["outcome"] == outcome.FAILED:
            self.failures.append(row)
        if self._results is not None:
            self._try(partial(self._results.add, row))

    def close(self, own: int, *, require_all: bool) -> int:
        """Finish the results.

        Args:
            own: the exit status that pytest would give.
            require_all: not run and not applicable count as failures.

        Returns:
            The exit status of the run.
        """
        status = outcome.exit_status(
            self.outcomes.values(), own, require_all=require_all, broken=bool(self.problems)
        )
        if self._results is not None:
            state = INTERRUPTED if own in _STOPPED else COMPLETE
            if not self._try(partial(self._results.finish, self._summary(status), state)):
                status = status if status == 1 else 11
        return status

    def _summary(self, status: int) -> Mapping[str, Any]:
        """Last words for the results."""
        ended = datetime.now(UTC)
        return {
            "exit_status": status,
            "ended": ended.isoformat(),
            "seconds": round((ended - self._started).total_seconds(), 6),
            "problems": list(self.problems),
            "bus_ns": self.account.bus_ns,
            "frames": self.account.frames,
            "stalls": self.account.stalls,
            "host_late_ns": self.account.host_late_ns,
        }

    def _try(self, write: Callable[[], None]) -> bool:
        """Write something; what goes wrong is a problem of the run. Whether all went well."""
        try:
            write()
        except BenchError as error:
            self.problem(error)
            return False
        return True
