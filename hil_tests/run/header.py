"""Facts of a run, as results.json has them at its head (docs/results.md, "run")."""

from __future__ import annotations

import hashlib
import platform
from collections.abc import Mapping, Sequence
from datetime import datetime
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hil_tests.run.checkout import git_state
from hil_tests.run.identity import Identity

if TYPE_CHECKING:
    from hil_tests.bench.bench import Bench
    from hil_tests.requirements import Requirement
    from hil_tests.run.plan import Plan

_PACKAGES = ("nodeproof", "pytest", "hypothesis", "python-can")


def header(
    plan: Plan,
    bench: Bench | None,
    who: Identity,
    started: datetime,
    command: Sequence[str],
    root: Path | None,
) -> dict[str, Any]:
    """What was chosen and by whom, on which bus and clock, with which versions.

    Args:
        plan: what is tested, and on what.
        bench: None where it could not be opened.
        who: is under test.
        started: when, with a time zone.
        command: the command line.
        root: where the tests lie; its state in git is told. None = it is not.
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
        "git": git_state(root) if root else None,
        "bus": {
            "interface": plan.interface,
            "channel": plan.channel,
            "bit_rate": bench.stage.bit_rate if bench else plan.bit_rate,
            "timed": port.timed if port else plan.timed,
        },
        "device": _device(plan, who),
        "clock": {
            "text": port.clock if port else "none: the bench could not be opened",
            "doubt_ns": port.doubt_ns if port else None,
        },
        "seed": plan.settings["can_seed"],
        "bench": _bench(plan),
        "requirements": {each.id: requirement_facts(each) for each in plan.requirements.values()},
    }


def _device(plan: Plan, who: Identity) -> dict[str, Any]:
    """Who is under test, as far as it is known or was said."""
    profile, sheet = plan.profile, getattr(plan.profile, "eds", None)
    return {
        "kind": plan.device,
        "why": plan.why,
        "profile": {
            "name": profile.name,
            "kind": profile.kind,
            "path": profile.path,
            "sha256": sha256_of(profile.path),
        },
        "eds": _file(sheet, str(who.facts.get("product_name") or "")) if sheet else None,
        "node_id": plan.home.node_id if plan.home else None,
        "serial": who.serial,
        "serial_from": who.serial_from,
        "firmware": who.firmware,
        "firmware_from": who.firmware_from,
        "identity": dict(who.facts),
        "mutant": plan.mutant,
    }


def _bench(plan: Plan) -> dict[str, Any]:
    file = plan.bench_file
    drivers = {}
    for name in plan.facilities:
        section = getattr(file, name, None)
        drivers[name] = section.driver if section is not None else "the model's own"
    return {
        "name": plan.bench_name,
        "file": _file(file.path, file.name) if file else None,
        "facilities": list(plan.facilities),
        "drivers": drivers,
    }


def _file(path: str, name: str) -> dict[str, Any]:
    return {"name": name, "path": str(path), "sha256": sha256_of(path)}


def sha256_of(path: str | Path) -> str | None:
    """The SHA-256 of a file in hex; None where it cannot be read."""
    try:
        with Path(path).open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError:
        return None


def requirement_facts(each: Requirement) -> dict[str, Any]:
    """What results.json says of a requirement."""
    return {
        "text": each.text,
        "class": each.kind.value,
        "source": each.source,
        "clause": each.clause,
        "origin": each.origin,
        "needs": list(each.needs),
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
