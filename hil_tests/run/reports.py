"""From pytest's report of a test to ours: outcome, explanation, stored result."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import pytest

from hil_tests.errors import BenchError
from hil_tests.judge.verdict import DeviceFailure, InconclusiveResult
from hil_tests.reporting.junit import properties_of
from hil_tests.run import outcome, terminal
from hil_tests.run.rows import Ending
from hil_tests.run.session import BROKEN
from hil_tests.run.spread import hand_over
from hil_tests.run.stash import claimed

if TYPE_CHECKING:
    from hil_tests.reporting.rows import TestResult
    from hil_tests.run.session import Run

SHOWN_AS_SKIP = (outcome.NOT_RUN, outcome.NOT_APPLICABLE, outcome.INCONCLUSIVE)


@dataclass(frozen=True, slots=True)
class _Crash:
    """What pytest's summary shows beside the name of a test."""

    message: str
    path: str = ""
    lineno: int = 0


class Story:
    """What a report shows instead of a traceback; pytest asks for these attributes."""

    def __init__(self, text: str, summary: str) -> None:
        self._text = text
        self.reprcrash = _Crash(summary)

    def __str__(self) -> str:
        return self._text

    def toterminal(self, writer: Any) -> None:
        """Line by line, the first one as the error that it is."""
        first, *rest = self._text.splitlines() or [""]
        writer.line(first, red=True, bold=True)
        for line in rest:
            writer.line(line)


def conclude(
    item: pytest.Item, call: pytest.CallInfo[None], report: pytest.TestReport, run: Run
) -> None:
    """Name the outcome of a phase, and store the test's result when it is known."""
    error = call.excinfo.value if call.excinfo else None
    if error is None and report.when != "call":
        hand_over(report, run.ledger)
        return
    found = _outcome(error, report, run)
    where = f"{report.location[0]}:{(report.location[1] or 0) + 1}"
    text = _text(error, run, where)
    test = item.nodeid if report.when != "teardown" else f"{item.nodeid} (teardown)"
    why = terminal.one_line(_why(error))
    ending = Ending(test, found, call.duration, claimed(item), text, _title(item))
    result = run.store(ending, why)
    trace = result.trace.path if result.trace else ""
    hand_over(report, run.ledger)
    report.nodeproof = found  # type: ignore[attr-defined]
    if report.when != "teardown":
        _properties(item, report, result, run)
    _dress(report, found, text, error)
    if found == outcome.FAILED:
        tail = [f"  trace: {run.folder.path / trace}"] if trace else []
        tail.append(f"  repeat: {run.reproduce(item.nodeid)}")
        if isinstance(error, DeviceFailure):
            report.longrepr = Story("\n".join([text, *tail]), why)  # type: ignore[assignment]
        else:
            report.sections.append(("nodeproof", "\n".join(tail)))


def _title(item: pytest.Item) -> str:
    """The fact that a test states: the first paragraph of its docstring, on one line."""
    text = getattr(getattr(item, "obj", None), "__doc__", None) or ""
    return " ".join(text.strip().partition("\n\n")[0].split())


def _outcome(error: BaseException | None, report: pytest.TestReport, run: Run) -> str:
    """The outcome, where the user expects a failure an observation."""
    if error is None:
        return outcome.FAILED if report.failed else outcome.PASSED  # a strict xfail that passed
    strict = bool(run.plan.settings["can_strict"])
    found = outcome.classify(error, run.plan.requirements, strict)
    if hasattr(report, "wasxfail") and found == outcome.FAILED:
        del report.wasxfail
        return outcome.FAILED if strict else outcome.OBSERVATION
    return found


def _why(error: BaseException | None) -> str:
    """The reason in a sentence."""
    if isinstance(error, DeviceFailure | InconclusiveResult):
        return str(error.verdict)
    return str(error) or type(error).__name__ if error is not None else ""


def _text(error: BaseException | None, run: Run, where: str) -> str:
    """Why, for people; "" for a test that passed."""
    if error is None:
        return ""
    if isinstance(error, DeviceFailure | InconclusiveResult):
        requirement = run.plan.requirements.get(error.verdict.requirement)
        return terminal.explain(error, requirement, where)
    if outcome.classify(error, {}, strict=False) in SHOWN_AS_SKIP:
        return _why(error)
    return f"{type(error).__name__}: {error}"


def _properties(
    item: pytest.Item, report: pytest.TestReport, result: TestResult, run: Run
) -> None:
    """What pytest's own junit.xml says of a test besides its outcome."""
    classes = {each.id: each.kind.value for each in run.plan.requirements.values()}
    item.user_properties += list(properties_of(result, classes))
    report.user_properties = list(item.user_properties)


def _dress(report: pytest.TestReport, found: str, text: str, error: BaseException | None) -> None:
    """Make pytest's report say what we found; its own text stays for what is not ours."""
    if found in SHOWN_AS_SKIP:
        report.outcome = "skipped"
        report.longrepr = (report.location[0], report.location[1] or 0, text)
    elif found == outcome.OBSERVATION:
        report.outcome = "passed"
        report.longrepr = None
        report.sections.append(("observation", text))
    elif found in {outcome.FAILED, outcome.ERROR}:
        report.outcome = "failed"
        if isinstance(error, BenchError):
            # A bench that broke needs no traceback; what it was stands in a section of its own.
            short = terminal.one_line(text)
            again = report.when == "setup" or str(error).startswith(BROKEN)
            report.longrepr = Story(short if again else text, short)  # type: ignore[assignment]
