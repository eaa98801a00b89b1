"""Opening a bench: the one place where a run touches a bus, a process or a control server."""

from __future__ import annotations

from contextlib import ExitStack
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from hil_tests.bench.bench import Bench
from hil_tests.bench.kinds import bench_for
from hil_tests.errors import BenchError, ConfigError
from hil_tests.reporting.rundir import RunDirectory
from hil_tests.run import stash
from hil_tests.run.capture import PytestCapture, Ticker, ticker_of
from hil_tests.run.ending import take_sigterm_as_interrupt
from hil_tests.run.plan import VIRTUAL, Plan
from hil_tests.run.progress import Progress
from hil_tests.run.session import Run
from hil_tests.run.spread import Courier, errand_of

if TYPE_CHECKING:
    from hil_tests.bench.drivers.terminal import Capture
    from hil_tests.bench.real import RealStage
    from hil_tests.bench.stage import Stage
    from node_model.devices import Blueprint

_DEFAULT_RATE = 250_000
"""What the source falls back to; used where nobody says at which rate the bus runs."""


def start_run(config: pytest.Config) -> Run:
    """A run's folder, then its bench; the run is stashed in `config` as soon as it is there.

    Raises:
        pytest.UsageError: no place for the folder, or a profile that the model cannot be.
    """
    config.add_cleanup(take_sigterm_as_interrupt())
    plan, now, root = stash.plan_of(config), datetime.now(UTC), config.rootpath
    errand = errand_of(config)
    try:
        if errand is not None:
            ledger = Courier(RunDirectory(Path(errand.folder)).make(), now)
            run = _runs(plan)(plan, now, errand.command, root, ledger)
        else:
            command = [str(part) for part in config.invocation_params.args]
            run = _runs(plan)(plan, now, command, root)
        config.stash[stash.RUN] = run
        ticker = _ticker(config, plan)
        run.progress = Progress(ticker) if ticker else None
        run.open(partial(open_bench, capture=PytestCapture(config, ticker)))
    except ConfigError as error:
        raise pytest.UsageError(str(error)) from None
    return run


def _ticker(config: pytest.Config, plan: Plan) -> Ticker | None:
    """What shows that a test takes long, where somebody waits for it in real time."""
    return None if plan.virtual or plan.recording is not None else ticker_of(config)


def _runs(plan: Plan) -> type[Run]:
    """What a run of that plan is."""
    if plan.recording is None:
        return Run
    from hil_tests.run.replaying import ReplayRun  # noqa: PLC0415 - only where one is replayed

    return ReplayRun


def open_bench(plan: Plan, capture: Capture | None = None) -> Bench:
    """Open what a plan asks for.

    Args:
        plan: see there.
        capture: gives the terminal back while an operator is asked.

    Raises:
        BenchError: bus, model or control server unavailable; everything is closed again.
        ConfigError: the profile describes no device that the bundled model can be.
    """
    if plan.recording is not None:
        from hil_tests.replay.stage import ReplayStage  # noqa: PLC0415 - only there

        replayed = ReplayStage(plan.recording.sample(), plan.facilities)
        return bench_on(replayed, plan)
    stage = _virtual(plan) if plan.device == VIRTUAL else _real(plan, capture)
    with ExitStack() as undo:
        undo.callback(stage.close)
        bench = bench_on(stage, plan)
        if not plan.virtual and bench.bitrate:
            bench.bitrate.set(stage.bit_rate)
        undo.pop_all()
    return bench


def bench_on(stage: Stage, plan: Plan) -> Bench:
    """The bench that a plan asks for, on a stage."""
    bench = bench_for(stage, plan.profile, plan.home)
    bench.seed = plan.settings["can_seed"]
    return bench


def _virtual(plan: Plan) -> Stage:
    from hil_tests.bench.virtual import VirtualStage  # noqa: PLC0415 - the model, when needed

    try:
        return VirtualStage(blueprint_of(plan), plan.bench_name)
    except ValueError as error:
        raise ConfigError(
            f"{plan.profile.path}: the bundled model cannot be this device"
            f" ({error}); test the device itself with --can-iface NAME"
        ) from error


def blueprint_of(plan: Plan) -> Blueprint[Any]:
    """The model that stands for the device in virtual time.

    Raises:
        UnknownDeviceError: the profile describes no device that it can be.
    """
    from node_model import devices  # noqa: PLC0415 - the model, when needed

    return devices.read(plan.profile.path, plan.mutant, plan.settings["can_eds"])


def _real(plan: Plan, capture: Capture | None) -> Stage:
    with ExitStack() as undo:
        stage = _fitted(plan, capture, undo)
        undo.pop_all()
    return stage


def _fitted(plan: Plan, capture: Capture | None, undo: ExitStack) -> Stage:
    from hil_tests.bench import real  # noqa: PLC0415 - real time only
    from hil_tests.bus.choose import open_port  # noqa: PLC0415

    port = open_port(plan.interface, plan.channel, plan.bit_rate if plan.is_external else None)
    leave = ExitStack()
    undo.callback(leave.close)
    leave.callback(port.close)
    stage = real.RealStage(
        plan.bench_name,
        port,
        plan.bit_rate or (plan.home.bit_rate if plan.home else _DEFAULT_RATE),
        exclusive=plan.exclusive,
        writes_allowed=plan.writes_allowed,
        leave=leave,
        fades=plan.is_external,
    )
    if not plan.is_external:
        session = real.open_session(stage, _model(plan, stage, leave), leave)
        real.fit_control(stage, session, plan.facilities, list(plan.profile.led_bits))
    elif plan.bench_file is not None:
        file = plan.bench_file
        external = (
            real.open_session(stage, file.control.address, leave, real.patience(file))
            if file.control
            else None
        )
        real.fit_from_file(stage, file, plan.profile, external, capture)
        real.keep_power(stage, external, leave)
    return stage


def _model(plan: Plan, stage: RealStage, leave: ExitStack) -> str:
    """Start the model in a process of its own; the address of its control server."""
    from hil_tests.bench.drivers.model import HostedModel  # noqa: PLC0415 - real time only

    try:
        model = HostedModel(
            plan.interface,
            plan.channel,
            plan.profile.path,
            plan.mutant,
            plan.settings["can_node_id"],
            plan.settings["can_eds"],
        )
    except OSError as error:
        raise BenchError(f"the model's process cannot be started: {error}") from error
    leave.callback(model.close)
    stage.checks.append(model.check)
    return model.address
