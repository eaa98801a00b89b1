"""Runs side by side: what differs is shown, as table, JSON and plot; names do nothing."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as Xml

import pytest

from hil_tests import cli
from hil_tests.reporting.compare import differing, table, worse
from hil_tests.reporting.results import ResultsFile, TestResult, VerdictRow
from hil_tests.reporting.summary import Stand, Summary, summary_of
from tests.reporting.test_results import HEADER

HOSTILE = "</title><script>alert(1)</script>\x00\" onload='x'"


def run_in(
    folder: Path, verdicts: dict[str, tuple[str, int]], *, finish: bool = True, **device: Any
) -> Path:
    """A run whose requirements stood so: outcome, and what was measured of at most 100 ns."""
    folder.mkdir(parents=True)
    started = device.pop("started", HEADER["started"])
    head = {**HEADER, "started": started, "device": {**HEADER["device"], **device}}  # type: ignore[dict-item]
    rows = [
        VerdictRow(name, outcome, f"span of {name}", (measured, measured), (None, 100))
        for name, (outcome, measured) in verdicts.items()
    ]
    outcome = "failed" if any(row.outcome == "failed" for row in rows) else "passed"
    with ResultsFile(folder / "results.json", head) as file:
        file.add(TestResult("t::a", outcome, verdicts=rows).to_json())
        if finish:
            file.finish({"exit_status": int(outcome == "failed")})
    return folder


def short(name: str, **stands: Stand) -> Summary:
    """A run in short."""
    told = {key.replace("_", "-"): stand for key, stand in stands.items()}
    return Summary(name, "2025", "virtual", "", "", "keypad", "", "b", "complete", 0, told)


def test_a_run_in_short_says_who_stood_how(tmp_path: Path) -> None:
    """Device, firmware, state, and of each requirement the narrowest margin."""
    run = run_in(tmp_path / "r1", {"HB-01": ("passed", 40)}, finish=False, serial="A-7")
    summary = summary_of(run / "results.json")
    assert summary.stands == {"HB-01": Stand("passed", 0.6, 60.0, "span of HB-01")}
    assert (summary.label, summary.state) == ("A-7 1.2 (r1)", "interrupted")
    assert summary.exit_status is None


def test_only_what_differs_is_shown() -> None:
    """Another outcome, a margin that moved by more than 5 % of the room, a test less."""
    first = short(
        "a",
        A_1=Stand("passed", 0.5),
        A_2=Stand("passed", 0.5),
        A_3=Stand("passed", 0.5),
        A_4=Stand("passed"),
        A_5=Stand("passed"),
    )
    last = short(
        "b",
        A_1=Stand("passed", 0.54),
        A_2=Stand("passed", 0.56),
        A_3=Stand("failed", 0.5),
        A_4=Stand("passed"),
    )
    assert differing([first, last]) == ["A-2", "A-3", "A-5"]
    assert differing([first, last], everything=True) == ["A-1", "A-2", "A-3", "A-4", "A-5"]
    assert worse(first, last) == ["A-3"]
    assert worse(last, first) == []


def test_runs_stand_in_columns() -> None:
    """A letter each; what has no measurement has no share."""
    first, last = short("a", A_1=Stand("passed", 0.5)), short("b", A_1=Stand("failed"))
    assert table([first, last], ["A-1"]) == [
        "A  a",
        "B  b",
        "",
        "     A             B",
        "A-1  passed 50.0%  failed",
    ]
    assert table([first, first], [])[-1] == "no requirement stands otherwise"


def test_the_command_compares_runs(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Table, JSON and plot; exit status 1 where the last run is worse."""
    good = run_in(tmp_path / "r1", {"HB-01": ("passed", 40), "KEY-01": ("passed", 1)})
    bad = run_in(tmp_path / "r2", {"HB-01": ("failed", 140), "KEY-01": ("passed", 1)})
    data, svg = tmp_path / "d.json", tmp_path / "p.svg"
    assert cli.main(["compare", str(good), str(bad), f"--json={data}", f"--svg={svg}"]) == 1
    shown = capsys.readouterr().out
    assert "HB-01  passed 60.0%  failed -40.0%" in shown
    assert "KEY-01" not in shown
    found = json.loads(data.read_text("utf-8"))
    assert found["worse"] == ["HB-01"]
    assert [run["name"] for run in found["runs"]] == ["r1", "r2"]
    assert svg.read_text("utf-8").count("<circle") == 4  # two of them in the legend
    assert cli.main(["compare", str(bad), str(good), "--json=-", "--all"]) == 0
    assert set(json.loads(capsys.readouterr().out)["requirements"]) == {"HB-01", "KEY-01"}


def test_an_interrupted_run_is_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """It may have said less than the others."""
    one = run_in(tmp_path / "r1", {"HB-01": ("passed", 40)})
    two = run_in(tmp_path / "r2", {"HB-01": ("passed", 40)}, finish=False)
    assert cli.main(["compare", str(one), str(two)]) == 0
    assert "r2 was interrupted" in capsys.readouterr().out


def test_one_run_is_wrong_use(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """And so is one that is not there."""
    one = run_in(tmp_path / "r1", {"HB-01": ("passed", 40)})
    with pytest.raises(SystemExit) as ended:
        cli.main(["compare", str(one)])
    assert ended.value.code == 4
    assert cli.main(["compare", str(one), str(tmp_path / "none")]) == 4
    assert "none: no run; name a folder" in capsys.readouterr().err


def test_a_plot_is_one_file_in_which_names_do_nothing(tmp_path: Path) -> None:
    """Well-formed, without scripts and without links, whatever a device is called."""
    runs = [
        run_in(tmp_path / name, {"HB-01": ("passed", 40)}, serial=HOSTILE) for name in ("a", "b")
    ]
    svg = tmp_path / "p.svg"
    cli.main(["compare", *map(str, runs), "--all", f"--svg={svg}"])
    root = Xml.parse(svg).getroot()  # noqa: S314  it was written just now
    names = {each.tag.partition("}")[2] for each in root.iter()}
    assert names == {"svg", "title", "style", "circle", "text", "line", "g"}
    attributes = {key for each in root.iter() for key in each.attrib}
    assert not {key for key in attributes if key.startswith("on") or "href" in key}
