"""results.json: valid at every moment, cheap to complete, read back with clear errors."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import textwrap
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest

from hil_tests.errors import BenchError
from hil_tests.reporting.files import RecordUnreadable
from hil_tests.reporting.results import (
    INTERRUPTED,
    OUTCOMES,
    ResultsFile,
    TestResult,
    TraceFile,
    VerdictRow,
)
from hil_tests.reporting.results_reader import load_results
from hil_tests.reporting.schema import breaches, results_schema

HEADER = {
    "started": "2025-01-31T12:00:00Z",
    "command": ["pytest", "--can-seed", "7"],
    "options": {"can_seed": {"value": 7, "source": "command line"}},
    "versions": {"python": "3.11.2"},
    "git": {"commit": "c0ffee", "dirty": True},
    "bus": {"interface": "virtual time", "channel": "-", "bit_rate": 250000, "timed": True},
    "device": {
        "kind": "virtual",
        "why": "no --can-iface given",
        "profile": {"name": "keypad", "kind": "keypad", "path": "k.toml", "sha256": None},
        "eds": None,
        "node_id": 5,
        "serial": "A-1",
        "firmware": "1.2",
        "identity": {},
        "mutant": None,
    },
    "clock": {"text": "virtual time", "doubt_ns": 0},
    "seed": 7,
    "bench": {"name": "virtual", "file": None, "facilities": [], "drivers": {}},
    "requirements": {
        "HB-01": {
            "text": "It beats.",
            "class": "timing",
            "source": "the keypad's source",
            "clause": "3",
            "origin": "source",
            "needs": [],
        }
    },
}
FULL = TestResult(
    test="hil_tests/acceptance/test_heartbeat.py::test_cadence[100 ms]",
    outcome="failed",
    title="It beats on time.",
    seconds=0.25,
    bus_ns=2_000_000_000,
    frames=21,
    error_frames=1,
    losses=2,
    lost=3,
    busy_ns=4,
    requirements=("HB-01",),
    verdicts=(
        VerdictRow("HB-01", "failed", "interval", (99, 106), (95, 105), "too late", 7),
        VerdictRow("HB-02", "passed", limits_ns=(None, 5)),
        VerdictRow("HB-03", "observation", text="“näher”\n"),
    ),
    trace=TraceFile("traces/cadence.pcapng", "0" * 64, 21),
    reproduce="pytest 'x::y[100 ms]' --can-seed 7",
    text="line one\nline two",
)


def document(path: Path) -> Any:
    """The file as any JSON reader sees it."""
    return json.loads(path.read_text("utf-8"))


def test_what_is_written_is_read_back(tmp_path: Path) -> None:
    """Header, results, totals and summary survive the way to disk and back."""
    path = tmp_path / "results.json"
    with ResultsFile(path, HEADER) as file:
        file.add(FULL.to_json())
        file.add(TestResult("t::b", "passed", frames=4).to_json())
        file.finish({"exit_status": 1})
    run = load_results(path)
    assert run.results == (FULL, TestResult("t::b", "passed", frames=4))
    assert (run.run, run.summary, run.finished, run.torn) == (
        HEADER,
        {"exit_status": 1},
        True,
        False,
    )
    assert run.totals["tests"] == 2
    assert run.totals["frames"] == 25
    assert run.totals["failed"] == 1
    assert run.totals["verdicts"]["observation"] == 1


def test_the_file_obeys_its_schema_at_every_moment(tmp_path: Path) -> None:
    """Before the first test, after each one, and at the end: valid JSON of the schema."""
    path = tmp_path / "results.json"
    rules = results_schema()
    with ResultsFile(path, HEADER) as file:
        for number, outcome in enumerate(OUTCOMES):
            assert list(breaches(document(path), rules)) == []
            assert document(path)["totals"]["tests"] == number
            assert document(path)["finished"] is False
            assert document(path)["state"] == "interrupted"
            assert document(path)["under_way"] is None
            file.begin(f"t::{number}", None)
            assert list(breaches(document(path), rules)) == []
            assert document(path)["under_way"] == {"test": f"t::{number}", "trace": None}
            file.add(TestResult(f"t::{number}", outcome, verdicts=FULL.verdicts).to_json())
        file.finish({"exit_status": 0})
    assert list(breaches(document(path), rules)) == []
    assert document(path)["finished"] is True


def test_schema_and_documentation_know_every_outcome() -> None:
    """A new outcome is added in all three places."""
    rules = results_schema()
    assert rules["$defs"]["outcome"]["enum"] == list(OUTCOMES)
    assert set(OUTCOMES) < set(rules["properties"]["totals"]["required"])
    page = Path(__file__).parents[2] / "docs" / "results.md"
    assert [word for word in OUTCOMES if f"`{word}`" not in page.read_text("utf-8")] == []


def test_a_run_that_was_told_to_stop_says_so(tmp_path: Path) -> None:
    """It came to its end, exit status and all, and is interrupted nevertheless."""
    path = tmp_path / "results.json"
    with ResultsFile(path, HEADER) as file:
        file.finish({"exit_status": 2}, INTERRUPTED)
    assert (load_results(path).finished, load_results(path).state) == (True, "interrupted")


def test_adding_never_rewrites_what_stands(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One write a test, no longer for the thousandth than for the third."""
    sizes: list[int] = []
    real = os.pwrite

    def counted(descriptor: int, content: bytes, place: int) -> int:
        sizes.append(len(content))
        return real(descriptor, content, place)

    with ResultsFile(tmp_path / "results.json", HEADER) as file:
        monkeypatch.setattr(os, "pwrite", counted)
        for _ in range(1000):
            file.add({"test": "a", "outcome": "passed"})
    assert len(sizes) == 1000
    assert sizes[999] <= sizes[2] + 20


