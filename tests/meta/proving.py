"""The acceptance suite in one warm process, and models put in front of it.

Pytest collects the tests once. A test is then called as the plugin calls it, on a bench
whose virtual stage holds the model: the device is a parameter of the world. Each model has
a process of its own, forked from the warm one, so nothing that ran before reaches it; a
model that hangs or breaks its process is told from one that passes. A test in which a model does
just what the right one does is not run again, see `alike`.
"""

from __future__ import annotations

import gc
import io
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import redirect_stdout
from dataclasses import dataclass, replace
from functools import partial
from itertools import zip_longest
from multiprocessing import get_context
from multiprocessing.connection import Connection, wait
from pathlib import Path
from typing import Any

import hypothesis
import pytest

from hil_tests.bench.bench import Bench
from hil_tests.bench.tools import tool
from hil_tests.bench.virtual import VirtualStage
from hil_tests.judge.verdict import Outcome
from hil_tests.run import outcome, stash
from hil_tests.run.opening import bench_on, blueprint_of
from hil_tests.run.plan import Plan
from hil_tests.trace import Sink
from node_model.devices import Blueprint
from node_model.node import Panel
from tests.meta.alike import Asked, is_alike, witnessed

ROOT = Path(__file__).parents[2]
EXAMPLES = 8
"""Of a property, besides its written ones: always the same."""

PATIENCE_S = 300
"""How long a model may take before it counts as hung; a plain one takes about two seconds."""

TEXT = 300
"""So much of a text is kept."""

MANY = 8
"""Models for which it pays to try the right one beforehand, see `warm_up`."""

_CONTEXT = get_context("fork")

BAD = (Outcome.FAIL, Outcome.INCONCLUSIVE)


@dataclass(frozen=True, slots=True)
class Case:
    """An acceptance test as pytest collected it.

    Args:
        test: its name, `file.py::test[parameters]`.
        claims: the requirements that it claims.
        body: its function.
        parameters: of its own.
        asks: for these facilities of the bench.
    """

    test: str
    claims: tuple[str, ...]
    body: Callable[..., object]
    parameters: Mapping[str, object]
    asks: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Suite:
    """The acceptance tests, and the plan that they are run by."""

    plan: Plan
    cases: tuple[Case, ...]


@dataclass(frozen=True, slots=True)
class Finding:
    """What a test found that is not right.

    Args:
        requirement: that it is held against.
        outcome: "failed" or "inconclusive".
        text: the first of these verdicts.
    """

    requirement: str
    outcome: str
    text: str


@dataclass(frozen=True, slots=True)
class Result:
    """What came of one test on one model.

    Args:
        test: its name.
        outcome: in the words of every report.
        text: what it ended with, "" where it passed.
        findings: every verdict that is not right, one for each requirement.
    """

    test: str
    outcome: str
    text: str
    findings: tuple[Finding, ...]


@dataclass(frozen=True, slots=True)
class Trial:
    """All tests on one model.

    Args:
        model: its name; "" = the right one.
        results: of every test that did not just pass, in their order.
        broken: why there is no result, "" = there is.
        seconds: of processor time.
    """

    model: str
    results: tuple[Result, ...]
    broken: str = ""
    seconds: float = 0.0


class _Collected:
    """Keeps what pytest found."""

    def __init__(self) -> None:
        self.suite: Suite | None = None

    def pytest_collection_finish(self, session: pytest.Session) -> None:
        """Every test of ours that this bench can run; long exploration is a job of its own."""
        left_out = ("skip", "explores")
        items = [item for item in session.items if not any(map(item.get_closest_marker, left_out))]
        self.suite = Suite(stash.plan_of(session.config), tuple(map(_case, items)))


def collect(*arguments: str) -> Suite:
    """Collect the acceptance tests as `pytest --can-strict` does, and shorten the properties.

    Raises:
        RuntimeError: pytest could not.
    """
    collected, said = _Collected(), io.StringIO()
    folder = str(ROOT / "hil_tests" / "acceptance")
    options = ["--collect-only", "--can-strict", "--assert=plain", "-p", "no:cacheprovider"]
    command = ["-c", str(ROOT / "pyproject.toml"), f"--rootdir={ROOT}", *options, *arguments]
    with redirect_stdout(said):
        status = pytest.main([*command, folder], plugins=[collected])
    if status != 0 or collected.suite is None:
        raise RuntimeError(f"pytest could not collect {folder}:\n{said.getvalue()}")
    return collected.suite


def _case(item: pytest.Item) -> Case:
    assert isinstance(item, pytest.Function)
    if stash.is_property(item):
        _shorten(item.obj)
    parameters = dict(item.callspec.params) if hasattr(item, "callspec") else {}
    asks = tuple(name for name in item._fixtureinfo.argnames if name not in parameters)
    name = item.nodeid.rpartition("/")[2]
    return Case(name, stash.claimed(item), item.obj, parameters, asks)


def _shorten(test: Any) -> None:
    """A few examples of a property, the same each time, none shrunk."""
    test._hypothesis_internal_use_settings = hypothesis.settings(
        test._hypothesis_internal_use_settings,
        max_examples=EXAMPLES,
        derandomize=True,
        phases=(hypothesis.Phase.explicit, hypothesis.Phase.generate),
    )


