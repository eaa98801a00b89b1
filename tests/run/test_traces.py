"""The record of a test says everything that it takes to judge it again."""

from __future__ import annotations

from pathlib import Path

import pytest

from hil_tests.reporting.pcapng import read_pcapng
from hil_tests.trace import Entry, Mark, Moment, Sighting
from tests.run.harness import Judged, judge

pytest_plugins = ["pytester"]

HEARD = """
@pytest.mark.requirement("HB-01", "NMT-02")
def test_heard(bench, leds, keys):
    bench.start(heartbeat_ms=100)
    bench.expect(matchers.heartbeat(bench.node_id), after=bench.nmt(Nmt.START), within=S)
    bench.needs_load([Frame(0x7FF, b"")], 100_000)
    leds.watch(100 * MS)
    bench.end_load()
    bench.needs_error_frames()
    bench.never(matchers.emcy(9), after=bench.now(), for_ns=150 * MS)
"""


def entries(run: Judged) -> list[Entry | Mark]:
    """Everything in the only record of a run."""
    (path,) = run.traces()
    return list(read_pcapng(path))


def moments(found: list[Entry | Mark]) -> list[Moment]:
    """What was done."""
    return [entry for entry in found if isinstance(entry, Moment)]


def test_stimuli_and_bench_actions_stand_in_the_record(pytester: pytest.Pytester) -> None:
    """From how the bench stood at the beginning to when it looked no more."""
    found = moments(entries(judge(pytester, HEARD)))
    verbs = ["begin", "renew", "power", "load", "lights", "unload", "disturb", "end"]
    assert [each.what for each in found] == verbs
    begin, renew, _, load, lights, *_, end = found
    assert begin.detail["test"] == "test_device.py::test_heard"
    assert begin.detail["requirements"] == ["HB-01", "NMT-02"]
    assert begin.detail["facilities"] == ["power", "keys", "leds", "bitrate"]
    assert begin.detail["virtual"] is True
    assert begin.detail["bit_rate"] == 250_000
    assert renew.detail["parameters"]["heartbeat_ms"] == 100  # type: ignore[index]
    assert load.detail == {"frames": ["7FF#"], "share_ppm": 100_000}
    assert lights.ended_at - lights.began_at == 100_000_000
    assert end.detail == {"outcome": "passed", "text": ""}
    assert end.began_at == lights.ended_at + 150_000_000


def test_expectations_and_verdicts_stand_in_the_record(pytester: pytest.Pytester) -> None:
    """Each in its place: a verdict after the frames that it is made from."""
    found = entries(judge(pytester, HEARD))
    marks = [entry for entry in found if isinstance(entry, Mark)]
    assert [(mark.data["kind"], mark.text.partition(" after")[0]) for mark in marks] == [
        ("expectation", "expects boot-up of node 1"),
        ("verdict", "NMT-02: boot-up of node 1"),
        ("expectation", "expects heartbeat of node 1"),
        ("verdict", "heartbeat of node 1"),
        ("expectation", "expects no EMCY of node 9"),
        ("verdict", "no EMCY of node 9 in 150 ms"),
    ]
    assert marks[1].data["limits_ns"] == [None, 1_000_000_000]
    boot = next(
        place for place, entry in enumerate(found)
        if isinstance(entry, Sighting) and entry.frame.can_id == 0x701
    )  # fmt: skip
    assert found.index(marks[0]) < boot < found.index(marks[1])


def test_of_a_property_that_passed_nothing_is_kept(pytester: pytest.Pytester) -> None:
    """But the counts."""
    run = judge(
        pytester,
        """
from hypothesis import given, strategies as st

@pytest.mark.requirement("HB-01")
@given(wait_ms=st.integers(0, 5000))
def test_property(bench, wait_ms):
    bench.begin_example()
    bench.start(heartbeat_ms=100)
    bench.wait(wait_ms * MS)
""",
    )
    assert run.traces() == []
    (row,) = run.results["results"]
    assert (row["outcome"], row["trace"]) == ("passed", None)
    assert row["frames"] > 100


def test_the_shrunk_example_of_a_property_is_kept_whole(pytester: pytest.Pytester) -> None:
    """Its own beginning, what was done, its verdicts, and its end; of the others the count."""
    run = judge(
        pytester,
        """
from hypothesis import given, strategies as st

@pytest.mark.requirement("HB-01")
@given(wait_ms=st.integers(0, 5000))
def test_property(bench, wait_ms):
    bench.begin_example()
    bench.start(heartbeat_ms=100)
    bench.wait(wait_ms * MS)
    bench.check(wait_ms < 1000, f"waits {wait_ms}")
""",
    )
    found = entries(run)
    verbs = [each.what for each in moments(found)]
    assert verbs == ["begin", "renew", "power", "end"]
    (mark,) = (entry for entry in found if isinstance(entry, Mark) and "waits" in entry.text)
    assert mark.text == "waits 1000"
    assert mark.data["outcome"] == "failed"
    (row,) = run.results["results"]
    frames = sum(isinstance(entry, Sighting) for entry in found)
    assert row["frames"] > frames > 10
    assert Path(row["trace"]).name.startswith("test_device-test_property-shrunk")
