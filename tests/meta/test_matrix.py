"""The suite kills faulty models and spares different ones: a first selection.

`tox -e mutants` tries them all; these cover every group of requirements.
"""

from __future__ import annotations

import pytest

from node_model.faults import MUTANTS, VARIANTS
from tests.meta.matrix import Cell, blames, main, try_all

KILLED = (
    "boot-up-while-waiting",
    "waits-at-stored-rate",
    "takes-any-pdo",
    "second-request-changes-memory",
    "takes-id-sixteen",
    "refuses-id-fifteen",
    "takes-five-bytes",
    "echo-mean-too-slow",
    "stores-in-place",
    "code-five-is-twenty",
    "heartbeat-little-endian",
    "emcy-before-boot-up",
    "starts-operational",
    "ignores-stop-when-pre-operational",
    "obeys-one-byte",
    "heartbeat-too-fast",
    "heartbeat-mean-too-slow",
    "heartbeat-lost-every-seventh",
    "heartbeat-shows-old-state",
    "heartbeat-restarted-by-led-frame",
    "debounce-too-short",
    "debounce-too-long",
    "keys-debounced-together",
    "missed-changes-made-up-for",
    "key-frame-lost-every-fifth",
    "blink-clears-steady",
    "leds-in-stopped",
    "flood-restarts",
    "sends-unlisted-frame",
    "loses-keys-under-load",
)

SPARED = (
    "heartbeat-at-state-change",
    "heartbeat-jitters",
    "slow-boot",
    "keys-scanned",
    "key-changes-in-several-frames",
    "entry-starts-debounce",
    "echo-of-eight-bytes",
    "clock-slow",
)


@pytest.mark.slow
def test_faulty_models_are_killed_and_blamed() -> None:
    """Each of these faults is found by a test that claims a requirement which it violates."""
    cells = try_all([MUTANTS[name] for name in KILLED])
    assert [f"{cell.name}: {cell.text}" for cell in cells if not cell.good] == []


@pytest.mark.slow
def test_different_models_are_spared() -> None:
    """No test fails on any of these conforming but different devices."""
    cells = try_all([VARIANTS[name] for name in SPARED])
    assert [f"{cell.name}: {cell.text}" for cell in cells if not cell.good] == []


@pytest.mark.parametrize(
    ("claims", "row", "killed"),
    [
        (["HB-01"], {"requirement": "HB-01", "outcome": "failed"}, True),
        (["HB-01"], {"requirement": "HB-01", "outcome": "passed"}, False),
        (["HB-01"], {"requirement": "HB-02", "outcome": "failed"}, False),
        (["HB-02"], {"requirement": "HB-01", "outcome": "failed"}, False),
    ],
    ids=["blamed", "not-failed", "another-blamed", "not-claimed"],
)
def test_a_kill_needs_claim_and_blame(
    claims: list[str], row: dict[str, str], killed: bool
) -> None:
    """A mutant is killed by a test that claims the violated requirement and fails on it."""
    assert blames({"requirements": claims, "verdicts": [row]}, ("HB-01",)) is killed


def test_survivors_fail_the_matrix(capsys: pytest.CaptureFixture[str]) -> None:
    """One model that is not judged right makes the matrix fail, and is named."""
    cells = [Cell("right", True, "spared", 0.1), Cell("wrong", False, "survives", 0.1)]
    assert main([], lambda _: cells) == 1
    assert "BAD wrong" in capsys.readouterr().out
