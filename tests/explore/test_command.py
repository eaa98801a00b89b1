"""`nodeproof explore`, `play` and `distil`: what they print, and how they end."""

from __future__ import annotations

import shlex
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from hil_tests import cli
from hil_tests.explore.lab import Lab
from hil_tests.scenarios.corpus import Stored, parsed, written
from hil_tests.scenarios.scenario import scenario
from node_model.faults import MUTANTS
from tests.run.harness import ROOT, heeding_interrupts

Output = pytest.CaptureFixture[str]
PRESS = "operational: 60ms keys 1; 200ms wait"


# Play.


def test_play_shows_every_frame_and_what_is_wrong(capsys: Output) -> None:
    """A fault is status 1."""
    assert cli.main(["play", PRESS, "--mutant", "debounce-too-short"]) == 1

    told = capsys.readouterr().out
    assert "boot-up" in told
    assert "key frame" in told
    assert "\nFAIL KEY-05: " in told
    assert "nothing is wrong" not in told


def test_play_of_a_right_model(capsys: Output) -> None:
    """Status 0, and it says so."""
    assert cli.main(["play", PRESS]) == 0

    told = capsys.readouterr().out
    assert told.endswith("nothing is wrong\n")
    assert "FAIL" not in told


def test_play_of_nothing(capsys: Output) -> None:
    """A device that is never switched on sends no frame."""
    assert cli.main(["play", "off:"]) == 0
    assert capsys.readouterr().out == "nothing is wrong\n"


def test_play_refuses_what_is_no_scenario(capsys: Output) -> None:
    """The step and what was meant are named."""
    assert cli.main(["play", "operational: 60ms kays 1"]) == 4
    assert "unknown verb 'kays'; there is keys" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["play", PRESS, "--mutant", "debounce-to-short"], "did you mean debounce-too-short"),
        (["play", PRESS, "--profile", "kaypad"], "keypad"),
        (["explore", "--mutant", "debounce-to-short"], "did you mean debounce-too-short"),
        (["explore", "--profile", "kaypad"], "keypad"),
        (["distil", "no.toml", "--mutant", "debounce-to-short"], "mean debounce-too-short"),
        (["distil", "no.toml", "--mutant", "?"], "`nodeproof mutants` lists them"),
    ],
)
def test_wrong_names_are_told_before_anything_is_played(
    words: list[str], said: str, capsys: Output
) -> None:
    """Status 4, and what is near."""
    assert cli.main(words) == 4

    told = capsys.readouterr()
    assert said in told.err
    assert told.out == ""


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["play"], "scenario"),
        (["explore", "--for", "soon"], "'soon' is no time"),
        (["explore", "--jobs", "0"], "--jobs: at least one"),
        (["explore", "--family", "kees"], "'keys'"),
        (["explore", "--seed", "x"], "--seed"),
        (["distil"], "file"),
        (["distil", "no.toml", "--patience", "5"], "'5' is no time"),
    ],
)
def test_wrong_options_are_wrong_use(words: list[str], said: str, capsys: Output) -> None:
    """Status 4, and the option with what it takes."""
    with pytest.raises(SystemExit) as ended:
        cli.main(words)

    assert ended.value.code == 4
    assert said in capsys.readouterr().err


# Explore.


@pytest.mark.slow
def test_what_explore_prints_plays_again(capsys: Output) -> None:
    """Each finding is a line with a command that shows it; the head repeats the whole."""
    words = ["explore", "--for", "300ms", "--jobs", "1", "--seed", "3", "--family", "keys"]
    assert cli.main([*words, "--mutant", "entry-frame-missing"]) == 1

    head, *lines, last = capsys.readouterr().out.splitlines()
    assert head == (
        "seed 3; the same again: nodeproof explore --seed=3 --jobs=1 --for=300ms --family=keys"
        " --mutant=entry-frame-missing"
    )
    assert lines
    for line in lines:
        text, _, command = line.partition(" | ")
        name, *again = shlex.split(command)
        assert name == "nodeproof"
        assert cli.main(again) == 1
        assert f"FAIL {text}\n" in capsys.readouterr().out
    assert last.endswith(f", {len(lines)} findings")
    assert " scenarios (" in last
    assert " bus hours, " in last


@pytest.mark.slow
def test_explore_of_a_right_model(capsys: Output) -> None:
    """Status 0 and no finding, also where the time is too short for anything."""
    assert cli.main(["explore", "--for", "0s", "--jobs", "1"]) == 0

    head, last = capsys.readouterr().out.splitlines()
    assert head.startswith("seed 0; ")
    assert last.endswith("0 findings")


# Distil.


def test_distil_writes_a_scenario_for_each_fault(tmp_path: Path, capsys: Output) -> None:
    """What it finds is in the file, and shows the fault; what is there is kept."""
    file = tmp_path / "corpus.toml"
    old = Stored("old", scenario("off: 0ms wait"), ("HB-01",), ())
    file.write_text(written([old]), "utf-8")
    assert cli.main(["distil", str(file), "--mutant", "entry-frame-missing"]) == 0

    told = capsys.readouterr().out
    assert told == "1/1 entry-frame-missing: by entry-frame-missing\nnone missed\n"
    kept, found = parsed(file.read_text("utf-8"), str(file))
    assert kept == old
    finding = Lab(model="entry-frame-missing").play(found.scenario)
    assert finding is not None
    assert finding.requirements & set(MUTANTS["entry-frame-missing"].violates)

    before = file.read_bytes()
    assert cli.main(["distil", str(file), "--mutant", "entry-frame-missing"]) == 0
    assert "by entry-frame-missing" in capsys.readouterr().out
    assert file.read_bytes() == before


def test_distil_says_what_it_missed(tmp_path: Path, capsys: Output) -> None:
    """Status 1; nothing is written for a fault that nothing shows."""
    file = tmp_path / "corpus.toml"
    words = ["distil", str(file), "--patience", "0s", "--mutant", "restarts-every-twenty-seconds"]
    assert cli.main(words) == 1

    told = capsys.readouterr().out
    assert "1/1 restarts-every-twenty-seconds: MISSED" in told
    assert told.endswith("1 missed: restarts-every-twenty-seconds\n")
    assert not file.exists()


def test_distil_reads_the_file_first(tmp_path: Path, capsys: Output) -> None:
    """One that is no corpus is told with its errors, and left as it is."""
    file = tmp_path / "corpus.toml"
    file.write_text('[[scenario]]\nname = "a"\n', "utf-8")
    assert cli.main(["distil", str(file), "--mutant", "entry-frame-missing"]) == 4
    assert "scenario 1: 'play' is missing" in capsys.readouterr().err
    assert file.read_text("utf-8") == '[[scenario]]\nname = "a"\n'


@pytest.mark.slow
def test_what_was_found_stands_when_exploring_is_interrupted() -> None:
    """Ctrl-C ends it with status 2, the closing line, and no word of Python's."""
    command = [sys.executable, "-m", "hil_tests.cli", "explore", "--for=10min", "--jobs=2"]
    command += ["--mutant=entry-frame-missing", "--family=keys"]
    with (
        heeding_interrupts(),
        subprocess.Popen(
            command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        ) as process,
    ):
        assert process.stdout is not None
        head, found = process.stdout.readline(), process.stdout.readline()
        process.send_signal(signal.SIGINT)
        rest, errors = process.communicate(timeout=60)
    assert head.startswith("seed 0; the same again: ")
    assert found.startswith("KEY-01: ")
    assert process.returncode == 2
    assert " scenarios (" in rest
    assert "Traceback" not in errors
