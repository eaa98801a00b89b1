"""A test on a model, recorded; then the same test on the record."""

from __future__ import annotations

from pathlib import Path

from hil_tests.bench.bench import Bench
from hil_tests.bench.kinds import bench_for
from hil_tests.replay.record import load_record
from hil_tests.replay.stage import ReplayStage
from hil_tests.replay.standing import stand
from hil_tests.reporting.pcapng import PcapngSink
from hil_tests.run.plan import Plan
from hil_tests.trace import Moment
from tests.meta.proving import Case, Result, Suite, try_case


def is_scripted(case: Case) -> bool:
    """It does the same each time: of a property only an example that failed is kept."""
    return not hasattr(case.body, "hypothesis")


def record(case: Case, bench: Bench, plan: Plan, path: Path) -> Result:
    """Run a test, and write its record as a run does."""
    port = bench.stage.port
    with PcapngSink(path, interface=port.name, clock=port.clock, flush=False) as sink:
        result = try_case(case, bench, plan, sink)
        opening = bench.opening
        sink.write(Moment("begin", opening.began_at, opening.ended_at, _named(opening, case)))
        now = bench.now()
        sink.write(Moment("end", now, now, {"outcome": result.outcome, "text": result.text}))
    return result


def _named(opening: Moment, case: Case) -> dict[str, object]:
    return {**opening.detail, "test": case.test, "requirements": list(case.claims)}


def replay(case: Case, plan: Plan, path: Path) -> Result:
    """Run the same test on its record."""
    told = load_record(path)
    bench = bench_for(ReplayStage(told, plan.facilities), plan.profile, plan.home)
    stand(bench, told)
    return try_case(case, bench, plan)


def concerned(suite: Suite, violated: tuple[str, ...], most: int) -> list[Case]:
    """The first scripted tests that claim a requirement which a mutant violates."""
    found = [
        case for case in suite.cases if is_scripted(case) and set(case.claims) & set(violated)
    ]
    return found[:most]
