"""A run in real time is replayed as well: a hosted model, its lateness, waits that ended late."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from hil_tests.replay.record import load_record
from hil_tests.reporting.tally import pairs
from hil_tests.trace import Moment
from tests.host.test_process import free_channel
from tests.run.harness import Judged, judge_apart

pytestmark = pytest.mark.slow

TESTS = """
@pytest.mark.requirement("NMT-02", "HB-01")
def test_starts(bench, power, keys, leds):
    bench.start(heartbeat_ms=100)
    keys.hold("k3")
    bench.enter_operational()
    keys.sequence([(0, frozenset()), (20 * MS, frozenset(["k4"])), (40 * MS, frozenset())])
    leds.read()
    bench.wait(S)

@pytest.mark.requirement("NMT-04")
def test_stops(bench):
    bench.start({"heartbeat_ms": 100})
    bench.expect_state(State.STOPPED, after=bench.nmt(Nmt.STOP))

@pytest.mark.requirement("COM-05")
def test_commissions(bench, power, keys):
    bench.fresh(heartbeat_ms=200, debounce=2)
    bench.boot()
    bench.never(matchers.key_frame(bench.node_id), after=bench.now(), for_ns=300 * MS)
"""

KEPT_FROM_RUNNING = """
@pytest.mark.requirement("HB-01")
def test_reads_the_clock_late(bench):
    bench.start(heartbeat_ms=500)
    beat = matchers.heartbeat(bench.node_id)
    for _ in range(2):
        bench.expect(beat, after=bench.now(), within=600 * MS)
        sum(range(4_000_000))
        bench.expect(beat, after=bench.now(), within=490 * MS)
"""


def told(run: Judged) -> dict[str, dict[str, str]]:
    """What each test says of each requirement."""
    return {row["test"]: pairs(row) for row in run.results["results"]}


@pytest.mark.parametrize("mutant", ["", "ignores-stop"])
def test_a_hosted_run_says_the_same_again(mutant: str, tmp_path: Path) -> None:
    """Power, keys that the host plays by itself, LEDs, commissioning: all from the record."""
    options = ["--can-interface=udp_multicast", f"--can-iface={free_channel()}"]
    options += [f"--can-mutant={mutant}"] if mutant else []
    run = judge_apart(tmp_path, TESTS, *options)
    recorded = tmp_path / "recorded"
    shutil.copytree(run.folder, recorded)
    again = judge_apart(tmp_path, TESTS, f"--can-replay={recorded}")
    assert told(again) == told(run), run.text + again.text
    assert again.status == run.status == (1 if mutant else 0), run.text
    assert "every verdict is the recorded one" in again.section("replay")
    assert again.results["run"]["bus"]["timed"] is False

    moments = [
        entry
        for path in (recorded / "traces").iterdir()
        for entry in load_record(path).entries
        if isinstance(entry, Moment)
    ]
    assert {"power", "keys", "bitrate", "leds", "renew", "wait"} <= {each.what for each in moments}
    late = [each for each in moments if each.what == "late"]
    assert all(each.detail["pairs"] for each in late)


def test_a_test_that_was_kept_from_running_counts_from_when_it_ran(tmp_path: Path) -> None:
    """Of the time between two frames the record knows what the clock showed."""
    channel = free_channel()
    run = judge_apart(
        tmp_path, KEPT_FROM_RUNNING, "--can-interface=udp_multicast", f"--can-iface={channel}"
    )
    recorded = tmp_path / "recorded"
    shutil.copytree(run.folder, recorded)
    again = judge_apart(tmp_path, KEPT_FROM_RUNNING, f"--can-replay={recorded}")
    assert told(again) == told(run), run.text + again.text
    assert "every verdict is the recorded one" in again.section("replay")
