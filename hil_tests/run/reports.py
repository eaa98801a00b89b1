"""From pytest's report of a test to ours: outcome, explanation, stored result."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from hil_tests.judge.verdict import DeviceFailure, InconclusiveResult, NotApplicable, NotRun
from hil_tests.run import outcome, terminal
from hil_tests.run.selection import claimed

if TYPE_CHECKING:
    from hil_tests.run.session import Run

SHOWN_AS_SKIP = (outcome.NOT_RUN, outcome.NOT_APPLICABLE, outcome.INCONCLUSIVE)


def conclude(
    item: pytest.Item,
    call: pytest.CallInfo[None],
    report: pytest.TestReport,
    run: Run,
    reasons: dict[str, str],
) -> None:
    """Name the outcome of a phase, and store the test's result when it is known."""
    error = call.excinfo.value if call.excinfo else None
    if report.when == "teardown":
        return
    if report.when == "setup" and error is None:
        return
    ids = claimed(item)
    found = _outcome(error, run)
    where = f"{report.location[0]}:{(report.location[1] or 0) + 1}"
    text = _text(error, run, where)
    if found in {outcome.NOT_RUN, outcome.NOT_APPLICABLE}:
        reasons[item.nodeid] = text
    trace = run.store(item.nodeid, found, call.duration, ids, text)
    _dress(item, report, run, found, text, trace)


def _outcome(error: BaseException | None, run: Run) -> str:
    if isinstance(error, pytest.skip.Exception):
        return outcome.NOT_RUN
    strict = bool(run.plan.settings["can_strict"])
    return outcome.classify(error, run.plan.requirements, strict)


def _text(error: BaseException | None, run: Run, where: str) -> str:
    """Why, for people; "" for a test that passed."""
    if error is None:
        return ""
    if isinstance(error, DeviceFailure | InconclusiveResult):
        requirement = run.plan.requirements.get(error.verdict.requirement)
        return terminal.explain(error, requirement, where)
    if isinstance(error, NotRun | NotApplicable | pytest.skip.Exception):
        return str(error) or type(error).__name__
    return f"{type(error).__name__}: {error}"


def _dress(  # noqa: PLR0913  everything that the report shows
    item: pytest.Item,
    report: pytest.TestReport,
    run: Run,
    found: str,
    text: str,
    trace: str,
) -> None:
    """Make pytest's report say what we found."""
    report.nodeproof = found  # type: ignore[attr-defined]
    item.user_properties += [("requirement", name) for name in claimed(item)]
    item.user_properties.append(("outcome", found))
    if trace:
        item.user_properties.append(("trace", trace))
    report.user_properties = list(item.user_properties)
    if found in SHOWN_AS_SKIP:
        report.outcome = "skipped"
        report.longrepr = (report.location[0], report.location[1] or 0, text)
    elif found == outcome.OBSERVATION:
        report.outcome = "passed"
        report.sections.append(("observation", text))
    elif found == outcome.FAILED:
        tail = [f"  trace: {run.folder.path / trace}"] if trace else []
        tail.append(f"  repeat: {run.reproduce(item.nodeid)}")
        report.outcome = "failed"
        report.longrepr = "\n".join([text, *tail])  # type: ignore[assignment]
