"""The command `nodeproof export`: what it writes, what it says, what it refuses."""

from __future__ import annotations

from pathlib import Path

import pytest

from hil_tests import cli
from hil_tests.reporting.pcapng import PcapngSink, read_pcapng
from hil_tests.trace import Mark, Moment, Sighting
from node_model.frame import Frame

ENTRIES: list[Moment | Sighting | Mark] = [
    Moment("begin", 0, 0, {"test": "t"}),
    Sighting(Frame(0x705, b"\x05"), 1_000_000_123, 40),
    Mark(1_000_000_123, "HB-01: right", {"outcome": "passed"}),
]


def trace(path: Path) -> Path:
    """A trace of ours."""
    path.parent.mkdir(exist_ok=True)
    with PcapngSink(path, interface="can0", clock="c", flush=False) as sink:
        for entry in ENTRIES:
            sink.write(entry)
    return path


def test_a_trace_is_written_beside_itself(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Under its own name; what the form cannot hold is said."""
    source = trace(tmp_path / "t.pcapng")
    assert cli.main(["export", str(source), "--to", "log"]) == 0
    said = capsys.readouterr().out
    assert said.startswith(f"{tmp_path / 't.log'}\nlog cannot hold: what the bench did, verdicts")
    assert (tmp_path / "t.log").read_text() == "(1.000000) can0 705#05 R\n"


def test_every_trace_of_a_run_is_written(tmp_path: Path) -> None:
    """To a folder of its own, or to the one that is named."""
    for name in ("a", "b"):
        trace(tmp_path / "traces" / f"{name}.pcapng")
    assert cli.main(["export", str(tmp_path), "--to", "asc"]) == 0
    assert cli.main(["export", str(tmp_path), "--to", "blf", "-o", str(tmp_path / "out")]) == 0
    found = {
        path.name for folder in ("export-asc", "out") for path in (tmp_path / folder).iterdir()
    }
    assert found == {"a.asc", "b.asc", "a.blf", "b.blf"}


def test_pcapng_keeps_everything(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Notes, verdicts and doubt included."""
    target = tmp_path / "copy.pcapng"
    source = trace(tmp_path / "t.pcapng")
    assert cli.main(["export", str(source), "--to", "pcapng", "-o", str(target)]) == 0
    assert list(read_pcapng(target)) == ENTRIES
    assert "pcapng holds everything" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["none.pcapng", "--to", "log"], "none.pcapng: No such file"),
        ([".", "--to", "log"], "no traces/*.pcapng there"),
        (["t.pcapng", "--to", "pcapng"], "is there already; remove it, or name another with -o"),
        (["t.pcapng", "--to", "log", "-o", "t.pcapng/x"], "name another place with -o"),
        (["t.pcapng", "--to", "trc"], "invalid choice: 'trc'"),
    ],
)
def test_what_cannot_be_exported_is_refused(
    words: list[str],
    said: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Wrong use, with the remedy; the lossy forms of python-can are none of ours."""
    monkeypatch.chdir(tmp_path)
    trace(tmp_path / "t.pcapng")
    try:
        status = cli.main(["export", *words])
    except SystemExit as end:
        status = int(end.code or 0)
    assert status == cli.USAGE
    assert said in capsys.readouterr().err
