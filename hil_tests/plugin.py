"""pytest plugin: hooks, options and a handful of fixtures; the work is done in `run`.

Costs next to nothing until a test of ours is collected: everything heavy is imported then.
"""

from __future__ import annotations

from collections.abc import Generator
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any

import pytest

from hil_tests.run import options

if TYPE_CHECKING:
    from hil_tests.bench.bench import Bench
    from hil_tests.bench.facilities import BitRate, Keys, Leds, Power
    from hil_tests.config import DeviceProfile
    from hil_tests.config.limits import ProfileLimits
    from hil_tests.run.plan import Plan
    from hil_tests.run.session import Run

SETTINGS = pytest.StashKey[options.Settings]()
PLAN = pytest.StashKey["Plan"]()
RUN = pytest.StashKey["Run"]()
REASONS = pytest.StashKey[dict[str, str]]()
ERROR = pytest.StashKey["BaseException | None"]()


def pytest_addoption(parser: pytest.Parser) -> None:
    """Options and their ini twins."""
    options.register(parser)


def pytest_configure(config: pytest.Config) -> None:
    """Markers; and the list of mutants, where that is all that was asked for."""
    for marker in (
        "requirement(*ids): the requirements that a test claims; checks blame the first one",
        "virtual(why): runs in virtual time only",
        "timed(why): needs a wire with arbitration and bit times",
    ):
        config.addinivalue_line("markers", marker)
    config.stash[REASONS] = {}
    if settings_of(config)["can_mutant"] == "list":
        from hil_tests.run.catalogue import mutant_table  # noqa: PLC0415 - on demand

        pytest.exit(mutant_table(), returncode=0)


def settings_of(config: pytest.Config) -> options.Settings:
    """What was chosen on command line, environment and ini file.

    Raises:
        pytest.UsageError: values that are none.
    """
    if SETTINGS not in config.stash:
        config.stash[SETTINGS] = options.settle(config)
    return config.stash[SETTINGS]


def plan_of(config: pytest.Config) -> Plan:
    """The plan of this run, made when it is first needed.

    Raises:
        pytest.UsageError: options or files are wrong.
    """
    if PLAN not in config.stash:
        from hil_tests.errors import ConfigError  # noqa: PLC0415 - first test of ours
        from hil_tests.run.plan import make_plan  # noqa: PLC0415

        try:
            config.stash[PLAN] = make_plan(settings_of(config))
        except ConfigError as error:
            raise pytest.UsageError(str(error)) from None
    return config.stash[PLAN]


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Check ids, choose by clause, and say now what this bench cannot run."""
    from hil_tests.run import selection  # noqa: PLC0415 - light

    ours = [item for item in items if selection.is_ours(item)]
    if not ours:
        return
    plan = plan_of(config)
    selection.check_ids(ours, plan.requirements)
    selection.check_clauses(plan.settings["can_clause"], plan.requirements)
    if plan.settings["can_clause"]:
        chosen, others = selection.by_clause(items, plan.settings["can_clause"])
        config.hook.pytest_deselected(items=others)
        items[:] = chosen
    for item in ours:
        reason = selection.why_not(item, plan)
        if reason:
            item.add_marker(pytest.mark.skip(reason=reason))


def pytest_report_collectionfinish(config: pytest.Config) -> list[str]:
    """What will be tested."""
    if PLAN not in config.stash:
        return []
    from hil_tests.run import terminal  # noqa: PLC0415

    return terminal.plan_lines(config.stash[PLAN])


@pytest.hookimpl(tryfirst=True)
def pytest_runtestloop(session: pytest.Session) -> None:
    """Open the bench once, and say what it is."""
    config = session.config
    if PLAN not in config.stash or config.option.collectonly or not session.items:
        return
    from hil_tests.errors import ConfigError  # noqa: PLC0415
    from hil_tests.run import terminal  # noqa: PLC0415
    from hil_tests.run.capture import PytestCapture  # noqa: PLC0415
    from hil_tests.run.session import Run  # noqa: PLC0415

    command = config.invocation_params.args
    try:
        run = Run(config.stash[PLAN], datetime.now(UTC), [str(part) for part in command])
    except ConfigError as error:
        raise pytest.UsageError(str(error)) from None
    config.stash[RUN] = run
    run.open(PytestCapture(config))
    reporter = config.pluginmanager.get_plugin("terminalreporter")
    if reporter is not None:
        for line in terminal.bench_lines(run):
            reporter.write_line(line)


# Fixtures: session-scoped, because Hypothesis refuses function-scoped ones.


@pytest.fixture(scope="session")
def bench(request: pytest.FixtureRequest) -> Bench:
    """The bench: what a test can do and see."""
    return request.config.stash[RUN].bench


@pytest.fixture(scope="session")
def power(bench: Bench) -> Power:
    """The supply of the device."""
    return _facility(bench.power, "power")


@pytest.fixture(scope="session")
def keys(bench: Bench) -> Keys:
    """The keys of the device."""
    return _facility(bench.keys, "keys")


@pytest.fixture(scope="session")
def leds(bench: Bench) -> Leds:
    """The LEDs of the device."""
    return _facility(bench.leds, "leds")


@pytest.fixture(scope="session")
def bitrate(bench: Bench) -> BitRate:
    """The bit rate of the tester's end of the bus."""
    return _facility(bench.bitrate, "bitrate")


