"""Who may choose: command line, environment, ini file, bench file; and values that are none."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from hil_tests.run import session
from hil_tests.run.options import OPTIONS, respelled
from tests.run.harness import ROOT, judge

pytest_plugins = ["pytester"]

PROFILES = ROOT / "node_model" / "profiles"

BODY = """
@pytest.mark.requirement("NMT-02")
def test_start(bench):
    print("node", bench.node_id)
    bench.start()
"""


def ini(pytester: pytest.Pytester, **settings: object) -> None:
    """Write the project's ini file."""
    lines = [f"{key} = {value}" for key, value in settings.items()]
    pytester.makeini("\n".join(["[pytest]", *lines]))


@pytest.mark.parametrize(
    ("sources", "node_id", "origin"),
    [
        (("command line", "environment", "ini"), 3, "command line"),
        (("environment", "ini"), 4, "environment"),
        (("ini",), 5, "ini"),
        ((), 1, ""),
    ],
)
def test_the_command_line_wins_then_the_environment_then_the_ini_file(
    pytester: pytest.Pytester,
    monkeypatch: pytest.MonkeyPatch,
    sources: tuple[str, ...],
    node_id: int,
    origin: str,
) -> None:
    """Each source yields to the one before it, and the header says which one won."""
    if "ini" in sources:
        ini(pytester, can_node_id=5)
    if "environment" in sources:
        monkeypatch.setenv("NODEPROOF_CAN_NODE_ID", "4")
    run = judge(pytester, BODY, *(["--can-node-id=3"] if "command line" in sources else []))
    assert f"commissioned to: node id {node_id}," in run.text
    assert ("can-node-id" in run.text) == bool(origin)
    assert f"can-node-id {node_id} ({origin})" in run.text or not origin
    chosen = run.results["run"]["options"]["can_node_id"]
    assert chosen["source"] == (origin or "default")


@pytest.mark.slow
def test_a_bench_file_yields_to_all_others(pytester: pytest.Pytester) -> None:
    """What the bench file says counts where nobody else says anything."""
    file = pytester.path / "desk.toml"
    file.write_text('[bus]\ninterface = "no-such"\nchannel = "desk"\n', "utf-8")
    only_file = judge(pytester, BODY, f"--can-bench={file}")
    assert "python-can has no interface type 'no-such'" in only_file.text
    assert only_file.status == 11
    ini(pytester, can_interface="virtual", can_device="external")
    with_ini = judge(pytester, BODY, f"--can-bench={file}")
    assert "bus: desk (virtual)" in with_ini.text


@pytest.mark.parametrize("word", ["1", "yes", "On", " TRUE "])
def test_switches_are_set_by_words(
    pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch, word: str
) -> None:
    """The environment says yes in the usual words."""
    monkeypatch.setenv("NODEPROOF_CAN_STRICT", word)
    assert "can-strict True (environment)" in judge(pytester, BODY).text


