"""pytest plugin: hooks, options and a handful of fixtures; the work is done in `run`.

Costs next to nothing until a test of ours is collected: everything heavy is imported then.
"""

from __future__ import annotations

import sys
from collections.abc import Generator
from typing import TYPE_CHECKING, Any, TypeVar

import pytest

from hil_tests.run import options, stash

if TYPE_CHECKING:
    from hil_tests.bench.bench import Bench
    from hil_tests.bench.facilities import BitRate, Faults, Keys, Leds, Power
    from hil_tests.bench.lss import Lss
    from hil_tests.bench.master import Master
    from hil_tests.bench.sdo import Sdo
    from hil_tests.chance import Chance
    from hil_tests.config import DeviceProfile
    from hil_tests.config.limits import DeviceLimits
    from hil_tests.eds import Sheet

Facility = TypeVar("Facility")


def pytest_addoption(parser: pytest.Parser) -> None:
    """Options and their ini twins."""
    options.register(parser)


def pytest_configure(config: pytest.Config) -> None:
    """Markers."""
    for marker in stash.MARKERS:
        config.addinivalue_line("markers", marker)


@pytest.hookimpl(tryfirst=True)
def pytest_cmdline_main(config: pytest.Config) -> int | None:
    """The list of mutants, where that is all that was asked for; files that mislead pytest."""
    given = config.invocation_params
    if (words := options.respelled([str(word) for word in given.args], given.dir)) is not None:
        return pytest.main(words, given.plugins)
    if not options.wants_mutant_list(config):
        return None
    from hil_tests.run.catalogue import mutant_table  # noqa: PLC0415 - on demand

    sys.stdout.write(mutant_table() + "\n")
    return 0


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Check ids, choose by clause, and say now what this bench cannot run."""
    ours = [item for item in items if stash.is_ours(item)]
    if not ours:
        return
    from hil_tests.run import properties, selection  # noqa: PLC0415 - first test of ours

    plan = stash.plan_of(config)
    selection.check(ours, plan)
    items[:], others = selection.of_device(items, plan)
    if others:
        config.hook.pytest_deselected(items=others)
        ours = [item for item in items if stash.is_ours(item)]
    if plan.settings["can_clause"]:
        items[:], others = selection.by_clause(items, plan.settings["can_clause"])
        config.hook.pytest_deselected(items=others)
    if plan.settings["can_scenario"]:
        items[:], others = selection.by_scenario(items)
        config.hook.pytest_deselected(items=others)
    if plan.recording is not None:
        from hil_tests.run import replaying  # noqa: PLC0415 - only where one is replayed

        items[:], others = replaying.choose(items, plan.recording)
        config.hook.pytest_deselected(items=others)
        replaying.repeat_examples(items, plan.recording)
    selection.mark_not_run(ours, plan)
    properties.fit(config, ours)


def pytest_report_collectionfinish(config: pytest.Config) -> list[str]:
    """What will be tested."""
    if stash.PLAN not in config.stash:
        return []
    from hil_tests.run import terminal  # noqa: PLC0415

    return terminal.plan_lines(config.stash[stash.PLAN])


@pytest.hookimpl(tryfirst=True)
def pytest_runtestloop(session: pytest.Session) -> None:
    """Open the bench once, and say what it is."""
    config = session.config
    if config.option.collectonly or not any(map(stash.is_ours, session.items)):
        return
    from hil_tests.run import opening, terminal  # noqa: PLC0415

    run = opening.start_run(config)
    lines = terminal.bench_lines(run)
    reporter = config.pluginmanager.get_plugin("terminalreporter")
    if reporter is not None:
        for line in lines:
            reporter.write_line(line)
    if hasattr(config, "workerinput"):
        from hil_tests.run import spread  # noqa: PLC0415 - xdist only

        spread.introduce(run, [*terminal.plan_lines(run.plan), *lines])


# Fixtures: session-scoped, because Hypothesis refuses function-scoped ones.


@pytest.fixture(scope="session")
def bench(request: pytest.FixtureRequest) -> Bench:
    """The bench: what a test can do and see."""
    run = stash.run_of(request.config)
    if run is None:
        pytest.fail(
            "the bench is for tests that claim a requirement: @pytest.mark.requirement(ID)"
        )
    return run.bench


@pytest.fixture(scope="session")
def power(bench: Bench) -> Power:
    """The supply of the device."""
    return _there(bench.power, "Power")


@pytest.fixture(scope="session")
def keys(bench: Bench) -> Keys:
    """The keys of the device."""
    return _there(bench.keys, "Keys")


@pytest.fixture(scope="session")
def leds(bench: Bench) -> Leds:
    """The LEDs of the device."""
    return _there(bench.leds, "Leds")


@pytest.fixture(scope="session")
def faults(bench: Bench) -> Faults:
    """Errors that can be raised in the device."""
    return _there(bench.faults, "Faults")


@pytest.fixture(scope="session")
def bitrate(bench: Bench) -> BitRate:
    """The bit rate of the tester's end of the bus."""
    return _there(bench.bitrate, "BitRate")


@pytest.fixture(scope="session")
def sdo(bench: Bench) -> Sdo:
    """The SDO client of the bench."""
    from hil_tests.bench import tools  # noqa: PLC0415 - where a test asks for it

    return tools.sdo(bench)


@pytest.fixture(scope="session")
def sheet(bench: Bench) -> Sheet:
    """The electronic data sheet of the device."""
    from hil_tests.bench import tools  # noqa: PLC0415 - where a test asks for it

    return tools.sheet(bench)


