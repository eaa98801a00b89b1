"""The folder of a run: new each time, never over an old one, names that always work."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta, timezone
from pathlib import Path

import pytest

from hil_tests.errors import ConfigError
from hil_tests.reporting.rundir import RunDirectory, replace_file

NOON = datetime(2025, 1, 31, 12, 0, 5, tzinfo=UTC)


def test_a_run_gets_a_folder_named_after_its_time_in_utc(tmp_path: Path) -> None:
    """Whatever the local time zone; with a place for traces."""
    local = NOON.astimezone(timezone(timedelta(hours=9)))
    run = RunDirectory.create(tmp_path / "reports", local)
    assert run.path.parent == tmp_path / "reports"
    assert run.path.name.startswith("20250131T120005Z-")
    assert run.traces.is_dir()


def test_two_runs_of_one_second_do_not_meet(tmp_path: Path) -> None:
    """An older run is never touched."""
    runs = {RunDirectory.create(tmp_path, NOON).path for _ in range(20)}
    assert len(runs) == 20


def test_latest_is_the_newest_run(tmp_path: Path) -> None:
    """A link that moves on with each run."""
    RunDirectory.create(tmp_path, NOON)
    run = RunDirectory.create(tmp_path, NOON)
    assert (tmp_path / "latest").resolve() == run.path.resolve()
    assert (tmp_path / "latest").readlink() == Path(run.path.name)
    assert [path.name for path in tmp_path.iterdir() if path.name.startswith(".")] == []


def test_where_links_are_impossible_latest_is_a_text(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Some file systems have none: the file holds the name."""

    def refuse(*_: object, **__: object) -> None:
        raise OSError(1, "Operation not permitted")

    monkeypatch.setattr(Path, "symlink_to", refuse)
    run = RunDirectory.create(tmp_path, NOON)
    assert (tmp_path / "latest").read_text("utf-8") == f"{run.path.name}\n"


def test_a_folder_named_latest_is_left_alone(tmp_path: Path) -> None:
    """It is somebody's own; the name of the run stands beside it."""
    (tmp_path / "latest").mkdir()
    (tmp_path / "latest" / "mine").write_text("x", "utf-8")
    run = RunDirectory.create(tmp_path, NOON)
    assert (tmp_path / "latest" / "mine").exists()
    assert (tmp_path / "latest.txt").resolve() == run.path.resolve()


@pytest.mark.parametrize("place", ["file", "file/reports"])
def test_where_nothing_can_be_written_the_remedy_is_named(tmp_path: Path, place: str) -> None:
    """A mistake of the user's, told before the first test."""
    (tmp_path / "file").write_text("x", "utf-8")
    with pytest.raises(ConfigError, match="--can-reports DIR"):
        RunDirectory.create(tmp_path / place, NOON)


HOSTILE = [
    "hil_tests/acceptance/test_nmt.py::test_boot_up",
    "hil_tests/acceptance/test_nmt.py::test_boot_up[a]",
    "hil_tests/acceptance/test_nmt.py::test_boot_up[A]",
    "hil_tests/acceptance/test_nmt.py::Test_Boot::up[A]",
    "other/test_nmt.py::test_boot_up",
    "",
    "..",
    "../../etc/passwd",
    "/",
    "x" * 5000,
    "x" * 5001,
    "test_x.py::test[../../..]",
    "test_x.py::test[\0\n\r\t]",
    "test_x.py::test[\ud800]",
    "test_x.py::test[naïve ünïcode 漢字]",
    "CON",
    "-rf",
]


def test_every_test_has_a_safe_and_short_trace_name_of_its_own(tmp_path: Path) -> None:
    """Inside the folder, plain ASCII, apart even where case does not count, openable."""
    run = RunDirectory.create(tmp_path, NOON)
    names = set()
    for test in HOSTILE:
        for part in ("", "example 1"):
            path = run.trace_path(test, part)
            assert path == run.trace_path(test, part)
            assert path.parent == run.traces
            assert path.name.isascii()
            assert len(path.name) <= 110
            assert not path.name.startswith((".", "-"))
            path.write_bytes(b"")
            names.add(path.name.casefold())
    assert len(names) == 2 * len(HOSTILE)


def test_a_trace_name_is_readable(tmp_path: Path) -> None:
    """Module, test and parameter can be recognised."""
    path = RunDirectory(tmp_path).trace_path("a/b/test_nmt.py::test_boot_up[x/y-3]")
    assert path.name.startswith("test_nmt-test_boot_up-x-y-3-")
    assert path.suffix == ".pcapng"


def test_results_name_a_trace_from_the_folder_of_the_run(tmp_path: Path) -> None:
    """So the folder can be moved."""
    run = RunDirectory(tmp_path)
    assert run.relative(run.traces / "a.pcapng") == "traces/a.pcapng"


def test_a_file_is_replaced_as_a_whole(tmp_path: Path) -> None:
    """The new content, and no draft left over."""
    path = tmp_path / "report.html"
    replace_file(path, b"old")
    replace_file(path, b"new")
    assert path.read_bytes() == b"new"
    assert list(tmp_path.iterdir()) == [path]


def test_a_failed_replacement_keeps_the_old_file(tmp_path: Path) -> None:
    """Nothing is lost and no draft stays."""
    path = tmp_path / "report"
    path.mkdir()
    with pytest.raises(OSError, match="director"):
        replace_file(path, b"new")
    assert list(tmp_path.iterdir()) == [path]
