"""A recorded run goes through the same tests: the same verdicts, or a word on what differs."""

from __future__ import annotations

import json
import re
import shutil
from pathlib import Path

import pytest

from hil_tests.replay.record import load_record
from hil_tests.reporting.tally import pairs
from tests.run.harness import Judged, judge

pytest_plugins = ["pytester"]

TESTS = """
from hypothesis import example, given, strategies as st

@pytest.mark.requirement("NMT-02", "HB-01")
def test_starts(bench, power, keys, leds):
    bench.start(heartbeat_ms=100)
    keys.hold("k3")
    leds.read()
    bench.enter_operational()
    keys.release()
    bench.wait(2 * S)

@pytest.mark.requirement("NMT-04")
def test_stops(bench):
    bench.start({"heartbeat_ms": 100})
    bench.expect_state(State.STOPPED, after=bench.nmt(Nmt.STOP))

@pytest.mark.requirement("ROB-02")
def test_not_run(bench):
    bench.start()
    raise NotRun("no such thing here")

@pytest.mark.requirement("HB-01")
@given(st.integers(0, 10))
def test_property(bench, beats):
    bench.begin_example()
    bench.start(heartbeat_ms=100)
    bench.wait(beats * 100 * MS)
    bench.check_monitors()
"""


def replay(pytester: pytest.Pytester, run: Judged, *options: str) -> Judged:
    """The run once more, from its record; the first one stays where it is."""
    recorded = pytester.path / "recorded"
    shutil.copytree(run.folder, recorded)
    return judge(pytester, TESTS, f"--can-replay={recorded}", *options)


def told(run: Judged) -> dict[str, dict[str, str]]:
    """What each test says of each requirement."""
    return {row["test"]: pairs(row) for row in run.results["results"]}


def test_the_latest_run_is_the_one_before(pytester: pytest.Pytester) -> None:
    """`reports/latest` is the run that is replayed; the replay takes the name over."""
    run = judge(pytester, TESTS)
    latest = run.folder.parent / "latest"
    assert latest.resolve() == run.folder.resolve()
    again = judge(pytester, TESTS, f"--can-replay={latest}")
    assert told(again) == told(run)
    assert again.folder.resolve() == latest.resolve() != run.folder.resolve()


@pytest.mark.parametrize(
    "mutant",
    ["", "heartbeat-too-slow", "boot-up-missing", "ignores-stop", "heartbeat-shows-old-state"],
)
def test_the_same_tests_say_the_same_again(mutant: str, pytester: pytest.Pytester) -> None:
    """Of a right keypad, and of faulty ones: each requirement in each test."""
    run = judge(pytester, TESTS, *([f"--can-mutant={mutant}"] if mutant else []))
    again = replay(pytester, run)
    assert told(again) == told(run)
    assert again.status == run.status == (1 if mutant else 0)
    assert again.section("replay").rstrip().endswith("every verdict is the recorded one")
    assert "REPLAY of 4 recorded tests" in again.text


def test_frames_stimuli_and_verdicts_are_the_recorded_ones(pytester: pytest.Pytester) -> None:
    """A replay writes the same record again, so that it can be replayed in its turn."""
    run = judge(pytester, TESTS)
    again = replay(pytester, run)
    for path in (pytester.path / "recorded" / "traces").iterdir():
        assert (again.folder / "traces" / path.name).read_bytes() == path.read_bytes()


def test_a_property_is_counted_as_recorded(pytester: pytest.Pytester) -> None:
    """One that passed has no record; the replay says so, and runs none of its examples."""
    again = replay(pytester, judge(pytester, TESTS))
    assert again.outcomes["test_property"] == "passed"
    assert "1 tests are counted as recorded" in again.section("replay")
    assert not [path for path in again.traces() if "property" in path.name]


def test_the_failing_example_of_a_property_is_replayed(pytester: pytest.Pytester) -> None:
    """That one alone, from its own record."""
    run = judge(pytester, TESTS, "--can-mutant=heartbeat-too-slow")
    again = replay(pytester, run)
    assert "counted as recorded" not in again.section("replay")
    assert told(again) == told(run)
    then, now = [
        load_record(next(path for path in each.traces() if "shrunk" in path.name))
        for each in (run, again)
    ]
    assert (now.opening, now.entries, now.marks) == (then.opening, then.entries, then.marks)
    assert then.end is not None
    assert now.end is not None
    assert now.end.detail["example"] == then.end.detail["example"]
    assert "@reproduce_failure" not in run.text


