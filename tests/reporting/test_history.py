"""The history of devices: an index that follows the runs, and can be thrown away."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from xml.etree import ElementTree as Xml

import pytest

from hil_tests import cli
from hil_tests.reporting.files import RecordUnreadable
from hil_tests.reporting.history import INDEX, History, narrowest
from hil_tests.reporting.summary import Stand
from tests.reporting.test_compare import HOSTILE, run_in, short


@pytest.fixture(name="reports")
def _reports(tmp_path: Path) -> Path:
    """Three runs of one device, the oldest last by name, and one of another."""
    for name, firmware, measured in (("r3", "1.0", 40), ("r2", "1.1", 60), ("r1", "1.2", 80)):
        verdicts = {"HB-01": ("passed", measured), "KEY-01": ("passed", 1)}
        started = f"2025-01-0{4 - int(name[1])}T00:00:00Z"
        run_in(tmp_path / name, verdicts, serial="A-7", firmware=firmware, started=started)
    run_in(tmp_path / "other", {"HB-01": ("failed", 140)}, serial=None)
    (tmp_path / "latest").symlink_to("r1")
    return tmp_path


def test_runs_of_a_device_stand_in_the_order_of_time(reports: Path) -> None:
    """By serial number; `latest` is no run of its own."""
    history = History(reports)
    assert [run.firmware for run in history.runs("A-7")] == ["1.0", "1.1", "1.2"]
    assert [run.stands["HB-01"].share for run in history.runs("A-7")] == [0.6, 0.4, 0.2]
    assert [(serial, count) for serial, count, _ in history.serials()] == [("", 1), ("A-7", 3)]
    assert len(history.runs(None)) == 4


def test_the_index_follows_the_runs(reports: Path) -> None:
    """New, changed and gone ones; what is the same is not read again."""
    History(reports)
    run_in(reports / "r4", {"HB-01": ("passed", 1)}, serial="A-7")
    shutil.rmtree(reports / "r3")
    (reports / "r2" / "results.json").unlink()
    (reports / "r2").rmdir()
    run_in(reports / "r2", {"HB-01": ("failed", 120)}, serial="B-1")
    history = History(reports)
    assert sorted(run.name for run in history.runs("A-7")) == ["r1", "r4"]
    assert [run.stands["HB-01"].outcome for run in history.runs("B-1")] == ["failed"]


def test_a_run_that_was_read_is_not_read_again(
    reports: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The index is what makes a thousand runs quick."""
    before = History(reports).runs("A-7")
    monkeypatch.setattr("hil_tests.reporting.history.summary_of", None)
    assert History(reports).runs("A-7") == before


def test_an_index_that_was_thrown_away_is_made_again(reports: Path) -> None:
    """It holds nothing that the runs do not."""
    before = History(reports).runs(None)
    (reports / INDEX).unlink()
    assert History(reports).runs(None) == before
    assert History(reports, rebuild=True).runs(None) == before


def test_an_index_that_is_none_is_told_with_the_remedy(
    reports: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Garbage in its place; --rebuild makes it anew."""
    (reports / INDEX).write_bytes(b"no index" * 100)
    with pytest.raises(RecordUnreadable, match="--rebuild makes it anew"):
        History(reports)
    assert cli.main(["history", f"--reports={reports}", "--rebuild"]) == 0
    assert "A-7                     3 runs" in capsys.readouterr().out


def test_a_run_that_cannot_be_read_is_left_out_and_told(
    reports: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The others are shown."""
    (reports / "r2" / "results.json").write_text("{", "utf-8")
    assert cli.main(["history", "A-7", f"--reports={reports}"]) == 0
    out, error = capsys.readouterr()
    assert "r2" in error
    assert len(out.splitlines()) == 3


def test_the_command_shows_table_json_and_plot(
    reports: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A line for each run, with the margins that were the narrowest."""
    svg = reports / "p.svg"
    assert cli.main(["history", "A-7", f"--reports={reports}", f"--svg={svg}"]) == 0
    head, *rows = capsys.readouterr().out.splitlines()
    assert head.split() == [
        *("started", "serial", "firmware", "bench", "ended", "worst", "HB-01", "KEY-01")
    ]
    assert [row.split()[-2:] for row in rows] == [
        ["60.0%", "99.0%"],
        ["40.0%", "99.0%"],
        ["20.0%", "99.0%"],
    ]
    assert svg.read_text("utf-8").count("<polyline") == 2
    assert cli.main(["history", "all", f"--reports={reports}", "--json=-", "--clause=HB"]) == 0
    assert len(json.loads(capsys.readouterr().out)) == 4


def test_a_device_that_is_not_known_is_refused(
    reports: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """With those that are."""
    assert cli.main(["history", "B-9", f"--reports={reports}"]) == 4
    assert "B-9: no runs of that device; there are: A-7" in capsys.readouterr().err
    assert cli.main(["history", "--reports=/nowhere"]) == 4
    assert "/nowhere: no such folder" in capsys.readouterr().err


def test_hostile_names_do_nothing(tmp_path: Path) -> None:
    """Neither to the index nor to a plot."""
    names = [HOSTILE, "'; DROP TABLE run; --", "%", ""]
    for place, name in enumerate(names):
        run_in(tmp_path / f"r{place}", {"HB-01": ("passed", 40)}, serial=name, firmware=name)
    history = History(tmp_path)
    for name in names:
        assert [run.firmware for run in history.runs(name)] == [name]
    svg = tmp_path / "p.svg"
    assert cli.main(["history", HOSTILE, f"--reports={tmp_path}", f"--svg={svg}"]) == 0
    root = Xml.parse(svg).getroot()  # noqa: S314  it was written just now
    assert not [each for each in root.iter() if each.tag.endswith("script")]


def test_the_narrowest_margins_come_first() -> None:
    """A few of them; or all whose ids begin as asked."""
    stands = {f"A_{place}": Stand("passed", place / 20) for place in range(12)}
    runs = [short("a", **stands), short("b", A_11=Stand("passed", -0.1), B_1=Stand("passed"))]
    assert narrowest(runs) == ["A-11", "A-0", "A-1", "A-2", "A-3", "A-4", "A-5", "A-6"]
    assert narrowest(runs, ["a-1"]) == ["A-11", "A-1", "A-10"]
