"""What a technician reads: the header of a run, a failure, and the closing lines."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING

from hil_tests.clock import S, show_span
from hil_tests.judge.verdict import DeviceFailure, InconclusiveResult
from hil_tests.run import outcome

if TYPE_CHECKING:
    from hil_tests.requirements import Requirement
    from hil_tests.run.ledger import Ledger, Told
    from hil_tests.run.plan import Plan
    from hil_tests.run.session import Run

_HOUR = 3600 * S
_NAMED_TESTS = 4
_DEVICES = {
    "virtual": "bundled model in virtual time",
    "model": "bundled model in a process of its own",
    "external": "external device",
}


def plan_lines(plan: Plan) -> list[str]:
    """What was chosen, before anything is touched."""
    device = f"device: {_DEVICES[plan.device]}, profile {plan.profile.name} ({plan.why})"
    lines = [device]
    if plan.recording is not None:
        count = len(plan.recording.tests)
        lines.append(f"REPLAY of {count} recorded tests: nothing is moved, nobody waits")
    if plan.mutant:
        lines.append(f"MUTANT: {plan.mutant} - a model that is faulty or different on purpose")
    lines.append(f"seed: {plan.settings['can_seed']}   bench: {plan.bench_name}")
    chosen = plan.settings.chosen()
    if chosen:
        lines.append("settings: " + ", ".join(chosen))
    return lines


def bench_lines(run: Run) -> list[str]:
    """The opened bench: bus, clock and its doubt, where the run is written."""
    bench = run.opened
    if bench is None or run.broken is not None:
        return [f"BENCH BROKEN: {run.broken}"]
    facts = bench.description()
    known = "not known" if bench.parameters is None else str(bench.parameters)
    return [
        f"bus: {facts['bus']}",
        f"clock: {facts['clock']}",
        f"{bench.set_to}: {known}",
        f"written to: {run.folder.path}",
    ]


def explain(error: BaseException, requirement: Requirement | None, where: str) -> str:
    """A failure like a colleague would tell it; "" where pytest's own text serves better."""
    if not isinstance(error, DeviceFailure | InconclusiveResult):
        return ""
    verdict = error.verdict
    lines = []
    if requirement is not None:
        source, clause = requirement.source, requirement.clause
        clause = clause if clause.startswith(source) else f"{source}, {clause}"
        lines.append(f"{requirement.id} ({requirement.kind.value}; {clause})")
        lines.append(f"  requires: {requirement.text}")
    story = str(verdict).removeprefix(f"{verdict.requirement}: ")
    lines.append(f"  {verdict.outcome.value}: {story}")
    _, _, evidence = str(error).partition("\n")
    if evidence:
        lines += ["  on the bus:", evidence]
    lines += [f"  {line}" for line in example_lines(error)]
    lines.append(f"  checked at: {where}")
    return "\n".join(lines)


def one_line(text: str, most: int = 200) -> str:
    """The first line of a text, cut where it would fill the screen."""
    first = text.strip().partition("\n")[0]
    return first if len(first) <= most else f"{first[: most - 3]}..."


def sections(ledger: Ledger) -> Iterator[tuple[str, list[str]]]:
    """Titles and lines of what a run ends with: only what is not plainly passed or failed."""
    for name in (outcome.NOT_RUN, outcome.NOT_APPLICABLE):
        lines = reason_lines([each for each in ledger.told if each.outcome == name])
        if lines:
            yield name, lines
    for name in (outcome.OBSERVATION, outcome.INCONCLUSIVE):
        told = [each for each in ledger.told if each.outcome == name]
        if told:
            yield name, [line for each in told for line in _told_lines(ledger, each)]
    if ledger.broken:
        yield "bench broken", [ledger.broken]
    if ledger.problems:
        yield "problems of the bench", ledger.problems
    yield "nodeproof", closing_lines(ledger)


def _told_lines(ledger: Ledger, told: Told) -> list[str]:
    """Which test, why, and where to look."""
    lines = [told.test, f"    {told.why}"]
    return [*lines, f"    trace: {ledger.folder.path / told.trace}"] if told.trace else lines


def example_lines(error: BaseException) -> list[str]:
    """The example of a property that failed, as Hypothesis notes it, without our fixtures."""
    noted = "\n".join(getattr(error, "__notes__", ())).splitlines()
    return [line for line in noted if "=<hil_tests." not in line and "@reproduce" not in line]


def closing_lines(ledger: Ledger) -> list[str]:
    """Verdict counts, bus hours, frames, stalls, and where to look."""
    counts = Counter(ledger.outcomes.values())
    shown = [f"{counts[name]} {name}" for name in outcome.REPORTED if counts[name]]
    account = ledger.account
    hours, frames = account.bus_ns / _HOUR, account.frames
    seen = f"{hours:.2f} bus hours, {frames} frames, {ledger.checks} checks"
    lines = [f"{', '.join(shown) or 'nothing was run'}; {seen}"]
    if account.stalls or account.late_frames:
        lines.append(
            f"the host was busy: the suite was stopped {account.stalls} times, the model sent"
            f" {account.late_frames} frames late (worst {show_span(account.host_late_ns)})"
        )
    lines += characteristic_lines(ledger)
    lines.append(f"results and traces: {ledger.folder.path}")
    return lines + ledger.papers


def characteristic_lines(ledger: Ledger) -> list[str]:
    """What the source leaves open, and how this device does it."""
    found = [
        f"  {name}: {text}"
        for name, standing in sorted(ledger.standings.items())
        for text in sorted(standing.characteristics)
    ]
    return ["characteristics of this device:", *found] if found else []


def reason_lines(told: Iterable[Told]) -> list[str]:
    """Tests that were not run, by reason."""
    by_reason: dict[str, list[str]] = {}
    for each in told:
        by_reason.setdefault(each.why, []).append(each.test.rpartition("::")[2])
    lines = []
    for reason, tests in sorted(by_reason.items()):
        more = len(tests) - _NAMED_TESTS
        shown = ", ".join(tests[:_NAMED_TESTS]) + (f" and {more} more" if more > 0 else "")
        lines.append(f"  {len(tests):3d}  {reason}")
        lines.append(f"       {shown}")
    return lines
