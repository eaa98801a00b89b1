"""A run repeats with its seed: the same examples, the same bytes on the disk."""

from __future__ import annotations

import pytest

from hil_tests.reporting.pcapng import read_pcapng
from hil_tests.trace import Sighting
from tests.run.harness import Judged, judge

pytest_plugins = ["pytester"]

EXPLORES = """
from hypothesis import given, settings, strategies as st
seen = []

@pytest.mark.requirement("NMT-02")
@settings(max_examples=30)
@given(st.integers(0, 1 << 40))
def test_explores(bench, number):
    bench.begin_example()
    bench.start()
    seen.append(number)

@pytest.mark.requirement("NMT-02")
def test_tells(bench):
    bench.start()
    bench.characteristic("NMT-22", f"examples {seen}")
"""

FAILS = """
from hypothesis import given, strategies as st

@pytest.mark.requirement("NMT-02")
@given(st.integers(0, 1000))
def test_fails(bench, number):
    bench.begin_example()
    bench.start()
    for _ in range(number):
        bench.send(Frame(0x555))
    {check}
"""


def examples(run: Judged) -> str:
    """What Hypothesis tried."""
    verdicts = run.results["results"][1]["verdicts"]
    return next(str(row["what"]) for row in verdicts if row["requirement"] == "NMT-22")


@pytest.mark.slow
def test_the_same_seed_gives_the_same_examples(pytester: pytest.Pytester) -> None:
    """--can-seed decides what is explored, also in files that are not of this package."""
    first, same, other = (
        examples(judge(pytester, EXPLORES, f"--can-seed={n}")) for n in (5, 5, 6)
    )
    assert first == same
    assert first != other


def test_the_same_run_writes_the_same_bytes(pytester: pytest.Pytester) -> None:
    """In virtual time the record of a test is the same each time, byte for byte."""
    body = """
@pytest.mark.requirement("NMT-02")
def test_start(bench, keys):
    bench.operational()
    keys.press("aut")
    bench.wait(1 * S)
"""
    found = []
    for _ in range(2):
        run = judge(pytester, body)
        found.append([path.read_bytes() for path in run.traces()])
    assert len(found[0]) == 1
    assert found[0] == found[1]


def test_a_property_keeps_one_trace_of_its_shrunk_example(pytester: pytest.Pytester) -> None:
    """Many examples fail; the record is of the smallest, and the report tells its values."""
    run = judge(pytester, FAILS.format(check="bench.check(number < 3, 'too many')"))
    assert run.status == 1
    (trace,) = run.traces()
    assert "shrunk" in trace.name
    sent = [each for each in read_pcapng(trace) if isinstance(each, Sighting) and each.own]
    assert len(sent) == 3
    assert "number=3" in run.text
    assert "hil_tests.bench" not in run.text
    assert run.results["results"][0]["trace"] == f"traces/{trace.name}"


def test_a_property_that_fails_in_two_ways_tells_one_story(pytester: pytest.Pytester) -> None:
    """Two different failures are no error of the bench: the first is told, as a failure."""
    check = "bench.check(number < 3, 'too many')\n    assert number < 2"
    run = judge(pytester, FAILS.format(check=check))
    assert (run.status, run.outcomes) == (1, {"test_fails": "failed"})
    assert "ExceptionGroup" not in run.text


def test_a_property_that_passes_keeps_no_trace_but_counts(pytester: pytest.Pytester) -> None:
    """Frames and bus time of all examples are in the results."""
    run = judge(pytester, FAILS.format(check="").replace("1000", "3"))
    assert run.status == 0
    assert run.traces() == []
    assert run.results["results"][0]["frames"] > 4
    assert run.results["results"][0]["bus_ns"] > 4_000_000


def test_off_virtual_time_nothing_is_explored(pytester: pytest.Pytester) -> None:
    """On a real bench a property runs its written examples only."""
    body = """
from hypothesis import example, given, strategies as st
seen = []

@pytest.mark.requirement("NMT-02")
@example(7)
@given(st.integers(0, 1000))
def test_property(bench, number):
    bench.begin_example()
    seen.append(number)

@pytest.mark.requirement("NMT-02")
def test_after(bench):
    assert seen == [7]
"""
    options = ["--can-interface=virtual", "--can-iface=explore", "--can-device=external"]
    assert judge(pytester, body, *options).status == 0
