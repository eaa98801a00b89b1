"""`nodeproof show`: a browser where there is a screen, else the place of the report."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from hil_tests import cli
from hil_tests.errors import ConfigError
from hil_tests.run.showing import show
from tests.reporting.html.making import make_run, passed, result


def test_a_report_is_opened_where_there_is_a_screen(tmp_path: Path) -> None:
    """Made first, where it is missing."""
    run, opened = make_run(tmp_path / "run", result(1, passed())), list[str]()

    def browse(address: str) -> bool:
        opened.append(address)
        return True

    report = show(run, {"DISPLAY": ":0"}, browse)
    assert report == run.resolve() / "report.html"
    assert report.is_file()
    assert opened == [report.as_uri()]


def test_without_a_screen_its_place_is_printed(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A browser in the terminal would take it over."""
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "BROWSER"):
        monkeypatch.delenv(name, raising=False)
    run = make_run(tmp_path / "run", result(1, passed()))
    assert cli.main(["show", str(run)]) == 0
    assert capsys.readouterr().out.strip() == str(run.resolve() / "report.html")


def test_a_report_that_is_older_than_the_results_is_made_again(tmp_path: Path) -> None:
    """The run went on, or was judged anew."""
    run = make_run(tmp_path / "run", result(1, passed()))
    report = show(run, {})
    report.write_text("old", "utf-8")
    os.utime(report, (1, 1))
    assert show(run, {}).read_text("utf-8") != "old"


def test_what_is_no_run_is_refused(tmp_path: Path) -> None:
    """With what to name instead."""
    with pytest.raises(ConfigError, match=r"no run; name a folder that has results\.json"):
        show(tmp_path, {})
