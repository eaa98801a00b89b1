"""The suite kills faulty models and spares different ones: a selection of each.

`tox -e mutants` tries them all; these cover every group of requirements.
"""

from __future__ import annotations

import json
import re
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest

from hil_tests.requirements import Kind, load
from node_model.faults import MUTANTS
from tests.meta.matrix import DOCS, keep_latest
from tests.meta.models import KINDS
from tests.meta.proof import Listed, Proof, blames, load_listed, problems, without_mutant
from tests.meta.proving import ROOT, Finding, Result, Trial

KILLED = (
    "boot-up-while-waiting",
    "waits-at-stored-rate",
    "takes-any-pdo",
    "commissions-with-any-two-keys",
    "second-request-changes-echo",
    "third-request-changes-memory",
    "takes-id-sixteen",
    "refuses-id-fifteen",
    "takes-five-bytes",
    "echo-mean-too-slow",
    "stores-in-place",
    "stores-slowly",
    "code-five-is-twenty",
    "heartbeat-swapped-without-low-byte",
    "emcy-before-boot-up",
    "starts-operational",
    "ignores-pre-operational-when-stopped",
    "third-reset-ignored",
    "obeys-one-byte",
    "heartbeat-too-fast",
    "heartbeat-mean-too-slow",
    "heartbeat-lost-every-thousandth",
    "heartbeat-late-at-wrap",
    "heartbeat-shows-old-state",
    "heartbeat-restarted-by-led-frame",
    "debounce-too-short",
    "debounce-too-long",
    "debounce-of-blank-is-one-step",
    "debounce-zero-is-one-step",
    "keys-debounced-together",
    "led-frame-drops-pending-key",
    "missed-changes-made-up-for",
    "key-frames-end-with-counter",
    "blink-clears-steady",
    "leds-in-stopped",
    "leds-on-after-reset",
    "flood-restarts",
    "sends-unlisted-frame",
    "loses-keys-under-load",
)

SPARED = (
    "heartbeat-at-state-change",
    "heartbeat-jitters",
    "heartbeat-slow-within-limits",
    "slow-boot",
    "slow-to-obey",
    "keys-scanned",
    "key-changes-in-several-frames",
    "entry-starts-debounce",
    "debounce-short-within-limits",
    "echo-with-byte-of-maker",
    "stores-just-in-time",
)


def matrix(folder: Path, *words: str) -> tuple[int, dict[str, Any]]:
    """Run the matrix as a command: its exit status and its table."""
    command = [sys.executable, "-m", "tests.meta.matrix", f"--reports={folder}", *words]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    tables = list(folder.glob("2*/matrix.json"))
    assert len(tables) == 1, done.stdout[-2000:] + done.stderr[-2000:]
    table: dict[str, Any] = json.loads(tables[0].read_text("utf-8"))
    return done.returncode, table


@pytest.mark.slow
def test_faulty_models_are_killed_and_different_ones_spared(tmp_path: Path) -> None:
    """Each fault is blamed on what it violates and on nothing else; no variant is harmed."""
    status, table = matrix(tmp_path, *KILLED, *SPARED)
    assert table["problems"] == []
    assert status == 0
    assert list(table["mutants"]) == list(KILLED)
    assert list(table["variants"]) == list(SPARED)


@pytest.mark.slow
def test_the_order_of_models_changes_nothing(tmp_path: Path) -> None:
    """In one process, without a fork between them, each model gets the same row in any order."""
    names = ("stores-in-place", "heartbeat-drifts", "keys-scanned", "flood-restarts")
    _, there = matrix(tmp_path / "there", "--workers=0", *names)
    _, back = matrix(tmp_path / "back", "--workers=0", *reversed(names))
    for part in ("mutants", "variants", "tests"):
        assert there[part].keys() == back[part].keys()
    assert all(there["mutants"][name] == back["mutants"][name] for name in there["mutants"])
    assert there["variants"] == back["variants"]


# What is wrong with a suite.

