"""Tests in real time that take long show it behind pytest's dots, and leave nothing there."""

from __future__ import annotations

import io
import os
import pty
import subprocess
from pathlib import Path
from types import SimpleNamespace

import pytest

from hil_tests.clock import MS, S
from hil_tests.run.capture import PytestCapture, Ticker
from hil_tests.run.progress import Progress
from tests.bench.test_bench import virtual
from tests.host.test_process import free_channel
from tests.run.harness import PREAMBLE, command, environment, judge_apart


class Screen:
    """A terminal line as pytest writes it, and what a person sees on it."""

    def __init__(self, width: int = 80, dots: int = 3) -> None:
        self.file = io.StringIO()
        self.writer = SimpleNamespace(fullwidth=width, width_of_current_line=dots, _file=self.file)
        self.dots = dots
        self.ticker = Ticker(self.writer, None)

    @property
    def line(self) -> str:
        """What stands on the line."""
        return seen("." * self.dots + self.file.getvalue())


def seen(written: str) -> str:
    """A line after backspaces and erasures."""
    line, place = "", 0
    for part in written.replace("\x1b[K", "\0"):
        if part == "\b":
            place -= 1
        elif part == "\0":
            line = line[:place]
        else:
            line, place = line[:place] + part + line[place + 1 :], place + 1
    return line


def test_it_tells_after_two_seconds_and_then_each_second() -> None:
    """Nothing for a short test; the last word takes the place of the one before."""
    bench, screen = virtual(), Screen()
    progress = Progress(screen.ticker)
    bench.begin()
    progress.begin(bench, "t.py::test_long[x]")
    bench.wait(2 * S - 1 * MS)
    assert screen.line == "..."
    bench.wait(1 * MS)
    assert screen.line == "... 2 s, 0 frames: test_long[x]"
    bench.wait(13 * S)
    assert screen.line == "... 15 s, 0 frames: test_long[x]"
    progress.end()
    progress.end()
    assert screen.line == "..."
    bench.close()


def test_the_line_is_never_filled() -> None:
    """A text is cut where the line ends; where there is hardly room, nothing is shown."""
    screen = Screen(width=40, dots=10)
    screen.ticker.show("x" * 100)
    assert len(screen.line) == 38
    full = Screen(width=40, dots=20)
    full.ticker.show("x" * 100)
    assert full.line == "." * 20


def test_nothing_is_shown_while_an_operator_is_asked(pytestconfig: pytest.Config) -> None:
    """The prompt has the line for itself."""
    screen = Screen()
    screen.ticker.show("2 s, 0 frames: test_long")
    lent = PytestCapture(pytestconfig, screen.ticker)
    lent.suspend()
    screen.ticker.show("3 s, 0 frames: test_long")
    assert screen.line == "..."
    lent.resume()
    screen.ticker.show("4 s, 0 frames: test_long")
    assert screen.line == "... 4 s, 0 frames: test_long"


LONG = """
@pytest.mark.requirement("NMT-02")
def test_long(bench):
    bench.wait(2_200_000_000)

@pytest.mark.requirement("NMT-02")
def test_short(bench):
    bench.wait(1_000_000)
"""


def on_a_terminal(folder: Path, *options: str) -> str:
    """What a run writes on a terminal."""
    (folder / "test_device.py").write_text(PREAMBLE + LONG, "utf-8")
    ours, theirs = pty.openpty()
    words = command(folder, *options)
    with subprocess.Popen(words, cwd=folder, env=environment(), stdout=theirs) as run:
        os.close(theirs)
        written = b""
        try:
            while part := os.read(ours, 4096):
                written += part
        except OSError:  # Linux: the other end is closed
            pass
        os.close(ours)
        assert run.wait() == 0, written.decode()
    return written.decode()


@pytest.mark.slow
@pytest.mark.parametrize("loudness", ["-q", "-v", "--capture=no"])
def test_a_run_in_real_time_tells_it_on_the_terminal(tmp_path: Path, loudness: str) -> None:
    """Beside pytest's capture; when the run is over, the dots stand as if it had been silent."""
    options = ["--can-interface=udp_multicast", f"--can-iface={free_channel()}", loudness]
    written = on_a_terminal(tmp_path, *options)
    assert " 2 s, " in written
    assert "frames: test_long" in written
    left = [seen(line.rstrip("\r")) for line in written.split("\n")]
    assert not any("frames: test_long" in line for line in left)


@pytest.mark.slow
def test_a_log_has_no_need_of_it(tmp_path: Path) -> None:
    """Where output goes to a file, as in CI, nothing stands among pytest's lines."""
    options = ["--can-interface=udp_multicast", f"--can-iface={free_channel()}"]
    run = judge_apart(tmp_path, LONG, *options)
    assert run.status == 0, run.text
    assert "frames: test_long" not in run.text


@pytest.mark.slow
def test_virtual_time_needs_no_patience(tmp_path: Path) -> None:
    """What takes hours on the bus takes seconds, so nothing is told."""
    assert "frames: test_long" not in on_a_terminal(tmp_path)
