"""One run: its bench, its folder, and what came of each test."""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hil_tests.clock import FOREVER
from hil_tests.errors import BenchError
from hil_tests.reporting.pcapng import PcapngSink
from hil_tests.reporting.results import ResultsFile, TestResult, VerdictRow
from hil_tests.reporting.rundir import RunDirectory
from hil_tests.run import outcome
from hil_tests.run.opening import open_bench
from hil_tests.run.options import OPTIONS

if TYPE_CHECKING:
    from hil_tests.bench.bench import Bench
    from hil_tests.bench.drivers.terminal import Capture
    from hil_tests.judge.verdict import Limits, Verdict
    from hil_tests.run.plan import Plan


class Run:
    """A run under way.

    Args:
        plan: what is tested, and on what.
        started: now, with a time zone; names the folder.
        command: the command line, for the results and for repeating a test.
    """

    def __init__(self, plan: Plan, started: datetime, command: Sequence[str]) -> None:
        self.plan = plan
        self.command = tuple(command)
        self.folder = RunDirectory.create(Path(plan.settings["can_reports"]), started)
        self.outcomes: dict[str, str] = {}
        self.verdicts: list[Verdict] = []
        self.broken: BenchError | None = None
        self._bench: Bench | None = None
        self._sink: PcapngSink | None = None
        self._marks = (0, 0)
        self._started = started
        self._results: ResultsFile | None = None

    # The bench.

    def open(self, capture: Capture | None = None) -> None:
        """Open the bench; what goes wrong is remembered and told by every test that needs it."""
        try:
            self._bench = open_bench(self.plan, capture)
        except BenchError as error:
            self.broken = error
        self._results = ResultsFile(self.folder.path / "results.json", self._header())

    @property
    def bench(self) -> Bench:
        """The open bench.

        Raises:
            BenchError: it is broken; with the first cause.
        """
        if self.broken is not None:
            raise BenchError(f"the bench is broken: {self.broken}")
        if self._bench is None:
            raise BenchError("the bench is not open; tests that use it run under the plugin")
        return self._bench

    @property
    def opened(self) -> Bench | None:
        """The bench, or None where it could not be opened."""
        return self._bench

    def _header(self) -> dict[str, Any]:
        plan, bench = self.plan, self._bench
        facts = bench.description() if bench else {}
        return {
            "started": self._started.isoformat(),
            "command": list(self.command),
            "settings": {key: str(value) for key, value in plan.settings.values.items()},
            "origins": dict(plan.settings.origins),
            "device": {"kind": plan.device, "why": plan.why, "mutant": plan.mutant},
            "profile": plan.profile.path,
            "bus": facts.get("bus", f"{plan.channel} ({plan.interface})"),
            "clock": facts.get("clock", ""),
            "bench": plan.bench_name,
            "seed": plan.settings["can_seed"],
        }

    # A test.

    def begin(self, test: str, *, keep_trace: bool) -> None:
        """A test begins; with `keep_trace` its record is written as it comes."""
        bench = self.bench
        self._sink = self._new_sink(test, "") if keep_trace else None
        self._marks = (bench.frames, bench.bus_ns)
        bench.begin(*([self._sink] if self._sink else []))

    def _new_sink(self, test: str, part: str) -> PcapngSink:
        port = self.bench.stage.port
        path = self.folder.trace_path(test, part)
        flush = not self.plan.virtual
        return PcapngSink(path, interface=port.name, clock=port.clock, flush=flush)

    def end(self, error: BaseException | None, claimed: str) -> BaseException | None:
        """A test's body has ended with `error`; what it ends with, monitors included."""
        bench = self._bench
        if bench is None or self.broken is not None:
            return error
        try:
            found = bench.end()
        except BenchError as broken:
            found = []
            error = error or broken
        for verdict in found:
            bench.record(verdict)
        ends_with = outcome.prevails(error, outcome.gravest_error(found))
        if outcome.is_bench_error(ends_with) and isinstance(ends_with, BenchError):
            self._suspect(ends_with)
        return outcome.claim(ends_with, claimed)

    def _suspect(self, error: BenchError) -> None:
        """A bench that broke in a test: can it go on? A dead port or control peer cannot."""
        from hil_tests.errors import BusUnavailable, ControlError  # noqa: PLC0415

        if isinstance(error, BusUnavailable | ControlError):
            self.broken = error

    def keep(self, test: str) -> str:
        """Close the record of the test; its path relative to the run's folder, "" = none.

        A property's record is written now, of its last example: the shrunk failing one.
        """
        sink = self._sink
        if sink is None:
            return ""
        self._sink = None
        bench = self._bench
        for verdict in bench.verdicts if bench else ():
            at = verdict.at if verdict.at is not None else 0
            sink.mark(at, str(verdict), {"outcome": verdict.outcome.value})
        sink.close()
        return self.folder.relative(sink.path)

    def keep_last_example(self, test: str) -> None:
        """Write the record in memory: the last example of a property that failed."""
        bench = self._bench
        if bench is None or self._sink is not None:
            return
        self._sink = self._new_sink(test, "shrunk")
        for entry in bench.trace.entries():
            self._sink.write(entry)

    def store(
        self, test: str, came_of_it: str, seconds: float, claimed: Sequence[str], text: str
    ) -> str:
        """Write the result of a test; the path of its record, "" = none."""
        bench = self._bench
        verdicts = list(bench.verdicts) if bench and self._marks is not None else []
        trace = self.keep(test)
        self.outcomes[test] = came_of_it
        self.verdicts.extend(verdicts)
        frames, bus_ns = (bench.frames, bench.bus_ns) if bench else (0, 0)
        result = TestResult(
            test=test,
            outcome=came_of_it,
            seconds=seconds,
            bus_ns=bus_ns - self._marks[1],
            frames=frames - self._marks[0],
            requirements=tuple(claimed),
            verdicts=[_row(each, claimed) for each in verdicts],
            trace=trace or None,
            reproduce=self.reproduce(test),
            text=text,
        )
        self._marks = (frames, bus_ns)
        if bench:
            bench.verdicts = []
        if self._results is not None:
            self._results.add(result.to_json())
        return trace

    def reproduce(self, test: str) -> str:
        """A command line that repeats one test as it ran here."""
        seed = self.plan.settings["can_seed"]
        options = own_options(self.command, f"--can-seed={seed}")
        return " ".join(["pytest", *options, shlex.quote(test)])

    # The end.

    def close(self, status: int) -> list[str]:
        """Put the device and the bench back, finish the results; what went wrong doing so."""
        problems = []
        bench = self._bench
        if bench is not None:
            if self.broken is None:
                try:
                    bench.begin()
                    bench.go_home()
                except Exception as error:  # noqa: BLE001  the end of a run reports, never raises
                    problems.append(f"the device could not be put back as it was: {error}")
            try:
                bench.close()
            except Exception as error:  # noqa: BLE001
                problems.append(f"the bench could not be closed: {error}")
        if self._results is not None:
            self._results.finish(self.summary(status))
        return problems

    def summary(self, status: int) -> Mapping[str, Any]:
        """Last words for the results."""
        bench = self._bench
        return {
            "exit_status": status,
            "bus_ns": bench.bus_ns if bench else 0,
            "frames": bench.frames if bench else 0,
            "stalls": bench.stalls if bench else 0,
            "host_late_ns": bench.lateness.worst_ns if bench else 0,
        }


def own_options(command: Sequence[str], seed: str) -> list[str]:
    """The options of ours in a command line, with their values; and the seed in any case."""
    takes_value = {f"--{option.name}" for option in OPTIONS if option.kind != "switch"}
    kept: list[str] = []
    parts = iter(command)
    for part in parts:
        if part.startswith("--can-") and not part.startswith("--can-seed"):
            kept.append(shlex.quote(part))
            if part in takes_value:
                kept.append(shlex.quote(next(parts, "")))
    return [*kept, seed]


def _row(verdict: Verdict, claimed: Sequence[str]) -> VerdictRow:
    return VerdictRow(
        requirement=verdict.requirement or (claimed[0] if claimed else ""),
        outcome=verdict.outcome.value,
        what=verdict.text,
        measured_ns=tuple(verdict.measured) if verdict.measured else None,
        limits_ns=_limits(verdict.limits) if verdict.limits else None,
        text=str(verdict),
    )


def _limits(limits: Limits) -> tuple[int | None, int | None]:
    low = None if limits.at_least_ns <= -FOREVER else limits.at_least_ns
    high = None if limits.at_most_ns >= FOREVER else limits.at_most_ns
    return low, high