TESTS: Mapping[str, tuple[str, ...]] = {
    "test_a.py::test_beats": ("HB-01", "HB-04"),
    "test_a.py::test_states": ("HB-02",),
    "test_a.py::test_recorded": ("KEY-21",),
}
MUTANT = "heartbeat-too-slow"
NOTHING = Listed({}, {})


def trial(model: str, *failed: tuple[str, str]) -> Trial:
    """What came of a model: the tests that failed, and on which requirement."""
    results = [
        Result(test, "failed", "why", (Finding(requirement, "failed", "why"),))
        for test, requirement in failed
    ]
    return Trial(model, tuple(results))


def wrong(*trials: Trial, listed: Listed = NOTHING, whole: bool = False) -> list[str]:
    """The problems that these trials show."""
    proof = Proof(tests=dict(TESTS))
    for each in trials:
        proof.add(each)
    return list(problems(proof, listed, whole=whole))


@pytest.mark.parametrize(
    ("claims", "failed", "killed"),
    [
        (["HB-01"], ["HB-01"], True),
        (["HB-01", "HB-02"], ["HB-01"], True),
        (["HB-01"], [], False),
        (["HB-01"], ["HB-02"], False),
        (["HB-02"], ["HB-01"], False),
    ],
    ids=["blamed", "one-of-two-claims", "not-failed", "another-blamed", "not-claimed"],
)
def test_a_kill_needs_claim_and_blame(claims: list[str], failed: list[str], killed: bool) -> None:
    """A mutant is killed by a test that claims the violated requirement and fails on it."""
    assert blames(claims, failed, ("HB-01",)) is killed


def test_a_mutant_that_is_blamed_rightly_is_no_problem() -> None:
    """Parameters of a test do not matter."""
    assert wrong(trial(MUTANT, ("test_a.py::test_beats[10]", "HB-01"))) == []


def test_a_survivor_is_told() -> None:
    """A mutant that no test fails on."""
    (line,) = wrong(trial(MUTANT))
    assert line.startswith(f"survivor: {MUTANT} violates HB-01")


def test_a_false_blame_is_told_unless_it_has_a_reason() -> None:
    """A FAIL on a requirement that the mutant keeps; a reason that is not needed is told too."""
    false = trial(MUTANT, ("test_a.py::test_beats", "HB-01"), ("test_a.py::test_states", "HB-02"))
    (line,) = wrong(false)
    assert line.startswith(f"false blame: {MUTANT} does not violate HB-02; test_a.py::test_states")
    known = Listed({}, {MUTANT: {"HB-02": "because"}})
    assert wrong(false, listed=known) == []
    (line,) = wrong(trial(MUTANT, ("test_a.py::test_beats", "HB-01")), listed=known)
    assert line.startswith(f"stale reason: {MUTANT}")


def test_a_harmed_variant_is_told_unless_it_departs_from_the_reading() -> None:
    """The right keypad counts as a variant, too."""
    (line,) = wrong(trial("slow-boot", ("test_a.py::test_states", "HB-02")))
    assert line.startswith("harmed: slow-boot: test_a.py::test_states")
    (line,) = wrong(trial("", ("test_a.py::test_states", "HB-02")))
    assert line.startswith("harmed: the keypad itself")
    departs = trial("emcy-of-another-hardware-code", ("test_a.py::test_states", "NMT-20"))
    assert wrong(departs) == []


def test_a_model_that_breaks_the_run_is_told() -> None:
    """A process that ended, and a test that crashed on what a device did."""
    (broken, survivor) = wrong(Trial(MUTANT, (), "did not end"))
    assert broken == f"broken: {MUTANT}: did not end"
    assert survivor.startswith("survivor")
    crashed = Trial("slow-boot", (Result("test_a.py::test_beats", "error", "TypeError()", ()),))
    assert any(line.startswith("broken: slow-boot") for line in wrong(crashed))


def test_an_idle_test_is_told_unless_it_has_a_reason() -> None:
    """A test that kills nothing, but not one that only records what is left to the maker."""
    killed = trial(MUTANT, ("test_a.py::test_beats", "HB-01"))
    (line,) = wrong(killed, whole=True)
    assert line == "idle: test_a.py::test_states kills no mutant"
    assert wrong(killed, listed=Listed({"test_a.py::test_states": "r"}, {}), whole=True) == []
    stale = Listed({"test_a.py::test_states": "r", "test_a.py::test_beats": "r"}, {})
    (line,) = wrong(killed, listed=stale, whole=True)
    assert line == "stale reason: test_a.py::test_beats is not idle"


