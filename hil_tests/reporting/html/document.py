"""Builds `report.html` from the folder of a run.

Laws: one file, no network, no library; a content security policy that allows nothing but
the style and the script inside, by their hashes; every text that comes from a device, a
file or a person is escaped (autoescape is on, and nothing switches it off); without
JavaScript everything can be read but the timelines.
"""

from __future__ import annotations

import base64
import hashlib
import json
import re
import shlex
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any

import jinja2

from hil_tests.clock import Interval, show_interval, show_span
from hil_tests.reporting.files import replace_file
from hil_tests.reporting.html import narrative, plots, timing, view
from hil_tests.reporting.html.artefacts import Artefact, artefacts_of
from hil_tests.reporting.html.coverage import Covered, cover, proofs_of, show_margin
from hil_tests.reporting.html.embed import embed
from hil_tests.reporting.html.facts import fact, table_of, words
from hil_tests.reporting.html.view import Teller, TestView, test_views, verdict_of
from hil_tests.reporting.results_reader import RESULTS, Results, load_results
from hil_tests.reporting.rows import OUTCOMES

REPORT = "report.html"
CERTIFICATE = "certificate.pdf"
_MATRIX = "matrix.json"
_TEMPLATES = "templates"
_DEVICES = {
    "virtual": "bundled model in virtual time",
    "model": "bundled model in a process of its own",
    "external": "external device",
}


@dataclass(frozen=True, slots=True)
class Subject:
    """A run, read and weighed; what every page is made of.

    Args:
        folder: of the run.
        results: its `results.json`.
        tests: one view a test.
        covered: one entry a requirement.
        matrix: its `matrix.json`; empty = none.
        files: its files with their hashes.
        notes: what could not be read.
    """

    folder: Path
    results: Results
    tests: list[TestView]
    covered: list[Covered]
    matrix: Mapping[str, Any]
    files: list[Artefact]
    notes: list[str]


def read_run(folder: Path, aimed: Mapping[str, Iterable[str]]) -> Subject:
    """Everything that a report of a run is made from.

    Args:
        folder: of the run; `results.json` is needed, all else is optional.
        aimed: requirement -> names of the faulty models that violate it.

    Raises:
        RecordUnreadable: no readable `results.json`.
    """
    results = load_results(folder / RESULTS)
    kind = fact(results.run, "device", "profile", "kind")
    tell = Teller(str(kind or "keypad"))
    tests = test_views(folder, results, tell)
    embed(tests, tell)
    matrix, notes = _matrix(folder)
    covered = cover(results, proofs_of(aimed, matrix))
    files = artefacts_of(folder, without={REPORT, CERTIFICATE})
    return Subject(folder, results, tests, covered, matrix, files, notes)


def _matrix(folder: Path) -> tuple[Mapping[str, Any], list[str]]:
    """The table of faulty models, if it is there and what it should be."""
    path = folder / _MATRIX
    if not path.is_file():
        return {}, []
    try:
        found = json.loads(path.read_text("utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        return {}, [f"{_MATRIX} cannot be read: {error}"]
    if not isinstance(fact(found, "mutants"), dict):
        return {}, [f"{_MATRIX} is no table of faulty models"]
    return found, []


def write_report(folder: Path, aimed: Mapping[str, Iterable[str]]) -> Path:
    """Write `report.html` into the folder of a run; an older one is replaced as a whole.

    Args:
        folder: of the run.
        aimed: requirement -> names of the faulty models that violate it; {} = not known.

    Returns:
        Where it was written.

    Raises:
        RecordUnreadable: no readable `results.json`.
        OSError: the folder cannot be written.
    """
    path = folder / REPORT
    replace_file(path, render(read_run(folder, aimed)).encode("utf-8", "replace"))
    return path


def render(subject: Subject) -> str:
    """The report as one HTML text."""
    style = _source("report.css")
    script = _source("report.js") + _source("timeline.js")
    return str(
        _environment()
        .get_template("report.html.j2")
        .render(
            **values(subject),
            style=style,
            script=script,
            policy=_policy(style, script),
        )
    )


def values(subject: Subject) -> dict[str, Any]:
    """What the templates call by name."""
    results, tests = subject.results, subject.tests
    return {
        "subject": subject,
        "run": results.run,
        "results": results,
        "tests": tests,
        "covered": subject.covered,
        "files": subject.files,
        "verdict": verdict_of(results, tests),
        "first": next((test for test in tests if test.result.outcome == "failed"), None)
        or next((test for test in tests if test.is_argued), None),
        "outcomes": [
            (name, sum(test.result.outcome == name for test in tests)) for name in OUTCOMES
        ],
        "repeat": _repeat(results.run),
        "sums": _sums(tests),
        "broken": [each for each in subject.covered if each.outcome == "failed"],
        "periods": timing.periods(tests),
        "answers": timing.answers(tests),
        "mutants": sorted(
            table_of(subject.matrix, "mutants").items(),
            key=lambda mutant: (bool(fact(mutant[1], "killed_by")), mutant[0]),
        ),
    }


def _sums(tests: Sequence[TestView]) -> dict[str, int]:
    """What the tests saw, taken together."""
    names = ("frames", "bus_ns", "lost", "losses", "error_frames")
    sums = {name: sum(getattr(test.result, name) for test in tests) for name in names}
    return sums | {"checks": sum(len(test.checks) for test in tests)}


def _repeat(run: Mapping[str, Any]) -> str:
    """The command line that repeats the run."""
    command = words(run, "command")
    return shlex.join(["pytest", *command]) if command else "pytest"


def _policy(style: str, script: str) -> str:
    """Nothing may be loaded; only this style and this script may act."""
    hashes = [
        base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()
        for text in (style, script)
    ]
    return (
        "default-src 'none'; base-uri 'none'; form-action 'none'; "
        f"style-src 'sha256-{hashes[0]}'; script-src 'sha256-{hashes[1]}'"
    )


def _source(name: str) -> str:
    """A file beside the templates, as it is."""
    return (resources.files(__package__) / _TEMPLATES / name).read_text("utf-8")


@cache
def _environment() -> jinja2.Environment:
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader(__package__ or "", _TEMPLATES),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {
        "slug": view.slug,
        "margin": lambda margin: show_margin(margin.ns, margin.doubts) if margin else "",
        "span": show_span,
        "measured": lambda pair: show_interval(Interval(*pair)) if pair else "",
        "limits": _limits,
        "within": narrative.within_text,
        "moment": _moment,
        "device": lambda kind: _DEVICES.get(kind, kind) if isinstance(kind, str) else kind,
    }
    environment.globals |= {
        "fact": fact,
        "words": words,
        "table_of": table_of,
        "show_at": narrative.show_at,
        "histogram": plots.histogram,
        "run_chart": plots.run_chart,
        "distribution": plots.distribution,
    }
    return environment


def _moment(text: Any) -> str:
    """A point in time as `results.json` has it, to the second."""
    found = re.fullmatch(r"(\d{4}-\d\d-\d\d)T(\d\d:\d\d:\d\d)(?:\.\d+)?\+00:00", str(text))
    return f"{found[1]} {found[2]} UTC" if found else str(text or "")


def _limits(pair: tuple[int | None, int | None] | None) -> str:
    """Limits for people."""
    if pair is None or pair == (None, None):
        return ""
    low, high = pair
    if low is None:
        return f"≤ {show_span(high or 0)}"
    return f"≥ {show_span(low)}" if high is None else f"{show_span(low)} – {show_span(high)}"
