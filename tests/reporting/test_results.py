"""results.json: valid at every moment, cheap to complete, read back with clear errors."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import textwrap
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import pytest

import hil_tests.reporting
from hil_tests.errors import BenchError
from hil_tests.reporting.files import RecordUnreadable
from hil_tests.reporting.results import OUTCOMES, ResultsFile, TestResult, VerdictRow
from hil_tests.reporting.results_reader import load_results

HEADER = {
    "started": "2025-01-31T12:00:00Z",
    "command": ["pytest", "--can-seed", "7"],
    "options": {"can_seed": {"value": 7, "source": "command line"}},
    "versions": {"python": "3.11.2"},
    "bus": {"channel": "virtual", "timed": True},
    "device": {"kind": "model", "node_id": 5},
    "clock": {"text": "virtual time", "doubt_ns": 0},
    "seed": 7,
    "bench": None,
}
FULL = TestResult(
    test="hil_tests/acceptance/test_heartbeat.py::test_cadence[100 ms]",
    outcome="failed",
    seconds=0.25,
    bus_ns=2_000_000_000,
    frames=21,
    requirements=("HB-01",),
    verdicts=(
        VerdictRow("HB-01", "failed", "interval", (99, 106), (95, 105), "too late"),
        VerdictRow("HB-02", "passed", limits_ns=(None, 5)),
        VerdictRow("HB-03", "observation", text="“näher”\n"),
    ),
    trace="traces/cadence.pcapng",
    reproduce="pytest 'x::y[100 ms]' --can-seed 7",
    text="line one\nline two",
)


def schema() -> dict[str, Any]:
    """The schema that ships."""
    place = Path(hil_tests.reporting.__file__).with_name("results.schema.json")
    found = json.loads(place.read_text("utf-8"))
    assert isinstance(found, dict)
    return found


KINDS: Mapping[str, Any] = {
    "object": dict,
    "array": list,
    "string": str,
    "boolean": bool,
    "null": type(None),
    "integer": int,
    "number": (int, float),
}


def is_kind(value: object, kind: str) -> bool:
    """Whether a value is of a kind in JSON Schema's words."""
    number = isinstance(value, bool) and kind in {"integer", "number"}
    return isinstance(value, KINDS[kind]) and not number


def breaches(
    value: Any, rule: Mapping[str, Any], root: Mapping[str, Any], at: str
) -> Iterator[str]:
    """Where a document breaks a schema; knows the words that ours uses and no other."""
    if "$ref" in rule:
        yield from breaches(value, root["$defs"][rule["$ref"].rpartition("/")[2]], root, at)
        return
    known = {"type", "const", "enum", "required", "properties", "additionalProperties", "items"}
    unknown = set(rule) - known - {"minItems", "maxItems", "minimum", "$schema", "title", "$defs"}
    assert not unknown, unknown
    kinds = rule.get("type", [])
    kinds = [kinds] if isinstance(kinds, str) else kinds
    if kinds and not any(is_kind(value, kind) for kind in kinds):
        yield f"{at}: {value!r} is no {kinds}"
    if value not in rule.get("enum", [value]) or value != rule.get("const", value):
        yield f"{at}: {value!r}"
    if isinstance(value, int) and value < rule.get("minimum", value):
        yield f"{at}: {value!r} is too low"
    if isinstance(value, list):
        if not rule.get("minItems", 0) <= len(value) <= rule.get("maxItems", len(value)):
            yield f"{at}: {len(value)} items"
        for place, item in enumerate(value):
            yield from breaches(item, rule.get("items", {}), root, f"{at}[{place}]")
    if isinstance(value, dict):
        yield from (
            f"{at}.{key} is missing" for key in rule.get("required", []) if key not in value
        )
        for key, item in value.items():
            inner = rule.get("properties", {}).get(key, rule.get("additionalProperties", {}))
            if inner is False:
                yield f"{at}.{key} is unknown"
            else:
                yield from breaches(item, inner, root, f"{at}.{key}")


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
    rules = schema()
    with ResultsFile(path, HEADER) as file:
        for number, outcome in enumerate(OUTCOMES):
            assert list(breaches(document(path), rules, rules, "")) == []
            assert document(path)["totals"]["tests"] == number
            assert document(path)["finished"] is False
            file.add(TestResult(f"t::{number}", outcome, verdicts=FULL.verdicts).to_json())
        file.finish({"exit_status": 0})
    assert list(breaches(document(path), rules, rules, "")) == []
    assert document(path)["finished"] is True


def test_schema_and_documentation_know_every_outcome() -> None:
    """A new outcome is added in all three places."""
    rules = schema()
    assert rules["$defs"]["outcome"]["enum"] == list(OUTCOMES)
    assert set(OUTCOMES) < set(rules["properties"]["totals"]["required"])
    page = Path(__file__).parents[2] / "docs" / "results.md"
    assert [word for word in OUTCOMES if f"`{word}`" not in page.read_text("utf-8")] == []


def test_the_schema_notices_what_is_wrong() -> None:
    """The hand check is no rubber stamp."""
    rules = schema()
    bad = {"schema": "other", "run": [], "results": [{"test": 1, "outcome": "green"}], "x": 1}
    found = list(breaches(bad, rules, rules, ""))
    assert [entry.split(":")[0].split(" ")[0] for entry in found] == [
        ".totals",
        ".finished",
        ".summary",
        ".schema",
        ".run",
        ".results[0].test",
        ".results[0].outcome",
        ".x",
    ]


def test_a_shorter_end_leaves_no_rest_of_a_longer_one(tmp_path: Path) -> None:
    """Where the new end is shorter than the old one, blanks stand behind it."""
    path = tmp_path / "results.json"
    with ResultsFile(path, {}) as file:
        file.add({"test": "a", "outcome": "passed", "seconds": 0.123456})
        size = path.stat().st_size
        file._write(file._tail(file.totals, {}), file._end)
        assert path.stat().st_size == size
        assert document(path)["finished"] is True


def test_adding_never_rewrites_what_stands(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One write a test, no longer for the thousandth than for the second."""
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
    assert sizes[999] <= sizes[1] + 20


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
    """A write that reached the disk in part costs at most the item it carried."""
    path = tmp_path / "results.json"
    with ResultsFile(path, HEADER) as file:
        file.add(FULL.to_json())
        before, end = path.read_bytes(), file._end
        file.add({"test": "t::last", "outcome": "passed", "text": "y" * 300})
        after = path.read_bytes()
    for size in range(end, len(after), 9):
        path.write_bytes(after[:size] + before[size:])
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
    """With the option that helps; nothing is silently lost."""
    path = tmp_path / "results.json"
    with ResultsFile(path, {}) as file:
        with Path("/dev/full").open("wb") as full, monkeypatch.context() as patch:
            patch.setattr(file, "_descriptor", full.fileno())
            with pytest.raises(BenchError, match=r"No space left.*--can-reports"):
                file.add({"test": "a", "outcome": "passed"})
        file.add({"test": "b", "outcome": "passed"})
    assert [result.test for result in load_results(path).results] == ["b"]


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
