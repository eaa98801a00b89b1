"""A tester that is late itself holds nothing against the device."""

from __future__ import annotations

import pytest

from tests.run.harness import judge

pytest_plugins = ["pytester"]

pytestmark = pytest.mark.slow

FEEDS = """
from hil_tests.acceptance.cia301 import guarding_steps, test_consumer
from hil_tests.api import Sheet

@pytest.mark.requirement("C-HBC-06")
def test_feeds(bench, sdo, sheet):
    other = test_consumer.watching(bench, sdo, sheet)

    def feed():
        bench.wait({late_ms} * MS)
        return test_consumer.beat(bench, other)

    guarding_steps.expect_none_while_fed(bench, feed, 5, 190 * MS, 200 * MS, "C-HBC-06")
"""


@pytest.mark.parametrize(
    ("late_ms", "mutant", "outcome"),
    [
        (0, "", "passed"),
        (3, "", "passed"),
        (12, "", "inconclusive"),
        (0, "consumer-too-strict", "failed"),
    ],
)
def test_a_tester_that_is_late_blames_nobody(
    late_ms: int, mutant: str, outcome: str, pytester: pytest.Pytester
) -> None:
    """Of an event that it brought about itself; one that comes without cause is told."""
    options = ["--can-profile=drive", *([f"--can-mutant={mutant}"] if mutant else [])]
    run = judge(pytester, FEEDS.format(late_ms=late_ms), *options)
    assert run.outcomes == {"test_feeds": outcome}, run.text
