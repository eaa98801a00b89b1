"""What a run leaves for people: written at its end, or made again of its folder."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from hil_tests.cli import main
from hil_tests.errors import ConfigError
from hil_tests.run import papers
from tests.reporting.html.making import make_run, passed, result
from tests.run.harness import judge

pytest_plugins = ["pytester"]

STARTS = """
@pytest.mark.requirement("NMT-02")
def test_start(bench, power):
    on = power.on()
    bench.expect(matchers.boot_up(bench.node_id), after=on, within=bench.profile.limits.boot_up_ns)
"""


@pytest.mark.slow
def test_a_run_ends_with_its_report(pytester: pytest.Pytester) -> None:
    """report.html lies in the folder of the run, and the last line says where."""
    done = judge(pytester, STARTS)
    assert done.status == 0
    assert "test_start" in (done.folder / "report.html").read_text("utf-8")
    assert "report: " in done.section("nodeproof")


def test_a_report_can_be_made_again(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """`nodeproof report RUN` makes it of the folder alone, and prints where it is."""
    run = make_run(tmp_path / "run", result(1, passed()), finish=False)
    assert main(["report", str(run)]) == 0
    assert capsys.readouterr().out.strip() == str(run / "report.html")
    assert "Interrupted" in (run / "report.html").read_text("utf-8")


def test_a_table_of_faulty_models_is_taken_in(tmp_path: Path) -> None:
    """--matrix puts the table into the folder, and the report shows who found which."""
    run = make_run(tmp_path / "run", result(1, passed()))
    mutants = {
        "sly": {"text": "It lies.", "violates": ["NMT-02"], "killed_by": []},
        "plain": {
            "text": "It is late.",
            "violates": ["NMT-02"],
            "killed_by": ["test_a", "test_b"],
        },
    }
    table = tmp_path / "table.json"
    table.write_text(json.dumps({"mutants": mutants}), "utf-8")
    assert main(["report", str(run), "--matrix", str(table)]) == 0
    assert (run / "matrix.json").read_bytes() == table.read_bytes()
    text = (run / "report.html").read_text("utf-8")
    assert text.index("It lies.") < text.index("It is late.")
    assert "test_a, test_b" in text


def test_a_missing_table_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A file that is not there is wrong use, by name."""
    run = make_run(tmp_path / "run", result(1, passed()))
    assert main(["report", str(run), "--matrix", str(tmp_path / "none.json")]) == 4
    assert "none.json" in capsys.readouterr().err


def test_what_is_no_run_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A folder without results.json is wrong use; the text says what to name instead."""
    assert main(["report", str(tmp_path)]) == 4
    assert "no results.json in it; name one, e.g. reports/latest" in capsys.readouterr().err


def test_unreadable_results_are_refused(tmp_path: Path) -> None:
    """A results file of another schema is named."""
    (tmp_path / "results.json").write_text('{"schema": "other/9"}', "utf-8")
    with pytest.raises(ConfigError, match="schema 'other/9'"):
        papers.make_again(tmp_path, pdf=False)


def test_a_report_that_fails_is_said(tmp_path: Path) -> None:
    """At the end of a run nothing is raised: the line says why, and how to make it later."""
    said = papers.write(tmp_path / "nowhere", pdf=False)
    assert said.startswith("NO REPORT (RecordUnreadable: ")
    assert f"nodeproof report {tmp_path / 'nowhere'}" in said


def model(kind: str, *killers: str) -> dict[str, object]:
    """A faulty model in a table."""
    return {"kind": kind, "text": "f", "violates": ["NMT-02"], "killed_by": list(killers)}


def test_a_table_beside_the_runs_is_taken_in(tmp_path: Path) -> None:
    """`tox -e mutants` leaves it there; models of another kind of device are not shown."""
    run = make_run(tmp_path / "run", result(1, passed()))
    mutants = {"of-a-keypad": model("keypad", "t::a"), "of-a-drive": model("drive")}
    (tmp_path / "matrix.json").write_text(json.dumps({"mutants": mutants}), "utf-8")
    papers.write(run, pdf=False)
    shown = (run / "report.html").read_text("utf-8")
    assert "of-a-keypad" in shown
    assert "of-a-drive" not in shown
    (tmp_path / "matrix.json").write_text('{"mutants": {}}', "utf-8")
    papers.write(run, pdf=False)
    assert "of-a-keypad" in (run / "report.html").read_text("utf-8"), "a run keeps what it has"
