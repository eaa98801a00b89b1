"""The acceptance suite on mutants: one warm process, a child of it for each.

pytest collects the suite once. Each mutant is then tried in a child of that process, which
has everything imported, ends at the first test that fails, and dies with whatever the mutant
did to it. How the right keypad runs through its lines, test by test, is found first: a test
that never comes by the changed statement cannot tell the mutant from the right keypad (both
run alike up to there), so it is left out. The others come in order of the work that they make
the device do, least first; so the order, and with it who kills, is the same in each run.

Time is processor time, never that of a clock: a busy machine makes no mutant hang.
"""

from __future__ import annotations

import json
import os
import resource
import signal
import time
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from functools import partial
from types import FrameType
from typing import Any

import pytest

from hil_tests.bench.bench import Bench
from hil_tests.bench.kinds import bench_for
from hil_tests.bench.virtual import VirtualStage
from hil_tests.judge.verdict import Outcome, Verdict
from hil_tests.requirements import Kind
from hil_tests.run import stash
from hil_tests.run.plan import Plan
from hil_tests.run.session import Run
from node_model import keypad
from node_model.devices import KEYPAD, Blueprint
from tests.meta.machine.mutating import Mutant
from tests.meta.machine.serving import Maker, PrivateModules, place_of
from tests.meta.machine.still import MARK, Spins

PATIENCE_S = 2.0
"""Processor time that a test may take beyond ten times what the right keypad needs in it."""

MEMORY = 2 << 30
"""Bytes of a child; a mutant that never stops storing ends there."""

KILLED, SURVIVED, HUNG, UNDECIDED = "killed", "survives", "hung", "undecided"
_WITHOUT_VERDICT = ("error", "inconclusive")


Tell = Callable[[dict[str, Any]], None]
"""With this a child tells what it found."""

Job = Callable[[Tell], None]


@dataclass(slots=True)
class Result:
    """What the suite said of one mutant.

    Args:
        outcome: "killed" (a test failed), "survives" (every test passed), "hung" (a test did
            not end), or "undecided" (a test could not judge, and none failed).
        test: which test.
        requirement: which requirement it blamed.
        text: what it said.
        crash: what the device's program died of, "" = it did not.
        tests: how many were run.
        seconds: processor time.
    """

    outcome: str
    test: str = ""
    requirement: str = ""
    text: str = ""
    crash: str = ""
    tests: int = 0
    seconds: float = 0.0


@dataclass(frozen=True, slots=True)
class Footprint:
    """How the right keypad comes through a test.

    Args:
        outcome: of the test.
        places: the statements that were executed, see `place_of`.
        frames: how many were on the bus; how much work the test is.
        seconds: processor time.
    """

    outcome: str
    places: Collection[str]
    frames: int
    seconds: float

    def covers(self, mutant: Mutant) -> bool:
        """Whether the test comes by the changed statement; what acts on import, all do."""
        return not mutant.runs or place_of(mutant.module, mutant.lines[0]) in self.places


