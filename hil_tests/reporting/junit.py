"""`junit.xml`: the results of a run for CI systems, made from results.json.

What is failed, an error, or neither stands where JUnit has a word for it; the outcomes that it
has no word for (not run, not applicable, inconclusive) are skipped tests whose type says which.
Requirements, measured values, limits, doubts and margins are properties of the test.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as Xml

from hil_tests.reporting.files import replace_file
from hil_tests.reporting.results_reader import RESULTS, Results, load_results
from hil_tests.reporting.rows import TestResult, VerdictRow
from hil_tests.reporting.tally import GRAVITY, pairs

JUNIT = "junit.xml"

_ELEMENTS = {
    "failed": "failure",
    "error": "error",
    "not run": "skipped",
    "not applicable": "skipped",
    "inconclusive": "skipped",
}
"""Outcome -> element of the test case; what is not here passed."""

_COUNTED = {"failure": "failures", "error": "errors", "skipped": "skipped"}

_NO_XML = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
"""What an XML document cannot hold, not even escaped (XML 1.0, 2.2)."""

_LONGEST_MESSAGE = 300


def write_junit(folder: Path) -> Path:
    """Write `junit.xml` of a run into its folder; the path of it.

    Raises:
        RecordUnreadable: there are no results.
        OSError: the folder cannot be written to.
    """
    path = folder / JUNIT
    document = Xml.tostring(junit(load_results(folder / RESULTS)), "utf-8", xml_declaration=True)
    replace_file(path, document + b"\n")
    return path


def junit(run: Results) -> Xml.Element:
    """The run as a JUnit document."""
    root = Xml.Element("testsuites", name="nodeproof")
    suite = Xml.SubElement(root, "testsuite", name="nodeproof")
    _properties(suite, run_properties(run))
    classes = {name: each["class"] for name, each in run.run.get("requirements", {}).items()}
    for result in run.results:
        _case(suite, result, classes)
    sums = _sums(run)
    root.attrib.update(sums)
    suite.attrib.update(sums, timestamp=str(run.run.get("started", "")))
    return root


def run_properties(run: Results) -> Iterator[tuple[str, str]]:
    """Who was tested, how, with what."""
    head, device = run.run, run.run.get("device", {})
    profile, clock = device.get("profile") or {}, head.get("clock") or {}
    facts = {
        "state": run.state,
        "device": device.get("kind"),
        "serial": device.get("serial"),
        "node_id": device.get("node_id"),
        "mutant": device.get("mutant"),
        "profile": profile.get("name"),
        "profile_sha256": profile.get("sha256"),
        "bench": (head.get("bench") or {}).get("name"),
        "clock": clock.get("text"),
        "clock_doubt_ns": clock.get("doubt_ns"),
        "seed": head.get("seed"),
        "nodeproof": head.get("versions", {}).get("nodeproof"),
    }
    return ((name, str(value)) for name, value in facts.items() if value is not None)


def properties_of(result: TestResult, classes: Mapping[str, str]) -> Iterator[tuple[str, str]]:
    """What a test found, as pairs of name and value.

    Of each requirement the verdict that counts: the worst one, and of those the one that came
    nearest to its limits.

    Args:
        result: of the test.
        classes: of the requirements, by id.
    """
    for name in result.requirements:
        yield "requirement", name
    yield "outcome", result.outcome
    if result.trace is not None:
        yield "trace", result.trace.path
        yield "trace_sha256", result.trace.sha256
    for name, outcome in pairs(result.to_json()).items():
        yield f"{name}.outcome", outcome
        if name in classes:
            yield f"{name}.class", classes[name]
        rows = [row for row in result.verdicts if row.requirement == name]
        if rows:
            yield from _measured(min(rows, key=_standing))


def _standing(row: VerdictRow) -> tuple[int, float]:
    margin = row.margin
    return GRAVITY.index(row.outcome), margin.doubts if margin else float("inf")


def _measured(row: VerdictRow) -> Iterator[tuple[str, str]]:
    yield f"{row.requirement}.what", row.what
    margin = row.margin
    if row.measured_ns is not None:
        low, high = row.measured_ns
        yield f"{row.requirement}.measured_ns", f"{low}..{high}"
        yield f"{row.requirement}.doubt_ns", str(high - low)
    if row.limits_ns is not None:
        ends = ("" if end is None else str(end) for end in row.limits_ns)
        yield f"{row.requirement}.limits_ns", "..".join(ends)
    if margin is not None:
        yield f"{row.requirement}.margin_doubts", str(margin.doubts)


def _case(suite: Xml.Element, result: TestResult, classes: Mapping[str, str]) -> None:
    file, _, name = result.test.partition("::")
    group, _, name = name.rpartition("::")
    module = file.removesuffix(".py").replace("/", ".")
    case = Xml.SubElement(
        suite,
        "testcase",
        classname=_clean(".".join(filter(None, (module, group.replace("::", "."))))),
        name=_clean(name or result.test),
        time=f"{result.seconds:.3f}",
    )
    _properties(case, properties_of(result, classes))
    element = _ELEMENTS.get(result.outcome)
    if element is not None:
        message = result.text.strip().partition("\n")[0][:_LONGEST_MESSAGE]
        attributes = {"type": result.outcome, "message": _clean(message)}
        Xml.SubElement(case, element, attributes).text = _clean(result.text)
    elif result.text:
        Xml.SubElement(case, "system-out").text = _clean(result.text)


def _properties(parent: Xml.Element, pairs: Iterable[tuple[str, str]]) -> None:
    group = Xml.SubElement(parent, "properties")
    for name, value in pairs:
        Xml.SubElement(group, "property", name=_clean(name), value=_clean(value))


def _sums(run: Results) -> dict[str, str]:
    counts: dict[str, Any] = dict.fromkeys(_COUNTED.values(), 0)
    for result in run.results:
        element = _ELEMENTS.get(result.outcome)
        if element is not None:
            counts[_COUNTED[element]] += 1
    seconds = sum(result.seconds for result in run.results)
    return {
        "tests": str(len(run.results)),
        **{name: str(count) for name, count in counts.items()},
        "time": f"{seconds:.3f}",
    }


def _clean(text: str) -> str:
    return _NO_XML.sub("\N{REPLACEMENT CHARACTER}", text)
