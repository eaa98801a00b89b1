"""junit.xml: what CI systems read of a run; every outcome in the word that JUnit has for it."""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as Xml

import pytest

from hil_tests.reporting.junit import write_junit
from hil_tests.reporting.results import ResultsFile
from hil_tests.reporting.rows import OUTCOMES, TestResult, TraceFile, VerdictRow
from tests.reporting.test_results import HEADER

ROWS = (
    VerdictRow("HB-01", "passed", "interval 1", (99, 101), (95, 105)),
    VerdictRow("HB-01", "passed", "interval 2", (103, 105), (95, None)),
    VerdictRow("HB-01", "passed", "interval 3", (100, 104), (95, 105)),
    VerdictRow("HB-02", "passed", "the state is told"),
)


def written(folder: Path, *results: TestResult, finish: bool = True) -> Path:
    """The junit.xml of a run with these results."""
    with ResultsFile(folder / "results.json", HEADER) as file:
        for result in results:
            file.add(result.to_json())
        if finish:
            file.finish({"exit_status": 0})
    return write_junit(folder)


def parsed(path: Path) -> Any:
    """The document in a file of ours."""
    return Xml.parse(path)  # noqa: S314  it was written just now


def properties(element: Any) -> dict[str, str]:
    """Name and value of each property."""
    found = element.find("properties")
    assert found is not None
    return {each.get("name", ""): each.get("value", "") for each in found}


def test_every_outcome_has_its_element(tmp_path: Path) -> None:
    """A reader of others sees failures, errors and skipped tests, with our word as their type."""
    results = [TestResult(f"t.py::{each}", each, text=f"{each}!\nmore") for each in OUTCOMES]
    path = written(tmp_path, *results)
    (suite,) = importlib.import_module("junitparser").JUnitXml.fromfile(str(path))
    assert (suite.tests, suite.failures, suite.errors, suite.skipped) == (8, 1, 1, 3)
    told = {
        case.name: [(type(each).__name__, each.type) for each in case.result] for case in suite
    }
    assert told == {
        "passed": [],
        "failed": [("Failure", "failed")],
        "observation": [],
        "characteristic": [],
        "inconclusive": [("Skipped", "inconclusive")],
        "not run": [("Skipped", "not run")],
        "not applicable": [("Skipped", "not applicable")],
        "error": [("Error", "error")],
    }


def test_an_explanation_is_message_and_text(tmp_path: Path) -> None:
    """The first line stands in the list of a CI system, the rest behind it."""
    path = written(tmp_path, TestResult("t.py::a", "failed", text="late\nby 7 ms"))
    failure = parsed(path).find(".//failure")
    assert failure is not None
    assert (failure.get("message"), failure.text) == ("late", "late\nby 7 ms")
    seen = written_again(tmp_path, TestResult("t.py::a", "observation", text="otherwise"))
    assert seen.findtext(".//system-out") == "otherwise"


def written_again(folder: Path, *results: TestResult) -> Any:
    """The document of a run in a folder beside."""
    (folder / "beside").mkdir(exist_ok=True)
    return parsed(written(folder / "beside", *results))


def test_a_test_has_its_measured_values_as_properties(tmp_path: Path) -> None:
    """Of each requirement the worst verdict, and of those the one nearest to its limits."""
    trace = TraceFile("traces/a.pcapng", "c0ffee", 3)
    result = TestResult(
        "d/t.py::C::a[x.y]", "passed", requirements=["HB-01"], verdicts=ROWS, trace=trace
    )
    document = parsed(written(tmp_path, result))
    case = document.find(".//testcase")
    assert case is not None
    assert (case.get("classname"), case.get("name")) == ("d.t.C", "a[x.y]")
    assert properties(case) == {
        "requirement": "HB-01",
        "outcome": "passed",
        "trace": "traces/a.pcapng",
        "trace_sha256": "c0ffee",
        "HB-01.outcome": "passed",
        "HB-01.class": "timing",
        "HB-01.what": "interval 3",
        "HB-01.measured_ns": "100..104",
        "HB-01.doubt_ns": "4",
        "HB-01.limits_ns": "95..105",
        "HB-01.margin_doubts": "0.25",
        "HB-02.outcome": "passed",
        "HB-02.what": "the state is told",
    }
    suite = document.find("testsuite")
    assert properties(suite)["serial"] == "A-1"
    assert properties(suite)["state"] == "complete"


def test_an_open_limit_is_left_out(tmp_path: Path) -> None:
    """At least 95 ns, and no end."""
    result = TestResult("t.py::a", "passed", verdicts=ROWS[1:2])
    case = parsed(written(tmp_path, result)).find(".//testcase")
    assert properties(case)["HB-01.limits_ns"] == "95.."


def test_a_killed_run_says_so(tmp_path: Path) -> None:
    """What CI systems see of it is no complete run."""
    document = parsed(written(tmp_path, TestResult("t.py::a", "passed"), finish=False))
    assert properties(document.find("testsuite"))["state"] == "interrupted"


@pytest.mark.parametrize("text", ["\x00\x1b[31m", "]]><x>&amp;", "\ud800", "\ufffe"])
def test_what_no_document_can_hold_is_replaced(tmp_path: Path, text: str) -> None:
    """A name or a text of a device never makes the file unreadable."""
    result = TestResult(f"t.py::a[{text}]", "failed", text=text)
    assert parsed(written(tmp_path, result)).find(".//failure") is not None