def test_lists_of_the_environment_are_split_at_blanks(
    pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Several clauses fit into one variable."""
    monkeypatch.setenv("NODEPROOF_CAN_CLAUSE", "HB NMT")
    assert judge(pytester, BODY).outcomes == {"test_start": "passed"}


def test_the_header_tells_device_seed_bench_and_place(pytester: pytest.Pytester) -> None:
    """Before the first test it is said what is tested, on which bus and clock, and where to."""
    run = judge(pytester, BODY, "--can-seed=17")
    for line in (
        "device: bundled model in virtual time, profile keypad (no --can-iface given)",
        "seed: 17   bench: virtual",
        "bus: virtual bus, 250000 bit/s, timed wire",
        "clock: virtual time, exact",
        "commissioned to: node id 1, 250000 bit/s, heartbeat 1000 ms, debounce 100 ms",
        f"written to: {run.reports}/",
    ):
        assert line in run.text


def test_a_real_bench_draws_other_values_each_day(pytester: pytest.Pytester) -> None:
    """Where no seed is given it is the date; one that is given counts. Tests draw from it."""
    body = """
@pytest.mark.requirement("NMT-02")
def test_draws(bench, chance):
    bench.characteristic("NMT-22", f"seed {chance.seed}")
"""
    real = ["--can-interface=virtual", "--can-iface=draw", "--can-device=external"]
    seeds = []
    for options in ([], real, [*real, "--can-seed=7"]):
        run = judge(pytester, body, *options)
        seeds.append(run.results["run"]["seed"])
        assert f"seed {seeds[-1]}" in run.results["results"][0]["verdicts"][0]["what"]
        assert f"seed: {seeds[-1]}   bench" in run.text
    assert seeds[0] == 0
    assert re.fullmatch(r"20\d\d[01]\d[0-3]\d", str(seeds[1]))
    assert seeds[2] == 7


def test_a_mutant_is_announced(pytester: pytest.Pytester) -> None:
    """Nobody takes a run against a faulty model for a real one."""
    run = judge(pytester, BODY, "--can-mutant=boot-up-missing")
    assert "MUTANT: boot-up-missing" in run.text
    assert run.status == 1


def test_the_list_of_mutants_runs_nothing(pytester: pytest.Pytester) -> None:
    """--can-mutant list prints every model with the requirements it violates, and ends well."""
    run = judge(pytester, BODY, "--can-mutant=list")
    assert "boot-up-missing " in run.text
    assert "conforming models of a keypad that are different" in run.text
    assert "faulty models of a drive" in run.text
    assert run.status == 0
    assert not run.reports.exists()


@pytest.mark.parametrize(
    ("variables", "hints"),
    [
        ({"CAN_SEED": "abc"}, ["NODEPROOF_CAN_SEED = 'abc': write a whole number"]),
        ({"CAN_STRICT": "maybe"}, ["NODEPROOF_CAN_STRICT = 'maybe': write yes or no"]),
        ({"CAN_DEVICE": "toaster"}, ["CAN_DEVICE = 'toaster': choose from model, external"]),
        ({"CAN_NODE_ID": "400"}, ["400 (from environment): out of range; allowed 1 .. 127"]),
        ({"CAN_SEED": "x", "CAN_BITRATE": "y"}, ["NODEPROOF_CAN_SEED", "NODEPROOF_CAN_BITRATE"]),
    ],
)
def test_wrong_values_of_the_environment(
    pytester: pytest.Pytester,
    monkeypatch: pytest.MonkeyPatch,
    variables: dict[str, str],
    hints: list[str],
) -> None:
    """All of them are told at once, each with its variable and what to write."""
    for name, text in variables.items():
        monkeypatch.setenv(f"NODEPROOF_{name}", text)
    run = judge(pytester, BODY)
    assert run.status == 4
    assert all(hint in run.text for hint in hints), run.text
    assert not run.reports.exists()


def test_wrong_values_of_the_ini_file(pytester: pytest.Pytester) -> None:
    """An ini value that is none is told with its name."""
    ini(pytester, can_seed="many")
    run = judge(pytester, BODY)
    assert "ini setting can_seed = 'many': write a whole number" in run.text
    assert run.status == 4


def test_every_option_has_its_prefix_and_its_own_place() -> None:
    """No option of ours can collide with one of another plugin."""
    assert all(option.name.startswith("can-") for option in OPTIONS)
    assert all(option.dest.startswith("nodeproof_can_") for option in OPTIONS)
    assert len({option.dest for option in OPTIONS}) == len(OPTIONS)


@pytest.mark.parametrize(
    ("command", "kept"),
    [
        ([], ["--can-seed=7"]),
        (["-q", "--can-strict", "tests"], ["--can-strict", "--can-seed=7"]),
        (["--can-profile", "my kind.toml"], ["'--can-profile=my kind.toml'", "--can-seed=7"]),
        (["--can-seed", "3", "--can-iface=vcan0"], ["--can-iface=vcan0", "--can-seed=7"]),
        (["--can-seed=3", "--can-clause"], ["--can-clause=", "--can-seed=7"]),
    ],
)
def test_repeating_keeps_our_options_each_in_one_word(command: list[str], kept: list[str]) -> None:
    """A path behind an option would be taken for a place of tests, so it is joined to it."""
    assert session.own_options(command, "--can-seed=7") == kept


@pytest.mark.parametrize(
    ("words", "respelt"),
    [
        (["--can-bench", "there.toml", "-q"], ["--can-bench=there.toml", "-q"]),
        (["--can-iface", "vcan0", "--can-bench", "there.toml"],
         ["--can-iface=vcan0", "--can-bench=there.toml"]),
        (["--can-bench=there.toml", "--can-iface", "vcan0"], None),
        (["--can-bench", "missing.toml"], None),
        (["--can-strict", "there.toml"], None),
        (["--can-bench"], None),
        (["--can-seed", "\0"], None),
    ],
)  # fmt: skip
def test_a_file_behind_an_option_is_no_place_of_tests(
    tmp_path: Path, words: list[str], respelt: list[str] | None
) -> None:
    """Where the value of an option is a path, the command line is spelled so that none can err."""
    (tmp_path / "there.toml").touch()
    assert respelled(words, tmp_path) == respelt


def test_a_profile_elsewhere_leads_nobody_away_from_the_tests(
    pytester: pytest.Pytester, tmp_path_factory: pytest.TempPathFactory
) -> None:
    """A profile of another folder, behind a space, leaves tests and ini file those of this one."""
    elsewhere = tmp_path_factory.mktemp("elsewhere") / "board.toml"
    elsewhere.write_text((PROFILES / "keypad.toml").read_text("utf-8"), "utf-8")
    ini(pytester, can_node_id=5)
    run = judge(pytester, BODY, "--can-profile", str(elsewhere))
    assert "commissioned to: node id 5," in run.text
    assert run.status == 0


def test_the_sheet_of_the_command_line_makes_the_model(pytester: pytest.Pytester) -> None:
    """--can-eds says which device the generic model is."""
    body = """
@pytest.mark.requirement("C-NMT-01")
def test_start(bench):
    bench.start()
"""
    sheet = f"--can-eds={PROFILES / 'drive.eds'}"
    run = judge(pytester, body, "--can-profile=generic", sheet, "--can-node-id=9")
    assert run.status == 0, run.text