@pytest.fixture(scope="session")
def lss(bench: Bench) -> Lss:
    """The LSS master of the bench."""
    from hil_tests.bench import tools  # noqa: PLC0415 - where a test asks for it

    return tools.lss(bench)


@pytest.fixture(scope="session")
def manager(bench: Bench) -> Master:
    """The NMT master of the bench; `manager.meet()` begins with a device it knows nothing of."""
    from hil_tests.bench import tools  # noqa: PLC0415 - where a test asks for it

    return tools.manager(bench)


@pytest.fixture(scope="session")
def chance(bench: Bench) -> Chance:
    """Values that the seed of the run draws."""
    from hil_tests.bench import tools  # noqa: PLC0415 - where a test asks for it

    return tools.chance(bench)


@pytest.fixture(scope="session")
def profile(bench: Bench) -> DeviceProfile:
    """Facts of the device."""
    return bench.profile


@pytest.fixture(scope="session")
def limits(profile: DeviceProfile) -> DeviceLimits:
    """Limits of the device."""
    return profile.limits


def _there(facility: Facility | None, name: str) -> Facility:
    """A facility; collection has seen to it that tests of ours find what they ask for."""
    if facility is None:
        pytest.skip(f"the bench has no {name}")
    return facility


# A test of ours.


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call(item: pytest.Item) -> Generator[None, object, object]:
    """Record the test, and let the monitors have the last word."""
    run = stash.run_of(item.config)
    if run is None or not stash.is_ours(item) or "bench" not in getattr(item, "fixturenames", ()):
        return (yield)
    is_property = stash.is_property(item)
    run.begin(item.nodeid, stash.claimed(item), keep_trace=not is_property)
    error: BaseException | None = None
    try:
        yield
    except (Exception, pytest.fail.Exception, pytest.skip.Exception) as raised:  # noqa: BLE001
        error = raised  # raised again below, unless a monitor found worse
    ends_with = run.end(error, next(iter(stash.claimed(item)), ""))
    if ends_with is not None:
        if is_property:
            run.keep_last_example(error)
        raise ends_with
    return None


@pytest.hookimpl(tryfirst=True)
def pytest_pyfunc_call(pyfuncitem: pytest.Function) -> bool | None:
    """In a replay a test may be counted as it was recorded."""
    run = stash.run_of(pyfuncitem.config)
    if run is None or not stash.is_ours(pyfuncitem):
        return None
    return run.stand_in(pyfuncitem.nodeid) or None


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_runtest_makereport(
    item: pytest.Item, call: pytest.CallInfo[None]
) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Give the report the outcome in our words, and store the result."""
    report = yield
    run = stash.run_of(item.config)
    if run is not None and stash.is_ours(item):
        from hil_tests.run.reports import conclude  # noqa: PLC0415

        conclude(item, call, report, run)
    return report


@pytest.hookimpl(tryfirst=True)
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
    config = session.config
    run, gathering = stash.run_of(config), stash.gathering_of(config)
    if run is not None:
        session.exitstatus = run.close(int(exitstatus))
        if hasattr(config, "workeroutput"):
            from hil_tests.run import spread  # noqa: PLC0415 - xdist only

            spread.report_back(config.workeroutput, run.ledger)
    elif gathering is not None:
        session.exitstatus = gathering.close(int(exitstatus))
    ledger = stash.ledger_of(config)
    if ledger is not None and not hasattr(config, "workeroutput"):
        from hil_tests.run import papers  # noqa: PLC0415

        pdf = bool(stash.settings_of(config)["can_report_pdf"])
        ledger.papers.append(papers.write(ledger.folder.path, pdf=pdf))


def pytest_terminal_summary(terminalreporter: Any, config: pytest.Config) -> None:
    """What is not plainly passed or failed, and the closing lines."""
    ledger = stash.ledger_of(config)
    if ledger is None:
        return
    from hil_tests.run import closing  # noqa: PLC0415

    sections = list(closing.sections(ledger))
    if stash.settings_of(config)["can_replay"]:
        from hil_tests.run import replaying  # noqa: PLC0415 - only where one is replayed

        sections.insert(-1, ("replay", replaying.compared(config, ledger)))
    for title, lines in sections:
        terminalreporter.section(title)
        for line in lines:
            terminalreporter.write_line(line)


# A run that pytest-xdist spreads over processes.


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_setupnodes(config: pytest.Config, specs: list[Any]) -> None:
    """Before workers are started: one of them at most on a real bus."""
    from hil_tests.run import spread  # noqa: PLC0415 - xdist only

    spread.gather(config, len(specs))


@pytest.hookimpl(optionalhook=True)
def pytest_configure_node(node: Any) -> None:
    """Tell a worker which folder the run has."""
    node.workerinput["nodeproof"] = node.config.stash[stash.GATHERING].errand()


def pytest_runtest_logreport(report: pytest.TestReport) -> None:
    """Take what a worker found from its report."""
    node = getattr(report, "node", None)
    if node is not None:
        from hil_tests.run import spread  # noqa: PLC0415 - xdist only

        spread.receive(node.config, report)


@pytest.hookimpl(optionalhook=True)
def pytest_testnodedown(node: Any) -> None:
    """Hear a worker's last words."""
    from hil_tests.run import spread  # noqa: PLC0415 - xdist only

    spread.part(node)
