"""Scenarios that are known to show a fault: on a real bench they stand for exploration."""

from __future__ import annotations

from hil_tests.api import Bench
from hil_tests.scenarios.corpus import Stored
from hil_tests.scenarios.play import judge


def test_stored_scenario(bench: Bench, stored: Stored) -> None:
    """What once showed a fault shows none on this device."""
    judge(bench, stored.scenario, *stored.claims)
