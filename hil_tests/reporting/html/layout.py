"""How plain values become pages: the templates, and the words that they use.

Autoescape is on, and nothing switches it off but for the style and the script of our own.
"""

from __future__ import annotations

import re
import shlex
from collections.abc import Mapping, Sequence
from functools import cache
from importlib import resources
from typing import Any

import jinja2

from hil_tests.clock import Interval, show_interval, show_span
from hil_tests.reporting.html import narrative, plots, timing, view
from hil_tests.reporting.html.coverage import UNTESTED, show_margin
from hil_tests.reporting.html.device import device_facts, device_name, device_warnings
from hil_tests.reporting.html.facts import fact, table_of, words
from hil_tests.reporting.html.subject import Subject
from hil_tests.reporting.html.view import TestView, verdict_of
from hil_tests.reporting.rows import OUTCOMES

_TEMPLATES = "templates"


def page(template: str, subject: Subject, **more: Any) -> str:
    """A template filled with a run.

    Args:
        template: name of the file.
        subject: the run.
        more: what else the template calls by name.
    """
    return str(_environment().get_template(template).render(**_values(subject), **more))


def source(name: str) -> str:
    """A file beside the templates, as it is."""
    return (resources.files(__package__) / _TEMPLATES / name).read_text("utf-8")


def _values(subject: Subject) -> dict[str, Any]:
    """What the templates call by name."""
    results, tests = subject.results, subject.tests
    return {
        "subject": subject,
        "run": results.run,
        "device": device_name(results.run),
        "doubts": device_warnings(results.run),
        "results": results,
        "tests": tests,
        "tested": [each for each in subject.covered if each.outcome != UNTESTED],
        "untested": [each for each in subject.covered if each.outcome == UNTESTED],
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
    }
    environment.globals |= {
        "fact": fact,
        "words": words,
        "table_of": table_of,
        "device_facts": device_facts,
        "show_at": narrative.show_at,
        "plain": narrative.plain,
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
