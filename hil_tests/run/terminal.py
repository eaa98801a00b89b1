"""What a technician reads: the header of a run, a failure, and the closing lines."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

from hil_tests.clock import S, show_span
from hil_tests.judge.verdict import DeviceFailure, InconclusiveResult, Outcome
from hil_tests.run import outcome

if TYPE_CHECKING:
    from hil_tests.requirements import Requirement
    from hil_tests.run.plan import Plan
    from hil_tests.run.session import Run

_HOUR = 3600 * S
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
    parameters = bench.parameters
    if parameters is None:
        known = "not known"
    else:
        known = (
            f"node id {parameters.node_id}, {parameters.bit_rate} bit/s, heartbeat"
            f" {parameters.heartbeat_ms} ms, debounce {parameters.debounce * 100} ms"
        )
    return [
        f"bus: {facts['bus']}",
        f"clock: {facts['clock']}",
        f"commissioned to: {known}",
        f"written to: {run.folder.path}",
    ]


def explain(error: BaseException, requirement: Requirement | None, where: str) -> str:
    """A failure like a colleague would tell it; "" where pytest's own text serves better."""
    if not isinstance(error, DeviceFailure | InconclusiveResult):
        return ""
    verdict = error.verdict
    lines = []
    if requirement is not None:
        clause = f"{requirement.source}, {requirement.clause}"
        lines.append(f"{requirement.id} ({requirement.kind.value}; {clause})")
        lines.append(f"  requires: {requirement.text}")
    lines.append(f"  {verdict.outcome.value}: {str(verdict).removeprefix(verdict.requirement + ': ')}")
    _, _, evidence = str(error).partition("\n")
    if evidence:
        lines += ["  on the bus:", evidence]
    lines.append(f"  checked at: {where}")
    return "\n".join(lines)


def closing_lines(run: Run) -> list[str]:
    """Verdict counts, bus hours, frames, stalls, and where to look."""
    counts = Counter(run.outcomes.values())
    shown = [f"{counts[name]} {name}" for name in outcome.REPORTED if counts[name]]
    bench = run.opened
    bus_ns, frames = (bench.bus_ns, bench.frames) if bench else (0, 0)
    lines = [
        f"{', '.join(shown) or 'nothing was run'}; {bus_ns / _HOUR:.2f} bus hours,"
        f" {frames} frames, {len(run.verdicts)} checks"
    ]
    if bench is not None and (bench.stalls or len(bench.lateness)):
        lines.append(
            f"the host was busy: the suite was stopped {bench.stalls} times, the model sent"
            f" {len(bench.lateness)} frames late (worst {show_span(bench.lateness.worst_ns)})"
        )
    lines += characteristic_lines(run)
    lines.append(f"results and traces: {run.folder.path}")
    return lines


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


def reason_lines(run: Run, reasons: dict[str, str]) -> list[str]:
    """Tests that were not run, by reason."""
    by_reason: dict[str, list[str]] = {}
    for test, reason in reasons.items():
        by_reason.setdefault(reason, []).append(test.rpartition("::")[2])
    lines = []
    for reason, tests in sorted(by_reason.items()):
        shown = ", ".join(tests[:4]) + (f" and {len(tests) - 4} more" if len(tests) > 4 else "")  # noqa: PLR2004
        lines.append(f"  {len(tests):3d}  {reason}")
        lines.append(f"       {shown}")
    return lines
