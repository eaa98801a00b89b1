"""Is a run's folder what it says it is? Schema, sums, recordings: `nodeproof check`."""

from __future__ import annotations

import hashlib
import json
from collections import deque
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from hil_tests.reporting.files import RecordUnreadable
from hil_tests.reporting.pcapng import read_pcapng
from hil_tests.reporting.results_reader import RESULTS, load_results
from hil_tests.reporting.rows import TestResult, TraceFile
from hil_tests.reporting.schema import breaches, results_schema
from hil_tests.reporting.tally import Tally, Totals
from hil_tests.trace import Sighting

REPORTS = Path("reports")
"""Where runs are written unless somebody says otherwise."""


def check_run(folder: Path) -> list[str]:
    """What is wrong with a run, one sentence each; nothing = all is well.

    Args:
        folder: of the run; or its results.json.

    Raises:
        RecordUnreadable: there are no results, or none that anything can be said about.
    """
    path = results_path(folder)
    run = load_results(path)
    if run.torn:
        return [f"{path.name} was cut off in its last item; what stands before is whole"]
    document = json.loads(path.read_text("utf-8"))
    wrong = list(breaches(document, results_schema()))
    # Sums of something that is no result cannot be worked out.
    if wrong:
        return wrong
    found = [*_wrong_sums(document), *_wrong_spans(run.results)]
    found += _wrong_identity(path.parent, document["run"])
    return [*found, *_wrong_traces(path.parent, run.results)]


def results_path(run: Path) -> Path:
    """The results file of a run: named by its folder, by the file itself, or in reports/.

    Raises:
        RecordUnreadable: there is none.
    """
    for place in (run, REPORTS / run):
        path = place / RESULTS if place.is_dir() else place
        if path.is_file():
            return path
    raise RecordUnreadable(
        f"{run}: no run; name a folder that has {RESULTS}, such as {REPORTS / 'latest'}"
    )


def _wrong_sums(document: Mapping[str, Any]) -> Iterator[str]:
    totals, tally = Totals(), Tally()
    for number, row in enumerate(document["results"], 1):
        if row.get("number") != number:
            yield f"results[{number - 1}].number: {row.get('number')} instead of {number}"
        totals = totals.plus(row)
        tally.add(number, row)
    told = {"totals": totals.to_json(), "requirements": tally.to_json()}
    for name, right in told.items():
        for key in sorted({*right, *document[name]}):
            said, is_so = document[name].get(key), json.loads(json.dumps(right.get(key)))
            if said != is_so:
                yield f"{name}.{key}: {said}, and the results give {is_so}"


def _wrong_spans(results: tuple[TestResult, ...]) -> Iterator[str]:
    """A measured span is what lies between its cause and its effect."""
    for place, result in enumerate(results):
        for number, row in enumerate(result.verdicts):
            cause, effect, measured = row.cause_at, row.effect_at, row.measured_ns
            if cause is None or effect is None or measured is None:
                continue
            span = (effect[0] - cause[1], effect[1] - cause[0])
            if span != measured:
                where = f"results[{place}].verdicts[{number}].measured_ns"
                yield f"{where}: {list(measured)}, and cause and effect give {list(span)}"


def _wrong_identity(folder: Path, run: Mapping[str, Any]) -> Iterator[str]:
    """What the device said of itself is recorded, where the results say so."""
    name = run["device"]["identity"].get("trace")
    if name is None:
        return
    where, path = f"run.device.identity.trace: {name}", folder / name
    if not path.resolve().is_relative_to(folder.resolve()):
        yield f"{where}: lies outside the run's folder"
    elif not path.is_file():
        yield f"{where}: is not there"
    else:
        try:
            deque(read_pcapng(path), maxlen=0)
        except RecordUnreadable as error:
            yield f"{where}: {error}"


def _wrong_traces(folder: Path, results: tuple[TestResult, ...]) -> Iterator[str]:
    for place, result in enumerate(results):
        trace = result.trace
        if trace is None:
            continue
        where = f"results[{place}].trace: {trace.path}"
        path = folder / trace.path
        if not path.resolve().is_relative_to(folder.resolve()):
            yield f"{where}: lies outside the run's folder"
        elif not path.is_file():
            yield f"{where}: is not there"
        else:
            yield from (f"{where}: {what}" for what in _wrong_trace(path, trace))


def _wrong_trace(path: Path, told: TraceFile) -> Iterator[str]:
    with path.open("rb") as file:
        if hashlib.file_digest(file, "sha256").hexdigest() != told.sha256:
            yield "is not the file that was written: its SHA-256 differs"
            return
    try:
        found = sum(isinstance(entry, Sighting) for entry in read_pcapng(path))
    except RecordUnreadable as error:
        yield str(error)
        return
    if found != told.frames:
        yield f"holds {found} frames, and the results say {told.frames}"
