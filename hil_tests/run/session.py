"""One run: its bench, its folder, and what came of each test."""

from __future__ import annotations

import shlex
from collections.abc import Callable, Sequence
from datetime import datetime
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from hil_tests.errors import BenchError
from hil_tests.reporting.pcapng import PcapngSink
from hil_tests.reporting.results import INTERRUPTED
from hil_tests.reporting.rows import TestResult, TraceFile
from hil_tests.reporting.rundir import RunDirectory
from hil_tests.run import outcome, rows
from hil_tests.run.draft import Draft
from hil_tests.run.header import header
from hil_tests.run.identity import Identity, identify, read_device
from hil_tests.run.ledger import Account, Ledger
from hil_tests.run.options import TAKE_VALUES
from hil_tests.run.rows import Ending
from hil_tests.trace import Moment

if TYPE_CHECKING:
    from hil_tests.bench.bench import Bench
    from hil_tests.bench.identity import Told
    from hil_tests.judge.verdict import Verdict
    from hil_tests.run.plan import Plan
    from hil_tests.run.progress import Progress


BROKEN = "the bench is broken"


class Run:
    """A run under way.

    Args:
        plan: what is tested, and on what.
        started: now, with a time zone; names the folder.
        command: the command line, for the results and for repeating a test.
        root: where the tests lie; None = nobody asks for their state in git.
        ledger: where the findings go; None = to a folder of its own.

    Raises:
        ConfigError: there is no place for its folder.
    """

    def __init__(
        self,
        plan: Plan,
        started: datetime,
        command: Sequence[str],
        root: Path | None = None,
        ledger: Ledger | None = None,
    ) -> None:
        self.plan = plan
        self.command = tuple(command)
        self._root = root
        if ledger is None:
            folder = RunDirectory.create(Path(plan.settings["can_reports"]), started)
            ledger = Ledger(folder, started)
        self.ledger = ledger
        self.folder = ledger.folder
        self.verdicts: list[Verdict] = []
        self.broken: BenchError | None = None
        self.who: Identity = identify(plan, None, None)
        self.progress: Progress | None = None
        """Tells of tests that take long; None = nobody waits."""
        self._bench: Bench | None = None
        self._sink: PcapngSink | None = None
        self._draft: Draft | None = None
        self._test = ""
        self._claims: tuple[str, ...] = ()
        self._example = ""
        self._ended_at = 0
        """Up to here the test under way, or the last one, looked at the bus."""
        self._before = rows.reading(None)
        self._started = started

    # The bench.

    def open(self, opener: Callable[[Plan], Bench]) -> None:
        """Open the bench; what goes wrong is remembered and told by every test that needs it."""
        try:
            self._bench = opener(self.plan)
        except BenchError as error:
            self._break(error)
        self.who = self._identify()
        who, command = self.who, self.command
        self.ledger.open(header(self.plan, self._bench, who, self._started, command, self._root))

    def _identify(self) -> Identity:
        """Who is under test; the device is asked where it has an object dictionary."""
        bench, plan = self._bench, self.plan
        if bench is None or plan.profile.eds is None:
            return identify(plan, None, None)
        return identify(plan, *self._ask(bench))

    def _ask(self, bench: Bench) -> tuple[Told, str | None]:
        """Ask the device who it is; what it told, and where that is recorded."""
        return read_device(self.plan, bench, self.folder)

    def _break(self, cause: BenchError) -> None:
        """From now on the bench is broken."""
        self.broken = cause
        self.ledger.broken = str(cause)

    @property
    def bench(self) -> Bench:
        """The open bench.

        Raises:
            BenchError: it is broken; with the first cause.
        """
        if self.broken is not None:
            raise BenchError(f"{BROKEN}: {self.broken}")
        if self._bench is None:
            raise BenchError("the bench is not open; tests that use it run under the plugin")
        return self._bench

    @property
    def opened(self) -> Bench | None:
        """The bench, or None where it could not be opened."""
        return self._bench

    # A test.

    def begin(self, test: str, claims: Sequence[str], *, keep_trace: bool) -> None:
        """A test begins; its record is written as it comes.

        Args:
            test: its node id.
            claims: the requirements that it claims.
            keep_trace: the record is kept; else it is that of the example under way, and is
                kept where that is the one that fails.
        """
        bench = self.bench
        self._test, self._claims, self._example = test, tuple(claims), ""
        self._sink = self._new_sink("") if keep_trace else None
        self._draft = None if keep_trace else self._new_draft()
        self._before = rows.reading(bench)
        file = self._draft.sink if self._draft else self._sink
        self.ledger.begin(test, self.folder.relative(file.path) if file else None)
        sink = self._draft or self._sink
        bench.begin(*([sink] if sink else []))
        self._ended_at = bench.stage.port.now()
        if self._draft:
            self._draft.write(bench.opening)
        elif self._sink:
            self._sink.write(self._opening(bench.opening))
        if self.progress is not None:
            self.progress.begin(bench, test)

    def _new_sink(self, part: str) -> PcapngSink:
        port = self.bench.stage.port
        path = self.folder.trace_path(self._test, part)
        flush = not self.plan.virtual
        return PcapngSink(path, interface=port.name, clock=port.clock, flush=flush)

    def _new_draft(self) -> Draft | None:
        return Draft(self._new_sink("example"), self._opening)

    def _opening(self, opening: Moment) -> Moment:
        """What the record of a test begins with: how the bench stands, and what is judged."""
        told = {
            "test": self._test,
            "requirements": list(self._claims),
            "settings": self.plan.told,
        }
        return opening._replace(detail={**opening.detail, **told})

    def stand_in(self, test: str) -> bool:  # noqa: ARG002  a replay knows
        """Whether something else stands in for the body of a test."""
        return False

    def end(self, error: BaseException | None, claimed: str) -> BaseException | None:
        """A test's body has ended with `error`; what it ends with, monitors included."""
        if self.progress is not None:
            self.progress.end()
        bench = self._bench
        if bench is None or self.broken is not None:
            return error
        try:
            found = bench.end()
        except BenchError as broken:
            found = []
            # What the device did before the bench broke is not judged on half a record.
            error = error if outcome.is_bench_error(error) else broken
        for verdict in found:
            bench.record(verdict)
        self._ended_at = bench.known_until
        strict = bool(self.plan.settings["can_strict"])
        ends_with = outcome.ends_with(error, found, claimed, self.plan.requirements, strict)
        if isinstance(ends_with, BenchError):
            return self._suspect(bench, ends_with)
        return ends_with

    def _suspect(self, bench: Bench, error: BenchError) -> BenchError:
        """A bench that broke in a test: it goes on unless its port, peer or model is gone."""
        try:
            bench.stage.check()
        except BenchError as cause:
            # The plainer reason: a model that died explains a control server that hung up.
            self._break(cause)
            return cause
        return error

    def keep(self, came_of_it: str = INTERRUPTED, text: str = "") -> TraceFile | None:
        """Close the record of the test; None = there is none."""
        draft, self._draft = self._draft, None
        if draft is not None and came_of_it == INTERRUPTED:
            self._sink = draft.sink
        elif draft is not None:
            self._try(draft.drop)
        sink, bench = self._sink, self._bench
        if sink is None or bench is None:
            return None
        self._sink = None
        end, detail = self._ended_at, {"outcome": came_of_it, "text": text}
        if self._example:
            detail["example"] = self._example
        try:
            sink.write(Moment("end", end, end, detail))
            sink.close()
        except BenchError as error:
            self.ledger.problem(error)
        return rows.trace_file(sink.path, self.folder.relative(sink.path), len(bench.trace))

    def keep_last_example(self, error: BaseException | None) -> None:
        """Keep the record of the last example of a property: the one that failed.

        Args:
            error: what it failed with; Hypothesis notes on it how to repeat the example.
        """
        notes = "\n".join(getattr(error, "__notes__", ())).splitlines()
        self._example = next((line for line in notes if "@reproduce_failure" in line), "")
        draft, self._draft = self._draft, None
        if draft is not None:
            self._sink = draft.sink
            path = self.folder.trace_path(self._test, "shrunk")
            self._try(partial(draft.sink.rename, path))

    def _try(self, write: Callable[[], None]) -> None:
        """Write something; what goes wrong is a problem of the run."""
        try:
            write()
        except BenchError as error:
            self.ledger.problem(error)

    def store(self, ending: Ending, why: str) -> TestResult:
        """Write the result of a test; `why` is the reason in a line."""
        bench = self._bench
        verdicts = list(bench.verdicts) if bench else []
        trace = self.keep(ending.outcome, ending.text)
        self.verdicts.extend(verdicts)
        after = rows.reading(bench)
        strict = bool(self.plan.settings["can_strict"])
        result = rows.result_of(
            ending,
            rows.verdict_rows(verdicts, ending, self.plan.requirements, strict=strict),
            (self._before, after),
            busy=rows.busy_ns(bench) if bench and trace else None,
            trace=trace,
            reproduce=self.reproduce(ending.test),
        )
        self._before = after
        if bench:
            bench.verdicts = []
        self.ledger.add(result.to_json(), why)
        return result

    def reproduce(self, test: str) -> str:
        """A command line that repeats one test as it ran here."""
        seed = self.plan.settings["can_seed"]
        options = own_options(self.command, f"--can-seed={seed}")
        return " ".join(["pytest", *options, shlex.quote(test)])

    # The end.

    def close(self, own: int) -> int:
        """Put the device and the bench back, and finish the results.

        Args:
            own: the exit status that pytest would give.

        Returns:
            The exit status of the run; see `ledger.problems` for what could not be put back.
        """
        bench = self._bench
        self.keep()  # of a test that was interrupted
        if bench is not None:
            self._put_back(bench)
            try:
                bench.close()
            except Exception as error:  # noqa: BLE001
                self.ledger.problem(f"the bench could not be closed: {error}")
            self.ledger.account = _account(bench)
        return self.ledger.close(own, require_all=bool(self.plan.settings["can_require_all"]))

    def _put_back(self, bench: Bench) -> None:
        """Give the device what it had; the end of a run reports, it never raises."""
        home = bench.home
        if self.broken is not None:
            if home is not None and bench.parameters != home and not bench.stage.virtual:
                self.ledger.problem(
                    "the device could not be put back as it was: the bench is broken; commission"
                    f" it to node id {home.node_id}, {home.bit_rate} bit/s"
                )
            return
        try:
            bench.begin()
            bench.go_home()
        except Exception as error:  # noqa: BLE001
            self.ledger.problem(f"the device could not be put back as it was: {error}")


def _account(bench: Bench) -> Account:
    """What the bench went through."""
    late = bench.lateness
    return Account(bench.bus_ns, bench.frames, bench.stalls, len(late), late.worst_ns)


def own_options(command: Sequence[str], seed: str) -> list[str]:
    """The options of ours in a command line, with their values; and the seed in any case.

    Each is one word: pytest takes a path that stands by itself for a place of tests, even
    behind an option, and looks for its configuration there.
    """
    kept: list[str] = []
    parts = iter(command)
    for part in parts:
        word = f"{part}={next(parts, '')}" if part in TAKE_VALUES else part
        if word.startswith("--can-") and not word.startswith("--can-seed="):
            kept.append(shlex.quote(word))
    return [*kept, seed]
