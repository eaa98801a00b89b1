"""The command `nodeproof replay`: runs of ours go to pytest, wrong use is told."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from hil_tests import cli
from hil_tests.errors import ConfigError
from hil_tests.replay import command
from hil_tests.reporting.pcapng import PcapngSink
from hil_tests.trace import Moment
from tests.run.harness import ROOT, environment, judge_apart

TEST = """
@pytest.mark.requirement("NMT-02")
def test_starts(bench):
    bench.start()
"""


@pytest.mark.slow
def test_a_run_is_replayed_where_its_tests_are(tmp_path: Path) -> None:
    """By its folder, by its results, by a trace; each replay is a run of its own."""
    run = judge_apart(tmp_path, TEST, "--can-mutant=boot-up-late")
    assert run.status == 1
    folder = run.folder.resolve()
    (trace,) = run.traces()
    for recording in (folder, folder / "results.json", trace.resolve()):
        done = subprocess.run(
            [sys.executable, "-m", "hil_tests.replay", str(recording), "--reports", "again"],
            cwd=tmp_path,
            env=environment(PYTEST_ADDOPTS="-p hil_tests.plugin"),
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 1, done.stdout + done.stderr
        assert "every verdict is the recorded one" in done.stdout
    assert len([path for path in (tmp_path / "again").iterdir() if path.is_dir()]) == 4


@pytest.mark.slow
def test_acceptance_tests_are_found_wherever_it_is_run(tmp_path: Path) -> None:
    """They come with the package."""
    start = ["-p", "no:cacheprovider", f"--can-reports={tmp_path / 'reports'}"]
    node = "hil_tests/acceptance/test_start_and_nmt.py::test_boot_up_is_one_zero_byte"
    recorded = [sys.executable, "-m", "pytest", "-q", *start, node]
    subprocess.run(recorded, cwd=ROOT, check=True, capture_output=True)
    folder = str(tmp_path / "reports" / "latest")
    done = subprocess.run(
        [sys.executable, "-m", "hil_tests.cli", "replay", folder, "--reports", "again"],
        cwd=tmp_path,
        env=environment(),
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert "every verdict is the recorded one" in done.stdout


def test_wrong_use_is_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Exit status 4, as everywhere."""
    with PcapngSink(tmp_path / "t.pcapng", interface="c", clock="c", flush=False) as sink:
        sink.write(Moment("begin", 0, 0, {"test": "gone.py::test_it"}))
    (tmp_path / "other.log").write_text("(1.0) can0 701#05\n")
    ours, other = str(tmp_path / "t.pcapng"), str(tmp_path / "other.log")
    for words, said in (
        ([ours, other], "other.log is no trace of ours, and"),
        ([ours], "its beginning says 'None' for"),
        ([str(tmp_path)], "results.json"),
        ([], "the following arguments are required"),
    ):
        for main in (command.main, lambda words: cli.main(["replay", *words])):
            try:
                status = main(words)
            except SystemExit as end:
                status = int(end.code or 0)
            assert status == 4
            assert said in capsys.readouterr().err, said


def test_tests_that_are_elsewhere_are_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With what to do: replay where they are."""
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ConfigError, match=r"mine/test_it\.py: the recorded tests stood"):
        command.places(["mine/test_it.py::test_a"])
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "test_it.py").touch()
    assert command.places(["mine/test_it.py::test_a", "mine/test_it.py::test_b"]) == [
        "mine/test_it.py"
    ]
    assert command.places(["hil_tests/acceptance/test_keys.py::test_a"]) == [
        "--pyargs",
        "hil_tests.acceptance",
    ]


@pytest.mark.parametrize("file", ["test_keys.py", "cia301/test_nmt.py"])
def test_tests_of_an_installed_suite_are_found(
    file: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Pytest names them from the suite's own folder; a file of that name here goes first."""
    monkeypatch.chdir(tmp_path)
    assert command.places([f"{file}::test_a"]) == ["--pyargs", "hil_tests.acceptance"]
    (tmp_path / file).parent.mkdir(exist_ok=True)
    (tmp_path / file).touch()
    assert command.places([f"{file}::test_a"]) == [file]