class Trials:
    """A pytest plugin: tries devices on the tests that were collected.

    Args:
        workers: how many children at a time.
        job: what to do with this object once pytest has collected.
    """

    def __init__(self, workers: int, job: Callable[[Trials], None]) -> None:
        self._workers = workers
        self._job = job
        self._session: pytest.Session | None = None
        self._items: dict[str, pytest.Item] = {}
        self.footprints: dict[str, Footprint] = {}

    def pytest_collection_finish(self, session: pytest.Session) -> None:
        """Do the job, and leave nothing for the ordinary loop."""
        self._session = session
        self._items = {item.nodeid: item for item in session.items if stash.is_ours(item)}
        self._job(self)
        session.items.clear()

    @property
    def tests(self) -> Sequence[str]:
        """All tests of the suite."""
        return tuple(self._items)

    def survey(self) -> Mapping[str, Footprint]:
        """Run the right keypad through all tests.

        Raises:
            RuntimeError: a test does not pass on it.
        """
        (died,) = _in_children([self._footprints], 1)
        for test, found in _told(died).items():
            if found["outcome"] in {"failed", *_WITHOUT_VERDICT}:
                raise RuntimeError(f"the right keypad in {test}: {found['outcome']}")
            self.footprints[test] = Footprint(**found)
        return self.footprints

    def order(self, mutant: Mutant) -> list[str]:
        """The tests that can tell this mutant, the likely and quick ones first."""
        apt = [test for test, footprint in self.footprints.items() if footprint.covers(mutant)]
        return sorted(apt, key=lambda test: self.footprints[test].frames)

    def try_all(self, mutants: Sequence[Mutant]) -> Iterator[Result]:
        """Try mutants on every core, in order."""
        jobs = [partial(self._judge, mutant, self.order(mutant)) for mutant in mutants]
        for each in _in_children(jobs, self._workers):
            try:
                result = Result(**_told(each))
            except RuntimeError as error:
                result = Result(UNDECIDED, text=str(error))
            result.seconds = each.seconds
            yield result

    # In a child.

    def _footprints(self, tell: Tell) -> None:
        """Run every test with the right keypad, which tells where it comes by."""
        seen: set[str] = set()
        run = self._open(Maker(PrivateModules(seen=seen)))
        found = {}
        for test, item, after in self._turns(self.tests):
            seen.clear()
            frames, began = run.bench.frames, time.process_time()
            _protocol(item, after)
            footprint = Footprint(
                run.ledger.outcomes.get(test, "not run"),
                sorted(seen),
                run.bench.frames - frames,
                time.process_time() - began,
            )
            found[test] = asdict(footprint)
        tell(found)

    def _judge(self, mutant: Mutant, tests: Sequence[str], tell: Tell) -> None:
        """Run tests until one fails."""
        maker = Maker(PrivateModules(mutant))
        run = self._open(maker)
        result = Result(SURVIVED)
        for done, (test, item, after) in enumerate(self._turns(tests), 1):

            def stuck(where: str, test: str = test, done: int = done) -> None:
                tell(asdict(Result(HUNG, test, "", where, maker.crashes.first, done)))

            told = len(run.verdicts)
            with _patience(self._patience_s(test), stuck):
                _protocol(item, after)
            outcome = run.ledger.outcomes.get(test, "not run")
            killed = _killed(run.verdicts[told:], test, stash.claimed(item))
            if outcome == "failed" and not _is_free(run, killed.requirement):
                result = killed
            elif outcome in _WITHOUT_VERDICT and result.outcome == SURVIVED:
                result = Result(UNDECIDED, test, "", outcome)
            result.tests = done
            if result.outcome == KILLED:
                break
        result.crash = maker.crashes.first
        tell(asdict(result))

    def _patience_s(self, test: str) -> float:
        return PATIENCE_S + 10 * self.footprints[test].seconds

    def _turns(
        self, tests: Sequence[str]
    ) -> Iterator[tuple[str, pytest.Item, pytest.Item | None]]:
        """Tests with the one that follows: what both share is not taken down between."""
        items = [self._items[test] for test in tests]
        yield from zip(tests, items, [*items[1:], None][: len(items)], strict=True)

    def _open(self, maker: Maker) -> Run:
        """A run of its own on a virtual bench with that device."""
        assert self._session is not None
        config = self._session.config
        facts = keypad.load(stash.plan_of(config).profile.path)

        def bench(plan: Plan) -> Bench:
            stage = VirtualStage(Blueprint(KEYPAD, facts, maker), plan.bench_name)
            return bench_for(stage, plan.profile, plan.home)

        run = _Untraced(stash.plan_of(config), datetime.now(UTC), ())
        config.stash[stash.RUN] = run
        run.open(bench)
        return run


class _Untraced(Run):
    """A run that writes no traces: nobody will look at them."""

    def begin(
        self,
        test: str,
        claims: Sequence[str],
        *,
        keep_trace: bool,  # noqa: ARG002  kept by none
    ) -> None:
        """A test begins."""
        super().begin(test, claims, keep_trace=False)

    def _new_draft(self) -> None:
        """No record of an example either."""


