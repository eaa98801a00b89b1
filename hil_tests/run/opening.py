"""Opening a bench: the one place where a run touches a bus, a process or a control server."""

from __future__ import annotations

from contextlib import ExitStack
from typing import TYPE_CHECKING

from hil_tests.bench.bench import Bench
from hil_tests.run.plan import VIRTUAL, Plan

if TYPE_CHECKING:
    from hil_tests.bench.drivers.terminal import Capture
    from hil_tests.bench.stage import Stage

_DEFAULT_RATE = 250_000
"""What the source falls back to; used where nobody says at which rate the bus runs."""


def open_bench(plan: Plan, capture: Capture | None = None) -> Bench:
    """Open what a plan asks for.

    Args:
        plan: see there.
        capture: gives the terminal back while an operator is asked.

    Raises:
        BenchError: bus, model or control server unavailable; everything is closed again.
    """
    stage = _virtual(plan) if plan.device == VIRTUAL else _real(plan, capture)
    bench = Bench(stage, plan.profile, plan.home)
    if not plan.virtual and bench.bitrate:
        bench.bitrate.set(stage.bit_rate)
    return bench


def _virtual(plan: Plan) -> Stage:
    from hil_tests.bench.virtual import VirtualStage  # noqa: PLC0415 - the model, when needed
    from node_model import faults, keypad  # noqa: PLC0415

    facts = keypad.load(plan.profile.path)
    return VirtualStage(lambda profile: faults.make(plan.mutant, profile), facts, plan.bench_name)


def _real(plan: Plan, capture: Capture | None) -> Stage:
    with ExitStack() as undo:
        stage = _fitted(plan, capture, undo)
        undo.pop_all()
    return stage


def _fitted(plan: Plan, capture: Capture | None, undo: ExitStack) -> Stage:
    from hil_tests.bench import real  # noqa: PLC0415 - real time only
    from hil_tests.bench.drivers.peer import ControlSession  # noqa: PLC0415
    from hil_tests.bench.drivers.terminal import Terminal  # noqa: PLC0415
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
    )
    address = _model(plan, leave) if not plan.is_external else _address(plan)
    session = ControlSession(address, clock=port.now) if address else None
    if session is not None:
        session.connect()
        leave.callback(session.close)
    if not plan.is_external and session is not None:
        real.fit_control(stage, session, plan.facilities, list(plan.profile.led_bits))
    elif plan.bench_file is not None:
        terminal = Terminal(port.now, capture=capture)
        real.fit_from_file(stage, plan.bench_file, plan.profile, session, terminal)
        real.keep_power(stage, session, leave)
    return stage


def _address(plan: Plan) -> str | None:
    control = plan.bench_file.control if plan.bench_file else None
    return control.address if control else None


def _model(plan: Plan, leave: ExitStack) -> str:
    """Start the model in a process of its own; the address of its control server."""
    from hil_tests.bench.drivers.model import HostedModel  # noqa: PLC0415 - real time only

    model = HostedModel(
        plan.interface,
        plan.channel,
        plan.profile.path,
        plan.mutant,
        plan.settings["can_node_id"],
    )
    leave.callback(model.close)
    return model.address
