"""`nodeproof replay FILE`: recordings of others get a table, and a run of their own."""

from __future__ import annotations

import json
import random
from pathlib import Path
from typing import Any

import pytest

from hil_tests import cli
from hil_tests.reporting.check import check_run
from hil_tests.reporting.export import export
from hil_tests.reporting.pcapng import PcapngSink, read_pcapng
from hil_tests.trace import Sighting
from node_model.frame import Frame

MS = 1_000_000
START = 1_700_000_000_000 * MS


def log(folder: Path, count: int = 30, period_ms: int = 100, name: str = "a.log") -> Path:
    """A candump log of node 5: a start, and heartbeats."""
    frames = [(0, "705#00"), *((period_ms * each, "705#7F") for each in range(1, count + 1))]
    path = folder / name
    lines = [f"({1700000000 + ms / 1000:.6f}) can0 {frame}" for ms, frame in frames]
    path.write_text("\n".join(lines) + "\n")
    return path


def replay(folder: Path, *words: object) -> int:
    """The command, with its reports in the folder."""
    try:
        return cli.main(["replay", *map(str, words), "--reports", str(folder / "reports")])
    except SystemExit as end:
        return int(end.code or 0)


def results(folder: Path) -> dict[str, Any]:
    """Outcome of each requirement, by id."""
    document = json.loads((folder / "reports" / "latest" / "results.json").read_text())
    return {row["test"].partition("::")[2]: row for row in document["results"]}


@pytest.mark.parametrize(("period_ms", "status", "came"), [(100, 0, "passed"), (110, 1, "failed")])
def test_a_log_is_judged_and_leaves_a_run(
    period_ms: int, status: int, came: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A row for each requirement, a table for people, a folder that `check` finds valid."""
    path = log(tmp_path, period_ms=period_ms)
    assert replay(tmp_path, path, "--heartbeat", "100 ms") == status
    rows = results(tmp_path)
    assert rows["C-HB-04"]["outcome"] == came
    assert rows["C-HB-02"]["outcome"] == "passed"
    assert rows["C-OD-01"]["outcome"] == "not run"
    assert "it takes questions of a test" in rows["C-OD-01"]["text"]
    said = capsys.readouterr().out
    assert f"{path}: 31 frames in" in said
    assert f"C-HB-04   {came}" in said
    run = tmp_path / "reports" / "latest"
    assert check_run(run) == []
    assert (run / "report.html").is_file()


def test_the_recording_is_kept_as_it_was_judged(tmp_path: Path) -> None:
    """As a trace of the run, with doubt and direction."""
    path = tmp_path / "a.log"
    path.write_text("(1.5) can0 705#00\n(1.6) can0 000#0105\n(1.7) can0 705#05\n")
    assert replay(tmp_path, path, "--doubt", "3 us") == 0
    (trace,) = (tmp_path / "reports" / "latest" / "traces").iterdir()
    found = [entry for entry in read_pcapng(trace) if isinstance(entry, Sighting)]
    # Whole milliseconds: what was cut off is in the doubt as well.
    assert [entry.at for entry in found] == [1501 * MS, 1601 * MS, 1701 * MS]
    assert [entry.doubt_ns for entry in found] == [1_003_000] * 3
    assert [entry.own for entry in found] == [False, True, False]


@pytest.mark.parametrize("form", ["log", "blf", "asc", "pcapng"])
def test_every_form_is_judged_alike(form: str, tmp_path: Path) -> None:
    """candump, BLF, ASC, and pcapng that holds no test of ours."""
    source, path = tmp_path / "s.pcapng", tmp_path / f"t.{form}"
    with PcapngSink(source, interface="can0", clock="c", flush=False) as sink:
        for number in range(40):
            sink.write(Sighting(Frame(0x705, b"\x05"), START + number * 100 * MS))
    export(source, form, path)
    assert replay(tmp_path, path, "--heartbeat", "100 ms", "--bitrate", "250000") == 0
    assert results(tmp_path)["C-HB-04"]["outcome"] == "passed"


def test_a_keypad_is_judged_by_its_own_requirements(tmp_path: Path) -> None:
    """Frames that its source does not list, key frames outside operational."""
    path = tmp_path / "a.log"
    path.write_text(
        "(1.0000001) can0 705#00\n(1.1) can0 705#7F\n(1.2) can0 185#01\n(1.3) can0 385#00\n"
    )
    options = ["--profile", "keypad", "--heartbeat", "100 ms"]
    assert replay(tmp_path, path, *options) == 1
    rows = results(tmp_path)
    assert rows["KEY-07"]["outcome"] == "failed"
    assert rows["KEY-01"]["outcome"] == "not run"
    assert "keys" in rows["KEY-01"]["text"]


def test_several_recordings_are_judged_one_by_one(tmp_path: Path) -> None:
    """The run says which came from which."""
    paths = [log(tmp_path, name=name) for name in ("a.log", "b.log")]
    assert replay(tmp_path, *paths, "--heartbeat", "100 ms") == 0
    document = json.loads((tmp_path / "reports" / "latest" / "results.json").read_text())
    tests = [row["test"] for row in document["results"] if row["outcome"] == "passed"]
    assert {"a.log::C-HB-04", "b.log::C-HB-04"} <= set(tests)


@pytest.mark.parametrize(
    ("lines", "options", "said"),
    [
        ("(1.0) can0 705#05\n(2.0) can0 706#05\n", [], "several nodes send error control: 5 (1"),
        ("(1.0) can0 185#05\n", [], "say whom to judge with --node-id N"),
        ("(1.0) can0 705#05\n", ["--node-id", "0"], "'0' is no whole number in 1 .. 127"),
        ("(1.0) can0 705#05\n", ["--node-id", "9" * 99], "is no whole number"),
        ("(1.0) can0 705#05\n", ["--bitrate", "5"], "in 10000 .. 1000000"),
        ("(1.0) can0 705#05\n", ["--heartbeat", "100"], "--heartbeat: '100' is no time"),
        ("(1.0) can0 705#05\n", ["--doubt", "x"], "--doubt: 'x' is no time"),
        ("(1.0) can0 705#05\n", ["--profile", "none"], "no such profile"),
        ("(1.0) can0 77F#05\n", ["--profile", "keypad"], "--node-id 127: a keypad has one of"),
        ("(2.0) can0 705#05\n(1.0) can0 705#05\n", [], "line 2: the stamp is 1 s earlier"),
        ("(2.0) can0 705#0\n", [], "line 1"),
        ("", [], "no CAN frame in it"),
    ],
)
def test_wrong_use_and_damage_are_told(
    lines: str,
    options: list[str],
    said: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """Exit status 4, one line with file, place and remedy, no traceback."""
    path = tmp_path / "a.log"
    path.write_text(lines)
    assert replay(tmp_path, path, *options) == 4
    assert said in capsys.readouterr().err


@pytest.mark.parametrize("seed", range(8))
def test_random_bytes_are_told(
    seed: int, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Whatever they look like at first."""
    chance = random.Random(seed)
    path = tmp_path / "a.bin"
    heads = (b"", b"\x0a\x0d\x0d\x0a", b"LOGG", b"date ")
    path.write_bytes(heads[seed % 4] + chance.randbytes(chance.randrange(5000)))
    assert replay(tmp_path, path, "--node-id", "5") == 4
    assert str(path) in capsys.readouterr().err