def _protocol(item: pytest.Item, after: pytest.Item | None) -> None:
    """Set up, run and report a test, as pytest does it."""
    item.config.hook.pytest_runtest_protocol(item=item, nextitem=after)


def _killed(verdicts: Sequence[Verdict], test: str, claimed: Sequence[str]) -> Result:
    """The kill as the failed test tells it."""
    failures = [each for each in verdicts if each.outcome is Outcome.FAIL]
    verdict = failures[-1] if failures else None
    requirement = (verdict.requirement if verdict else "") or (claimed[0] if claimed else "")
    return Result(KILLED, test, requirement, str(verdict) if verdict else "an assertion")


def _is_free(run: Run, requirement: str) -> bool:
    """Whether a row is left to the maker; a failure that names one kills nothing."""
    row = run.plan.requirements.get(requirement)
    return row is not None and row.kind is Kind.CHOICE


@contextmanager
def _patience(seconds: float, stuck: Callable[[str], None]) -> Iterator[None]:
    """What is done within takes so much processor time at most.

    A device that spins is stopped, and stands still; if it is none, `stuck` is told where.
    """

    def give_up(_: int, frame: FrameType | None) -> None:
        where = _place(frame)
        if where:
            raise Spins(where)
        stuck("an endless row of events")
        os._exit(0)  # whatever was caught in a loop is not asked to leave it

    signal.signal(signal.SIGPROF, give_up)
    signal.setitimer(signal.ITIMER_PROF, seconds, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)


def _place(frame: FrameType | None) -> str:
    """The function of the device that is being executed, "" = none."""
    while frame is not None:
        if frame.f_code.co_filename.startswith(MARK):
            return frame.f_code.co_qualname
        frame = frame.f_back
    return ""


# Children.


@dataclass(frozen=True, slots=True)
class _Died:
    """What is left of a child."""

    told: dict[str, Any] | None
    status: int
    seconds: float


def _in_children(jobs: Sequence[Job], workers: int) -> Iterator[_Died]:
    """Do each job in a child; what they told in order, as soon as it is there."""
    running: dict[int, tuple[int, int]] = {}
    ended: dict[int, _Died] = {}
    begun = 0
    for wanted in range(len(jobs)):
        while wanted not in ended:
            while begun < len(jobs) and len(running) < workers:
                pid, slate = _child(jobs[begun])
                running[pid] = begun, slate
                begun += 1
            pid, status, usage = os.wait4(-1, 0)
            if pid in running:
                number, slate = running.pop(pid)
                seconds = usage.ru_utime + usage.ru_stime
                ended[number] = _Died(_read(slate), status, seconds)
        yield ended.pop(wanted)


def _told(died: _Died) -> dict[str, Any]:
    """What a child told.

    Raises:
        RuntimeError: it told nothing, or that it could not.
    """
    told = died.told
    if told is None or "error" in told:
        raise RuntimeError(f"a child ended with {told}, status {died.status}")
    return told


def _child(job: Job) -> tuple[int, int]:
    """Begin a job in a child of this process; its number, and where it will write."""
    slate = os.memfd_create("slate")
    pid = os.fork()
    if pid:
        return pid, slate
    try:
        resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
        silence = os.open(os.devnull, os.O_WRONLY)
        os.dup2(silence, 1)
        os.dup2(silence, 2)
        job(lambda told: _write(slate, told))
    except BaseException as error:  # noqa: BLE001  there is nobody above to tell it to
        _write(slate, {"error": f"{type(error).__name__}: {error}"})
    os._exit(0)


def _write(slate: int, told: dict[str, Any]) -> None:
    with os.fdopen(os.dup(slate), "w") as file:
        file.truncate(0)
        json.dump(told, file)


def _read(slate: int) -> dict[str, Any] | None:
    with os.fdopen(slate) as file:
        file.seek(0)
        text = file.read()
    told: dict[str, Any] | None = json.loads(text) if text else None
    return told