def test_current_limits_apply_and_what_differs_is_told(pytester: pytest.Pytester) -> None:
    """A narrower limit fails what passed; the line names test, requirement, both verdicts."""
    run = judge(pytester, TESTS)
    source = Path(run.results["run"]["device"]["profile"]["path"]).read_text()
    assert "boot_up = " in source
    tight = pytester.path / "tight.toml"
    lines = [
        'boot_up = "1 ms"' if line.startswith("boot_up = ") else line
        for line in source.splitlines()
    ]
    tight.write_text("\n".join(lines))
    again = replay(pytester, run, f"--can-profile={tight}")
    assert again.status == 1
    section = again.section("replay")
    assert "verdicts differ:" in section
    assert "::test_starts: NMT-02 was passed, is failed now: NMT-02: boot-up of node 1" in section


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (('keys.hold("k3")', 'keys.hold("k4")'), "it holds keys: k4; .* has keys held: k3"),
        (("bench.nmt(Nmt.STOP)", "bench.nmt(Nmt.START)"), "the record has 000#0201 sent by"),
        (("bench.wait(2 * S)", "bench.wait(3 * S)"), "waits on for 1 s; .* the record ends"),
        (("leds.read()", "power.off()"), "it switches power off; .* has LEDs read"),
        (("heartbeat_ms=100)\n    keys", "heartbeat_ms=200)\n    keys"), "has a fresh device"),
    ],
)
def test_another_stimulus_ends_the_test_with_a_word(
    change: tuple[str, str], said: str, pytester: pytest.Pytester
) -> None:
    """What was asked and what the record has; no verdict rests on it, and the others go on."""
    run = judge(pytester, TESTS)
    recorded = pytester.path / "recorded"
    shutil.copytree(run.folder, recorded)
    assert TESTS.count(change[0]) == 1
    again = judge(pytester, TESTS.replace(*change), f"--can-replay={recorded}")
    odd = [row for row in again.results["results"] if row["outcome"] == "not run"]
    assert len(odd) == 2  # one of them was not run when it was recorded
    assert sum(row["outcome"] == "passed" for row in again.results["results"]) == 2
    assert any(re.search(said, row["text"]) for row in odd), odd


def test_a_trace_alone_is_enough(pytester: pytest.Pytester) -> None:
    """It says which test it is of, on which bench, and what came of it."""
    run = judge(pytester, TESTS, "--can-mutant=ignores-stop")
    trace = next(path for path in run.traces() if "test_stops" in path.name)
    copy = pytester.path / "one.pcapng"
    shutil.copy(trace, copy)
    again = judge(pytester, TESTS, f"--can-replay={copy}")
    assert again.outcomes == {"test_stops": "failed"}
    assert "every verdict is the recorded one" in again.section("replay")


def test_the_test_in_which_a_run_was_killed_is_judged_as_far_as_it_came(
    pytester: pytest.Pytester,
) -> None:
    """What its record shows until it breaks off; there is no verdict to differ from."""
    run = judge(pytester, TESTS)
    recorded = pytester.path / "recorded"
    shutil.copytree(run.folder, recorded)
    results = json.loads((recorded / "results.json").read_text())
    last = results["results"].pop(1)
    results["under_way"] = {"test": last["test"], "trace": last["trace"]}
    (recorded / "results.json").write_text(json.dumps(results))
    trace = recorded / last["trace"]
    trace.write_bytes(trace.read_bytes()[: trace.stat().st_size // 2])
    again = judge(pytester, TESTS, f"--can-replay={recorded}")
    assert again.outcomes["test_stops"] == "not run"
    (row,) = (row for row in again.results["results"] if row["test"] == last["test"])
    assert "the record breaks off" in row["text"]


def test_a_test_that_is_gone_is_told(pytester: pytest.Pytester) -> None:
    """Its verdicts are the recorded ones and nobody's now."""
    run = judge(pytester, TESTS)
    recorded = pytester.path / "recorded"
    shutil.copytree(run.folder, recorded)
    again = judge(pytester, TESTS.replace("test_stops", "test_halts"), f"--can-replay={recorded}")
    assert "::test_stops: was recorded, and there is no such test now" in again.section("replay")
    assert "test_halts" not in again.outcomes


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--can-replay=none"], "--can-replay: recording none: No such file"),
        (["--can-replay=."], "results.json"),
        (["--can-replay=test_device.py"], "no section header"),
        (["--can-replay=x", "--can-iface=vcan0"], "leave out --can-iface"),
    ],
)
def test_what_is_no_recording_is_wrong_use(
    options: list[str], said: str, pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Told before anything is run, with the file and the reason."""
    monkeypatch.chdir(pytester.path)
    run = judge(pytester, TESTS, *options)
    assert run.status == 4
    assert said in run.text
