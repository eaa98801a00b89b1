"""What a technician reads: the header of a run, a failure, and the closing lines."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING

from hil_tests.clock import S, show_span
from hil_tests.judge.verdict import DeviceFailure, InconclusiveResult, Outcome
from hil_tests.run import outcome

if TYPE_CHECKING:
    from hil_tests.requirements import Requirement
    from hil_tests.run.plan import Plan
    from hil_tests.run.session import Run, Told

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


def sections(run: Run) -> Iterator[tuple[str, list[str]]]:
    """Titles and lines of what a run ends with: only what is not plainly passed or failed."""
    for name in (outcome.NOT_RUN, outcome.NOT_APPLICABLE):
        lines = reason_lines([each for each in run.told if each.outcome == name])
        if lines:
            yield name, lines
    for name in (outcome.OBSERVATION, outcome.INCONCLUSIVE):
        told = [each for each in run.told if each.outcome == name]
        if told:
            yield name, [line for each in told for line in _told_lines(run, each)]
    if run.broken is not None:
        yield "bench broken", [str(run.broken)]
    if run.problems:
        yield "problems of the bench", run.problems
    yield "nodeproof", closing_lines(run)


def _told_lines(run: Run, told: Told) -> list[str]:
    """Which test, why, and where to look."""
    lines = [told.test, f"    {told.why}"]
    return [*lines, f"    trace: {run.folder.path / told.trace}"] if told.trace else lines


def example_lines(error: BaseException) -> list[str]:
    """The example of a property that failed, as Hypothesis notes it, without our fixtures."""
    noted = "\n".join(getattr(error, "__notes__", ())).splitlines()
    return [line for line in noted if "=<hil_tests." not in line]


def closing_lines(run: Run) -> list[str]:
    """Verdict counts, bus hours, frames, stalls, and where to look."""
    counts = Counter(run.outcomes.values())
    shown = [f"{counts[name]} {name}" for name in outcome.REPORTED if counts[name]]
    bench = run.opened
    bus_ns, frames = (bench.bus_ns, bench.frames) if bench else (0, 0)
    seen = f"{bus_ns / _HOUR:.2f} bus hours, {frames} frames, {len(run.verdicts)} checks"
    lines = [f"{', '.join(shown) or 'nothing was run'}; {seen}"]
    if bench is not None and (bench.stalls or len(bench.lateness)):
        lines.append(
            f"the host was busy: the suite was stopped {bench.stalls} times, the model sent"
            f" {len(bench.lateness)} frames late (worst {show_span(bench.lateness.worst_ns)})"
        )
    lines += characteristic_lines(run)
    lines.append(f"results and traces: {run.folder.path}")
    return lines + run.papers


def characteristic_lines(run: Run) -> list[str]:
    """What the source leaves open, and how this device does it."""
    found = {
        (verdict.requirement, verdict.text)
        for verdict in run.verdicts
        if verdict.outcome is Outcome.CHARACTERISTIC
    }
    if not found:
        return []
    return ["characteristics of this device:"] + [
        f"  {name}: {text}" for name, text in sorted(found)
    ]


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