def test_a_result_that_cannot_be_stored_changes_nothing(tmp_path: Path) -> None:
    """An unknown outcome, data without a word in JSON: refused, the file as it was."""
    path = tmp_path / "results.json"
    with ResultsFile(path, {}) as file:
        before = path.read_bytes()
        for wrong in ({"test": "a", "outcome": "green"}, {"outcome": "passed"}, {"test": "a"}):
            with pytest.raises((ValueError, KeyError)):
                file.add(wrong)
        with pytest.raises(TypeError):
            file.add({"test": "a", "outcome": "passed", "seconds": Path("x")})
        assert path.read_bytes() == before
        file.add({"test": "a", "outcome": "passed"})
        assert document(path)["totals"]["tests"] == 1


def test_a_killed_run_leaves_what_it_had(tmp_path: Path) -> None:
    """SIGKILL at some instant of adding: every finished result can be read."""
    path = tmp_path / "results.json"
    program = textwrap.dedent(f"""
        from pathlib import Path
        from hil_tests.reporting.results import ResultsFile
        file = ResultsFile(Path({str(path)!r}), {{}})
        for i in range(10**9):
            file.add({{"test": f"t::{{i}}", "outcome": "passed", "text": "x" * (i % 300)}})
    """)
    with subprocess.Popen([sys.executable, "-c", program]) as process:
        while not path.exists() or path.stat().st_size < 20_000:
            os.sched_yield()
            assert process.poll() is None
        process.send_signal(signal.SIGKILL)
    run = load_results(path)
    assert len(run.results) > 50
    assert [result.test for result in run.results] == [f"t::{i}" for i in range(len(run.results))]
    assert not run.finished


