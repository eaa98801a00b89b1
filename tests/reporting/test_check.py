"""`nodeproof check`: finds what was changed in a run's folder, and nothing in a sound one."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from hil_tests import cli
from hil_tests.reporting.check import check_run
from hil_tests.reporting.files import RecordUnreadable
from hil_tests.reporting.pcapng import PcapngSink
from hil_tests.reporting.results import ResultsFile, TestResult, TraceFile, VerdictRow
from hil_tests.trace import Sighting
from node_model.frame import Frame
from tests.reporting.test_results import HEADER


@pytest.fixture(name="run")
def _run(tmp_path: Path) -> Path:
    """A run with a test and its recording."""
    (tmp_path / "traces").mkdir()
    trace = tmp_path / "traces" / "a.pcapng"
    with PcapngSink(trace, interface="vcan7", clock="virtual time", flush=False) as sink:
        sink.write(Sighting(Frame(0x705, b"\x00"), 5))
    told = TraceFile("traces/a.pcapng", hashlib.sha256(trace.read_bytes()).hexdigest(), 1)
    ends = (1, 2), (101, 102)
    rows = (VerdictRow("HB-01", "passed", "interval", (99, 101), (95, 105), "", 102, *ends),)
    with ResultsFile(tmp_path / "results.json", HEADER) as file:
        result = TestResult("t::a", "passed", requirements=["HB-01"], verdicts=rows, trace=told)
        file.add(result.to_json())
        file.finish({"exit_status": 0})
    return tmp_path


def changed(run: Path, change: Callable[[dict[str, Any]], object]) -> list[str]:
    """What is said of the run after a change of its results."""
    path = run / "results.json"
    document = json.loads(path.read_text("utf-8"))
    change(document)
    path.write_text(json.dumps(document), "utf-8")
    return check_run(run)


def test_a_sound_run_is_valid(run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """By its folder or by its file; the state is told."""
    assert check_run(run / "results.json") == []
    assert cli.main(["check", str(run)]) == 0
    assert capsys.readouterr().out == f"{run}: complete, valid\n"


def test_a_span_that_its_ends_do_not_give_is_told(run: Path) -> None:
    """What was measured lies between cause and effect, doubts included."""
    where = "results[0].verdicts[0].measured_ns"
    wrong = changed(
        run, lambda document: document["results"][0]["verdicts"][0].update(cause_at=[1, 3])
    )
    assert wrong == [f"{where}: [99, 101], and cause and effect give [98, 101]"]


def test_a_breach_of_the_schema_is_told(run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """With its place and its value, and exit status 1."""
    wrong = changed(run, lambda document: document.update(state="torn"))
    assert wrong == ["state: 'torn' is none of complete, interrupted"]
    assert cli.main(["check", str(run)]) == 1
    assert f"  {wrong[0]}\n" in capsys.readouterr().out


def test_a_verdict_that_was_changed_does_not_fit_the_sums(run: Path) -> None:
    """Totals and standings follow from the results; what does not is told with both values."""
    wrong = changed(run, lambda found: found["results"][0]["verdicts"][0].update(outcome="failed"))
    assert [line.partition(":")[0] for line in wrong] == ["totals.verdicts", "requirements.HB-01"]
    assert "'outcome': 'passed'" in wrong[1]


def test_a_result_that_was_taken_out_leaves_a_gap(run: Path) -> None:
    """Results are numbered one after the other."""
    wrong = changed(run, lambda found: found["results"][0].update(number=2))
    assert wrong == ["results[0].number: 2 instead of 1"]


def test_a_recording_that_was_changed_is_told(run: Path) -> None:
    """One bit more or less, and its SHA-256 is another."""
    trace = run / "traces" / "a.pcapng"
    trace.write_bytes(trace.read_bytes()[:-1] + b"\x00")
    (wrong,) = check_run(run)
    assert wrong.startswith("results[0].trace: traces/a.pcapng: is not the file")


def test_a_recording_that_is_gone_or_lies_elsewhere_is_told(run: Path) -> None:
    """A run's folder holds all that belongs to it."""
    wrong = changed(run, lambda found: found["results"][0].update(trace="../a.pcapng"))
    assert wrong == ["results[0].trace: ../a.pcapng: lies outside the run's folder"]
    wrong = changed(run, lambda found: found["results"][0].update(trace="traces/b.pcapng"))
    assert wrong == ["results[0].trace: traces/b.pcapng: is not there"]


def test_frames_are_counted_again(run: Path) -> None:
    """The recording holds as many frames as the results say."""
    wrong = changed(run, lambda found: found["results"][0].update(trace_frames=2))
    assert wrong == ["results[0].trace: traces/a.pcapng: holds 1 frames, and the results say 2"]


def test_a_file_that_breaks_off_is_told(run: Path) -> None:
    """What stands before is whole, and nothing more is said of it."""
    path = run / "results.json"
    path.write_bytes(path.read_bytes()[:-200])
    assert check_run(run) == [
        "results.json was cut off in its last item; what stands before is whole"
    ]


def test_no_run_is_wrong_use(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A folder without results is named, with what to name instead."""
    with pytest.raises(RecordUnreadable, match=r"no run; name a folder that has results\.json"):
        check_run(tmp_path)
    assert cli.main(["check", str(tmp_path)]) == 4
    assert "no run" in capsys.readouterr().err


def test_the_sample_is_valid() -> None:
    """The run that lies in the repository is what this version writes."""
    assert check_run(Path(__file__).parents[2] / "reports" / "sample") == []
