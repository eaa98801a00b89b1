"""The `nodeproof` command: subcommands, tables, exit status."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from hil_tests import cli
from hil_tests.requirements import load
from node_model.faults import MUTANTS, VARIANTS

Output = pytest.CaptureFixture[str]


def test_without_a_command_it_tells_what_there_is(capsys: Output) -> None:
    """All commands are named, and the status says that this was no use of it."""
    assert cli.main([]) == 4

    told = capsys.readouterr().out
    assert all(f"\n  {name} " in told for name in cli.COMMANDS)


def test_an_unknown_command_is_wrong_use(capsys: Output) -> None:
    """The status is pytest's for wrong use, and the known commands are named."""
    with pytest.raises(SystemExit) as ended:
        cli.main(["mutant"])

    assert ended.value.code == 4
    assert "'mutants'" in capsys.readouterr().err


@pytest.mark.parametrize("command", ["doctor", "mutants", "requirements", "vcan"])
def test_an_unknown_option_is_wrong_use(command: str, capsys: Output) -> None:
    """Every parser of ours ends with 4, and names itself."""
    with pytest.raises(SystemExit) as ended:
        cli.main([command, "--no-such-option"])

    assert ended.value.code == 4
    assert f"nodeproof {command}: error:" in capsys.readouterr().err


def test_node_takes_its_options_as_they_are(capsys: Output) -> None:
    """Options after `node` reach the model's own command: here a mutant that nobody knows."""
    assert cli.main(["node", "--channel", "vcan0", "--mutant", "heartbet-too-slow"]) == 2
    assert "did you mean heartbeat-too-slow" in capsys.readouterr().err


def test_vcan_without_a_command_shows_one(capsys: Output) -> None:
    """Its status for what keeps a run from starting is passed on."""
    assert cli.main(["vcan", "--quiet"]) == 11
    assert "nodeproof vcan -- pytest" in capsys.readouterr().err


def test_mutants_lists_every_model_that_can_be_put_under_test(capsys: Output) -> None:
    """Faulty and different ones, each with its text."""
    assert cli.main(["mutants"]) == 0

    told = capsys.readouterr().out
    assert all(
        name in told and model.text in told
        for models in (MUTANTS, VARIANTS)
        for name, model in models.items()
    )


def test_requirements_lists_the_catalogue(capsys: Output) -> None:
    """A line begins with each id, in the order of the catalogue."""
    assert cli.main(["requirements"]) == 0

    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines if line[0] != " "] == list(load("keypad"))


def test_requirements_are_chosen_by_the_beginning_of_their_id(capsys: Output) -> None:
    """Several beginnings may be given, in any case of letters."""
    assert cli.main(["requirements", "hb-0", "NMT-20"]) == 0

    ids = {line.split()[0] for line in capsys.readouterr().out.splitlines() if line[0] != " "}
    assert ids == {"NMT-20", *(name for name in load("keypad") if name.startswith("HB-0"))}


def test_a_clause_that_is_none_is_wrong_use(capsys: Output) -> None:
    """The near misses are named."""
    assert cli.main(["requirements", "HB1"]) == 4
    assert "HB-01" in capsys.readouterr().err


def test_a_kind_of_device_that_is_none_is_wrong_use(capsys: Output) -> None:
    """The known kinds are named."""
    assert cli.main(["requirements", "--kind", "lamp"]) == 4
    assert "keypad" in capsys.readouterr().err


def test_the_markdown_table_has_a_row_for_each_requirement(capsys: Output) -> None:
    """Every row has the cells of the head; nothing in a text breaks it."""
    assert cli.main(["requirements", "--md"]) == 0

    head, rule, *rows = capsys.readouterr().out.splitlines()
    assert head.startswith("| id | class | text |")
    assert set(rule) <= set("| -")
    assert [row.split()[1] for row in rows] == list(load("keypad"))
    assert {row.replace("\\|", "").count("|") for row in rows} == {head.count("|")}


@pytest.mark.slow
def test_a_reader_that_leaves_early_is_no_error() -> None:
    """`nodeproof mutants | head` ends without a traceback."""
    read, write = os.pipe()
    os.close(read)
    with os.fdopen(write, "w") as nobody:
        command = [sys.executable, "-m", "hil_tests.cli", "mutants"]
        done = subprocess.run(command, stdout=nobody, stderr=subprocess.PIPE, check=False)

    assert (done.returncode, done.stderr) == (0, b"")


@pytest.mark.slow
def test_it_starts_at_once() -> None:
    """Help is given without the heavy packages."""
    script = (
        "import sys, hil_tests.cli as c; c.main([]); "
        "sys.exit(str({'can', 'hypothesis', 'pytest', 'attrs'} & sys.modules.keys()))"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, check=False)

    assert done.stderr.strip() == b"set()"