@pytest.fixture(scope="session")
def profile(bench: Bench) -> DeviceProfile:
    """Facts of the device."""
    return bench.profile


@pytest.fixture(scope="session")
def limits(profile: DeviceProfile) -> ProfileLimits:
    """Limits of the device."""
    return profile.limits


def _facility(found: Any, name: str) -> Any:
    if found is None:  # pragma: no cover - collection has skipped the test
        pytest.fail(f"the bench has no {name}")
    return found


# A test of ours.


def _run_for(item: pytest.Item) -> Run | None:
    """The run, where this test is one of ours and uses the bench."""
    run = item.config.stash.get(RUN, None)
    return run if run is not None and "bench" in getattr(item, "fixturenames", ()) else None


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call(item: pytest.Item) -> Generator[None, object, object]:
    """Record the test, and let the monitors have the last word."""
    run = _run_for(item)
    if run is None:
        return (yield)
    from hil_tests.run.selection import claimed  # noqa: PLC0415

    is_property = hasattr(getattr(item, "obj", None), "hypothesis")
    run.begin(item.nodeid, keep_trace=not is_property)
    error: BaseException | None = None
    try:
        yield
    except (Exception, pytest.skip.Exception) as raised:  # noqa: BLE001  passed on below
        error = raised
    ends_with = run.end(error, next(iter(claimed(item)), ""))
    item.stash[ERROR] = ends_with
    if ends_with is not None:
        if is_property:
            run.keep_last_example(item.nodeid)
        raise ends_with
    return None


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_runtest_makereport(
    item: pytest.Item, call: pytest.CallInfo[None]
) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Give the report the outcome in our words, and store the result."""
    report = yield
    from hil_tests.run import selection  # noqa: PLC0415

    if RUN not in item.config.stash or not selection.is_ours(item):
        return report
    from hil_tests.run.reports import conclude  # noqa: PLC0415

    conclude(item, call, report, item.config.stash[RUN], item.config.stash[REASONS])
    return report


def pytest_report_teststatus(report: pytest.TestReport) -> tuple[str, str, str] | None:
    """Category, letter and word of our outcomes."""
    name = getattr(report, "nodeproof", None)
    if name is None:
        return None
    from hil_tests.run.outcome import REPORTED  # noqa: PLC0415

    return REPORTED[name]


@pytest.hookimpl(tryfirst=True)
def pytest_sessionfinish(session: pytest.Session, exitstatus: int) -> None:
    """Put everything back, and say how the run ended."""
    run = session.config.stash.get(RUN, None)
    if run is None:
        return
    from hil_tests.run.outcome import exit_status  # noqa: PLC0415

    strict = bool(run.plan.settings["can_require_all"])
    status = exit_status(list(run.outcomes.values()), int(exitstatus), require_all=strict)
    problems = run.close(status)
    session.config.stash[REASONS].update(dict.fromkeys(problems, "at the end of the run"))
    session.exitstatus = 11 if problems and status != 1 else status


def pytest_terminal_summary(terminalreporter: Any, config: pytest.Config) -> None:
    """The closing lines."""
    run = config.stash.get(RUN, None)
    if run is None:
        return
    from hil_tests.run import terminal  # noqa: PLC0415

    reasons = config.stash[REASONS]
    if reasons:
        terminalreporter.section("not run")
        for line in terminal.reason_lines(run, reasons):
            terminalreporter.write_line(line)
    terminalreporter.section("nodeproof")
    for line in terminal.closing_lines(run):
        terminalreporter.write_line(line)