# What needs no run.


@pytest.mark.parametrize("kind", KINDS)
def test_every_judged_requirement_has_a_mutant(kind: str) -> None:
    """Only what is left to the maker has none."""
    assert without_mutant(KINDS[kind]) == []


@pytest.mark.parametrize("kind", KINDS)
def test_every_reason_is_for_a_model_and_a_requirement_that_there_are(kind: str) -> None:
    """The list of reasons names mutants and requirements, each with a sentence."""
    listed = load_listed(KINDS[kind].reasons)
    requirements, mutants = load(kind), KINDS[kind].mutants
    for mutant, known in listed.collateral.items():
        assert mutant in mutants
        for requirement, reason in known.items():
            assert requirement in requirements
            assert requirement not in mutants[mutant].violates
            assert reason.endswith(".")
    assert all(reason.endswith(".") for reason in listed.idle.values())


def test_who_departs_from_a_reading_of_ours_alone_never_fails() -> None:
    """Without --can-strict such a board is told so, and no more: nothing else may be listed."""
    kinds = {name: each.kind for name, each in load("keypad").items()}
    readings = {name for name, kind in kinds.items() if kind is Kind.DERIVED}
    apart = [each for each in MUTANTS.values() if set(each.violates) <= readings]
    assert len(apart) >= 20
    collateral = load_listed(KINDS["keypad"].reasons).collateral
    assert {name for each in apart for name in collateral.get(each.name, ())} <= readings


def rows(kind: str, section: str) -> list[list[str]]:
    """The cells of the table rows below a heading of a page, whatever stands deeper."""
    text = DOCS[kind].read_text("utf-8")
    parts = re.split(r"^## ", text, flags=re.MULTILINE)[1:]
    (found,) = [each for each in parts if each.partition("\n")[0].endswith(section)]
    lines = [line for line in found.splitlines() if line.startswith("| `")]
    return [[cell.strip() for cell in line.strip("|").split(" | ")] for line in lines]


PAGES = ("keypad", "drive")
"""Kinds whose page is written."""


@pytest.mark.parametrize("kind", PAGES)
def test_the_page_lists_every_mutant_with_its_fault_and_what_it_violates(kind: str) -> None:
    """docs/mutants*.md are as the registry is; `python -m tests.meta.matrix --write-docs`."""
    listed = [(cells[0].strip("`"), cells[1]) for cells in rows(kind, "they violate")]
    mutants = KINDS[kind].mutants.values()
    assert sorted(set(listed)) == sorted((m.name, m.text) for m in mutants)
    assert len(listed) == sum(len(m.violates) for m in mutants)


@pytest.mark.parametrize("kind", PAGES)
def test_the_page_lists_every_variant_and_what_allows_it(kind: str) -> None:
    """The other half of the registry."""
    listed = [(cells[0].strip("`"), cells[1], cells[2]) for cells in rows(kind, "variants")]
    variants = KINDS[kind].variants.values()
    assert listed == [(v.name, v.text, v.allowed_by) for v in variants]


def test_the_last_whole_table_of_each_kind_is_kept(tmp_path: Path) -> None:
    """A run of one kind replaces its models, and leaves those of the other."""

    def table(kind: str, *names: str) -> dict[str, Any]:
        models = {name: {"kind": kind} for name in names}
        return {"mutants": models, "variants": {kind: {"kind": kind}}, "tests": {}}

    path = tmp_path / "matrix.json"
    keep_latest(path, table("keypad", "a", "b"))
    keep_latest(path, table("drive", "c"))
    keep_latest(path, table("keypad", "a"))
    kept = json.loads(path.read_text("utf-8"))
    assert sorted(kept["mutants"]) == ["a", "c"]
    assert sorted(kept["variants"]) == ["drive", "keypad"]
