"""A run in short: who was tested, when, and how each requirement stood."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hil_tests.reporting.results_reader import Results, load_results


@dataclass(frozen=True, slots=True)
class Stand:
    """How a requirement stood.

    Args:
        outcome: the worst one.
        share: room that the narrowest check left, as a share of what its limits allow; None =
            nothing was measured.
        doubts: the same room in units of the measurement's doubt.
        what: was checked there.
    """

    outcome: str
    share: float | None = None
    doubts: float | None = None
    what: str = ""


@dataclass(frozen=True, slots=True)
class Summary:
    """A run in short.

    Args:
        name: of its folder.
        started: UTC, ISO 8601.
        device: "virtual", "model" or "external".
        serial: of the device; "" = not told.
        firmware: of the device; "" = not told.
        profile: of the device.
        mutant: fault that was put under test on purpose; "" = none.
        bench: its name.
        state: "complete" or "interrupted".
        exit_status: None where the run did not end.
        stands: by requirement.
    """

    name: str
    started: str
    device: str
    serial: str
    firmware: str
    profile: str
    mutant: str
    bench: str
    state: str
    exit_status: int | None
    stands: Mapping[str, Stand]

    @property
    def label(self) -> str:
        """Names the run in tables and plots."""
        told = [self.serial, self.firmware, self.mutant and f"MUTANT {self.mutant}"]
        who = " ".join(filter(None, told))
        return f"{who} ({self.name})" if who else self.name


def summary_of(path: Path) -> Summary:
    """The run whose results lie in a file.

    Raises:
        RecordUnreadable: no such file, or none of ours.
    """
    run = load_results(path)
    device, bench = _table(run, "device"), _table(run, "bench")
    return Summary(
        name=path.parent.resolve().name,
        started=str(run.run.get("started", "")),
        device=_text(device, "kind"),
        serial=_text(device, "serial"),
        firmware=_text(device, "firmware"),
        profile=_text(device.get("profile") or {}, "name"),
        mutant=_text(device, "mutant"),
        bench=_text(bench, "name"),
        state=run.state,
        exit_status=run.summary.get("exit_status"),
        stands={name: _stand(each) for name, each in run.requirements.items()},
    )


def _table(run: Results, key: str) -> Mapping[str, Any]:
    found = run.run.get(key)
    return found if isinstance(found, dict) else {}


def _text(table: Mapping[str, Any], key: str) -> str:
    found = table.get(key)
    return found if isinstance(found, str) else ""


def _stand(told: Mapping[str, Any]) -> Stand:
    margin = told.get("narrowest") or {}
    share, doubts = margin.get("share"), margin.get("doubts")
    return Stand(str(told.get("outcome", "")), share, doubts, str(margin.get("what", "")))


def show_share(stand: Stand | None) -> str:
    """A margin in a table."""
    if stand is None or stand.share is None:
        return "-"
    return f"{stand.share:.1%}"
