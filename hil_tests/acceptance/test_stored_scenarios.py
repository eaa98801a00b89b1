"""Scenarios that are known to show a fault: on a real bench they stand for exploration."""

from __future__ import annotations

import pytest

from hil_tests.api import KeypadBench
from hil_tests.scenarios.corpus import Stored
from hil_tests.scenarios.play import judge


@pytest.mark.requirement("ROB-01", "ROB-02")
def test_stored_scenario(bench: KeypadBench, stored: Stored) -> None:
    """What once showed a fault shows none on this device; each claims what it is about."""
    judge(bench, stored.scenario, *stored.claims)
