"""What a technician reads while a run goes on: its header, and a failure."""

from __future__ import annotations

from typing import TYPE_CHECKING

from hil_tests.judge.verdict import DeviceFailure, InconclusiveResult

if TYPE_CHECKING:
    from hil_tests.requirements import Requirement
    from hil_tests.run.plan import Plan
    from hil_tests.run.session import Run

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
        *([f"lateness of the host: {facts['lateness']}"] if facts["lateness"] else []),
        f"{bench.set_to}: {known}",
        *([run.who.line] if run.who.line else []),
        *(f"IDENTITY: {text}" for text in run.who.warnings),
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


def example_lines(error: BaseException) -> list[str]:
    """The example of a property that failed, as Hypothesis notes it, without our fixtures."""
    noted = "\n".join(getattr(error, "__notes__", ())).splitlines()
    return [line for line in noted if "=<hil_tests." not in line and "@reproduce" not in line]
