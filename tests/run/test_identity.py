"""What results.json says of a run before its first test: who, on what, with which files."""

from __future__ import annotations

import hashlib
import importlib
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest

from hil_tests.reporting.check import check_run
from hil_tests.reporting.schema import results_schema
from hil_tests.run.checkout import git_state
from hil_tests.run.header import sha256_of
from hil_tests.run.identity import identity_of
from tests.drivers.peers import answer, scripted
from tests.host.test_process import free_channel
from tests.run.harness import ROOT, Judged, judge, judge_apart
from tests.run.test_broken_bench import desk

pytest_plugins = ["pytester"]

STARTS = """
@pytest.mark.requirement("NMT-02")
def test_starts(bench):
    '''It starts.'''
    bench.start()
"""


def validated(run: Judged) -> dict[str, Any]:
    """Facts of a run whose results a validator of others accepts, and ours."""
    validator = importlib.import_module("jsonschema").Draft202012Validator(results_schema())
    assert [error.message for error in validator.iter_errors(run.results)] == []
    assert check_run(run.folder) == []
    return dict(run.results["run"])


def test_a_run_in_virtual_time_says_who_was_tested(pytester: pytest.Pytester) -> None:
    """Profile and its sum, serial number, firmware, mutant, seed, bench, clock, requirements."""
    options = ["--can-serial=A-7", "--can-firmware=1.2", "--can-seed=5"]
    told = validated(judge(pytester, STARTS, *options, "--can-mutant=emcy-late"))
    device, profile = told["device"], ROOT / "node_model" / "profiles" / "keypad.toml"
    assert device["profile"]["sha256"] == hashlib.sha256(profile.read_bytes()).hexdigest()
    assert (device["serial"], device["firmware"], device["mutant"]) == ("A-7", "1.2", "emcy-late")
    assert (device["kind"], device["node_id"], device["eds"]) == ("virtual", 1, None)
    assert told["clock"]["doubt_ns"] == 0
    assert told["bench"]["drivers"]["power"] == "the model's own"
    assert told["requirements"]["HB-01"]["class"] == "timing"
    assert (told["seed"], told["git"]) == (5, None)


def test_a_bench_file_is_named_with_its_sum_and_drivers(
    pytester: pytest.Pytester, tmp_path: Path
) -> None:
    """What works each facility, and the file that says so, as it was then."""
    with scripted(tmp_path, [answer(power=True), answer(), answer()], can=["power"]) as address:
        option = desk(pytester.path, "named", address)
        told = validated(judge(pytester, STARTS, option))
    bench, path = told["bench"], Path(option.partition("=")[2])
    assert bench["drivers"] == {"power": "control"}
    assert bench["file"]["sha256"] == hashlib.sha256(path.read_bytes()).hexdigest()
    assert told["device"]["kind"] == "external"


@pytest.mark.slow
def test_a_run_on_a_hosted_model_is_valid(tmp_path: Path) -> None:
    """In real time, on a wire without bit times: no bus load, a clock with doubt."""
    options = ["--can-interface=udp_multicast", f"--can-iface={free_channel()}"]
    run = judge_apart(tmp_path, STARTS, *options)
    told = validated(run)
    assert told["device"]["kind"] == "model"
    assert told["bus"]["timed"] is False
    assert run.results["totals"]["bus_load"] is None
    assert run.results["state"] == "complete"


def test_bus_load_is_the_share_of_the_time_that_frames_take(pytester: pytest.Pytester) -> None:
    """A hundred frames of 8 bytes at 250 kbit/s: about 46 ms."""
    body = """
    @pytest.mark.requirement("NMT-02")
    def test_loads(bench):
        bench.start()
        for _ in range(100):
            bench.send(Frame(0x555, bytes([0x55] * 8)))
            bench.wait(10_000_000)
    """
    results = judge(pytester, body.replace("\n    ", "\n")).results
    (row,) = results["results"]
    assert row["outcome"] == "passed", row
    assert 45_000_000 < row["busy_ns"] < 52_000_000
    assert results["totals"]["bus_load"] == round(row["busy_ns"] / row["bus_ns"], 6)
    assert (row["error_frames"], row["losses"], row["lost"]) == (0, 0, 0)


def git(folder: Path, *words: str) -> None:
    """Run git without anybody's settings."""
    who = ["-c", "user.name=x", "-c", "user.email=x@example.org"]
    subprocess.run(["git", "-C", str(folder), *who, *words], check=True, capture_output=True)


@pytest.mark.skipif(not shutil.which("git"), reason="git is not installed")
def test_the_state_in_git_is_that_of_the_folder(tmp_path: Path) -> None:
    """Commit, and whether files differ from it; nothing outside a checkout."""
    assert git_state(tmp_path) is None
    assert git_state(tmp_path / "nowhere") is None
    git(tmp_path, "init", "-q")
    assert git_state(tmp_path) is None  # no commit yet
    (tmp_path / "a").write_text("a")
    git(tmp_path, "add", "a")
    git(tmp_path, "commit", "-qm", "a")
    clean = git_state(tmp_path)
    assert clean is not None
    assert len(str(clean["commit"])) == 40
    assert clean["dirty"] is False
    (tmp_path / "a").write_text("b")
    assert git_state(tmp_path) == {**clean, "dirty": True}


def test_a_data_sheet_names_the_device(tmp_path: Path) -> None:
    """Vendor, product and revision; a file that cannot be read says nothing."""
    sheets = sorted((ROOT / "node_model" / "profiles").glob("*.eds"))
    told = identity_of(str(sheets[0]))
    assert told["product_name"]
    assert isinstance(told["vendor"], int)
    assert identity_of(str(tmp_path / "none.eds")) == {}
    assert sha256_of(tmp_path / "none.eds") is None