def test_wherever_the_last_write_was_torn_the_results_before_it_are_read(tmp_path: Path) -> None:
    """A file that a power cut shortened loses at most the items that were cut off."""
    path = tmp_path / "results.json"
    with ResultsFile(path, HEADER) as file:
        file.add(FULL.to_json())
        before = path.read_bytes()
        file.add({"test": "t::last", "outcome": "passed", "text": "y" * 300})
        after = path.read_bytes()
    end = before.index(b"\n],\n")
    for size in range(end, len(after) - 1, 9):
        path.write_bytes(after[:size])
        run = load_results(path)
        assert [result.test for result in run.results] in ([FULL.test], [FULL.test, "t::last"])
        assert run.totals["tests"] == len(run.results)


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("", "is no JSON"),
        ("[]", 'no "schema"'),
        ("{}", 'no "schema"'),
        ('{"schema":"nodeproof-results/2"}', "'nodeproof-results/1' is read here"),
        ('{"schema":"nodeproof-results/1"}', "run is missing"),
        ("[" * 100_000, "nested too deeply"),
    ],
)
def test_what_is_no_results_file_is_refused(tmp_path: Path, content: str, said: str) -> None:
    """The error names the file and what it expected."""
    path = tmp_path / "results.json"
    path.write_text(content, "utf-8")
    with pytest.raises(RecordUnreadable, match=rf"results\.json: .*{said}"):
        load_results(path)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"outcome": "green"}, r"results\[0\].outcome: 'green' is none of passed, failed"),
        ({"test": 7}, r"results\[0\].test: 7 is no str"),
        ({"frames": True}, r"results\[0\].frames: True is no int"),
        ({"trace": 7}, r"results\[0\].trace: 7 is no str"),
        ({"requirements": "HB-01"}, r"requirements: 'HB-01' is no list"),
        (
            {"verdicts": [{"requirement": "A", "outcome": "passed", "measured_ns": [None, 1]}]},
            "both ends are needed",
        ),
        (
            {"verdicts": [{"requirement": "A", "outcome": "passed", "limits_ns": [1, 2, 3]}]},
            r"limits_ns: \[1, 2, 3\] is no pair",
        ),
        ({"verdicts": [1]}, r"results\[0\].verdicts\[0\]: 1 is no object"),
        ({"verdicts": [{"requirement": "A"}]}, r"verdicts\[0\].outcome is missing"),
    ],
)
def test_a_wrong_field_is_named_with_its_value(
    tmp_path: Path, change: Mapping[str, object], said: str
) -> None:
    """Path of the field, value, and what it should be."""
    path = tmp_path / "results.json"
    with ResultsFile(path, {}) as file:
        file.add(FULL.to_json())
    raw = document(path)
    raw["results"][0].update(change)
    path.write_text(json.dumps(raw), "utf-8")
    with pytest.raises(RecordUnreadable, match=said):
        load_results(path)


def test_a_file_that_is_not_there_or_no_text_is_named(tmp_path: Path) -> None:
    """Errors of the operating system carry the file too."""
    with pytest.raises(RecordUnreadable, match="No such file"):
        load_results(tmp_path / "none.json")
    (tmp_path / "results.json").write_bytes(b"\xff\xfe{")
    with pytest.raises(RecordUnreadable, match=r"results\.json.*utf-8"):
        load_results(tmp_path / "results.json")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="this system has no /dev/full")
def test_a_full_disk_is_an_error_of_the_bench(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With the option that helps; what could not be written comes with the next result."""
    path = tmp_path / "results.json"
    real = os.pwrite
    with ResultsFile(path, {}) as file:
        before = path.read_bytes()
        with Path("/dev/full").open("wb") as full, monkeypatch.context() as patch:
            patch.setattr(os, "pwrite", lambda _, *rest: real(full.fileno(), *rest))
            with pytest.raises(BenchError, match=r"No space left.*--can-reports"):
                file.add({"test": "a", "outcome": "passed"})
        assert path.read_bytes() == before
        file.add({"test": "b", "outcome": "passed"})
    assert [result.test for result in load_results(path).results] == ["a", "b"]


def test_an_older_file_is_not_overwritten(tmp_path: Path) -> None:
    """Each run has a file of its own."""
    (tmp_path / "results.json").write_text("mine", "utf-8")
    with pytest.raises(BenchError, match="File exists"):
        ResultsFile(tmp_path / "results.json", {})


def test_closing_twice_does_nothing(tmp_path: Path) -> None:
    """`finish` closes; the end of a `with` block after it is harmless."""
    with ResultsFile(tmp_path / "results.json", {}) as file:
        file.finish({})
        file.close()