def try_case(
    case: Case,
    bench: Bench,
    plan: Plan,
    *sinks: Sink,
    made: dict[str, object] | None = None,
) -> Result:
    """Run a test as the plugin does, without files; its record goes to the sinks.

    Args:
        case: the test.
        bench: on which.
        plan: of the run.
        sinks: see `BenchCore.begin`.
        made: tools that tests before asked for, by name; new ones are put there.
    """
    made = {} if made is None else made
    bench.begin(*sinks)
    error: BaseException | None = None
    try:
        for name in case.asks:
            if name not in made:
                made[name] = tool(bench, name)
        case.body(**case.parameters, **{name: made[name] for name in case.asks})
    except (Exception, pytest.fail.Exception, pytest.skip.Exception) as raised:  # noqa: BLE001
        error = raised
    found = bench.end()
    for verdict in found:
        bench.record(verdict)
    error = outcome.ends_with(error, found, case.claims[0], plan.requirements, strict=True)
    came_of_it = outcome.classify(error, plan.requirements, strict=True)
    text = "" if error is None else str(getattr(error, "verdict", repr(error)))
    findings = tuple(_findings(bench, case.claims[0]))
    if came_of_it == outcome.FAILED and not findings:  # an assertion of the test's own
        findings = (Finding(case.claims[0], outcome.FAILED, text),)
    return Result(case.test, came_of_it, text[:TEXT], findings)


def _findings(bench: Bench, claimed: str) -> Iterator[Finding]:
    """Verdicts that are not right, the first of each kind."""
    seen = set()
    for verdict in bench.verdicts:
        kind = (verdict.requirement or claimed, verdict.outcome.value)
        if verdict.outcome in BAD and kind not in seen:
            seen.add(kind)
            yield Finding(*kind, str(verdict)[:TEXT])


@dataclass(frozen=True, slots=True)
class Known:
    """A test that was run on the right model.

    Args:
        result: what came of it.
        asked: of the model in it.
    """

    result: Result
    asked: Sequence[Asked]


def witness(suite: Suite) -> list[Known]:
    """Put the right model under every test, and write down what is asked of it."""
    blueprint = blueprint_of(suite.plan)
    known = []
    for case in suite.cases:
        asked: list[Asked] = []
        make = partial(_behind_a_witness, blueprint, asked)
        result = _try_alone(suite.plan, case, replace(blueprint, maker=make))
        known.append(Known(result, asked))
    return known


def _behind_a_witness(
    blueprint: Blueprint[Any], asked: list[Asked], facts: object, image: bytes
) -> Panel:
    return witnessed(blueprint.maker(facts, image), image, asked)


def try_model(suite: Suite, name: str, known: Sequence[Known] = ()) -> Trial:
    """Put one model under every test, each on a bench of its own; "" = the right one.

    Args:
        suite: the tests.
        name: of the model.
        known: what came of each test on the right model. A test in which this one does the very
            same, see `alike`, is not run again.
    """
    began = time.process_time()
    plan = replace(suite.plan, mutant=name or None)
    blueprint = blueprint_of(plan)
    results = []
    for case, right in zip_longest(suite.cases, known):
        if right is not None and is_alike(blueprint.make, right.asked):
            results.append(right.result)
        else:
            results.append(_try_alone(plan, case, blueprint))
    told = tuple(each for each in results if each.outcome != outcome.PASSED or each.findings)
    return Trial(name, told, seconds=time.process_time() - began)


def _try_alone(plan: Plan, case: Case, blueprint: Blueprint[Any]) -> Result:
    bench = bench_on(VirtualStage(blueprint, plan.bench_name), plan)
    return try_case(case, bench, plan)


class _Worker:
    """A process that tries one model, forked from this one."""

    def __init__(self, suite: Suite, name: str, known: Sequence[Known]) -> None:
        self.name = name
        self.pipe, answer = _CONTEXT.Pipe(duplex=False)
        self._process = _CONTEXT.Process(target=_serve, args=(suite, name, known, answer))
        self._process.start()
        answer.close()
        self._began = time.monotonic()

    def is_over(self) -> bool:
        """It has an answer, or will never have one."""
        return self.pipe.poll() or time.monotonic() - self._began > PATIENCE_S

    def end(self) -> Trial:
        """What came of it."""
        trial = Trial(self.name, (), f"did not end within {PATIENCE_S} s")
        if self.pipe.poll():
            try:
                trial = self.pipe.recv()
            except EOFError:
                self._process.join()
                trial = Trial(self.name, (), f"its process ended: {self._process.exitcode}")
        self._process.kill()
        self._process.join()
        self.pipe.close()
        return trial


def _serve(suite: Suite, name: str, known: Sequence[Known], answer: Connection) -> None:
    # The process ends with its model: to look for garbage costs a quarter of its time, to keep
    # it a hundred megabytes.
    gc.disable()
    answer.send(try_model(suite, name, known))


def warm_up(suite: Suite) -> list[Known]:
    """Do once what every process that is forked from this one would have to do again.

    Half of a second that a model takes goes into what is the same for all: tables that are
    made when first asked for, the constants that Hypothesis reads from the sources, bytecode
    that specialises. What was made for the right model holds nothing of it.
    """
    known = witness(suite)
    gc.collect()
    gc.freeze()  # else each process would write into pages that it shares with this one
    return known


def try_each(suite: Suite, names: Sequence[str], workers: int) -> Iterator[Trial]:
    """Try models, so many at once, each in a process of its own; told as they end.

    Args:
        suite: the tests.
        names: of the models; "" = the right one.
        workers: 0 = all in this very process, one after the other.
    """
    if not workers:
        yield from (try_model(suite, name) for name in names)
        return
    known = warm_up(suite) if len(names) > MANY else []
    left, busy = list(reversed(names)), list[_Worker]()
    while left or busy:
        while left and len(busy) < workers:
            busy.append(_Worker(suite, left.pop(), known))
        wait([each.pipe for each in busy], timeout=1.0)
        over = [each for each in busy if each.is_over()]
        busy = [each for each in busy if each not in over]
        yield from (each.end() for each in over)
