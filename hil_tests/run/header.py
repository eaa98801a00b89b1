"""Facts of a run, as results.json has them at its head (docs/results.md, "run")."""

from __future__ import annotations

import platform
from collections.abc import Mapping, Sequence
from datetime import datetime
from importlib import metadata
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from hil_tests.bench.bench import Bench
    from hil_tests.run.plan import Plan

_PACKAGES = ("nodeproof", "pytest", "hypothesis", "python-can")


def header(
    plan: Plan, bench: Bench | None, started: datetime, command: Sequence[str]
) -> dict[str, Any]:
    """What was chosen and by whom, on which bus and clock, with which versions.

    Args:
        plan: what is tested, and on what.
        bench: None where it could not be opened.
        started: when, with a time zone.
        command: the command line.
    """
    port = bench.stage.port if bench else None
    values, origins = plan.settings.values, plan.settings.origins
    return {
        "started": started.isoformat(),
        "command": list(command),
        "options": {
            key: {"value": value, "source": origins[key]} for key, value in values.items()
        },
        "versions": versions(),
        "bus": {
            "interface": plan.interface,
            "channel": plan.channel,
            "bit_rate": bench.stage.bit_rate if bench else plan.bit_rate,
            "timed": port.timed if port else plan.timed,
        },
        "device": {
            "kind": plan.device,
            "why": plan.why,
            "profile": plan.profile.path,
            "node_id": plan.home.node_id if plan.home else None,
            "mutant": plan.mutant,
        },
        "clock": {"text": port.clock, "doubt_ns": port.doubt_ns} if port else {},
        "seed": plan.settings["can_seed"],
        "bench": {"name": plan.bench_name, "facilities": list(plan.facilities)},
    }


def versions() -> Mapping[str, str]:
    """Of what a verdict can depend on."""
    found = {"python": platform.python_version(), "kernel": platform.release()}
    for name in _PACKAGES:
        try:
            found[name] = metadata.version(name)
        except metadata.PackageNotFoundError:  # a checkout that is not installed
            found[name] = "not installed"
    return found
