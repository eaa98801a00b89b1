"""Playing on models without pytest, and exploring as one of several workers."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from hil_tests.errors import ConfigError
from hil_tests.explore import soak
from hil_tests.explore.lab import Lab
from hil_tests.explore.soak import Found, Message, Progress, Soak, explored
from hil_tests.explore.walks import walk
from hil_tests.scenarios.scenario import scenario

FAULT = "operational: 60ms keys 1; 200ms wait"


def test_a_finding_has_what_is_certainly_wrong() -> None:
    """The first first; a right model has none."""
    finding = Lab(model="debounce-too-short").play(scenario(FAULT))
    assert finding is not None
    assert finding.scenario == scenario(FAULT)
    assert finding.verdicts[0].requirement == "KEY-05"
    assert finding.requirements == {"KEY-05"}
    assert Lab().play(scenario(FAULT)) is None


def test_every_scenario_is_played_on_a_fresh_device() -> None:
    """Nothing of the one before is left: neither keys, nor parameters, nor findings."""
    lab = Lab(model="debounce-too-short")
    quiet = scenario("operational: 60ms wait")
    outcomes = [lab.play(each) is not None for each in (scenario(FAULT), quiet, scenario(FAULT))]
    assert outcomes == [True, False, True]
    assert lab.played == 3


def test_models_and_profiles_that_are_none(tmp_path: Path) -> None:
    """The near misses are named, and a file that is none."""
    with pytest.raises(ConfigError, match="did you mean debounce-too-short"):
        Lab(model="debounce-to-short")
    with pytest.raises(ConfigError, match="no-such"):
        Lab("no-such")
    with pytest.raises(ConfigError, match=r"missing\.toml"):
        Lab(str(tmp_path / "missing.toml"))


def counting(count: int) -> Callable[[], bool]:
    """True so many times."""
    left = iter([True] * count)
    return lambda: next(left, False)


def job(model: str | None = None, jobs: int = 1, *families: str) -> Soak:
    """What to explore; the time is up to the caller."""
    return Soak("keypad", model, seed=4, seconds=0, jobs=jobs, families=families)


def told(soak_: Soak, worker: int, count: int) -> list[Message]:
    """Everything that a worker says."""
    return list(explored(Lab(soak_.profile, soak_.model), soak_, worker, counting(count)))


def test_a_worker_tells_how_far_it_is() -> None:
    """After each scenario, with growing figures; None at its end."""
    messages = told(job(), 0, 3)
    assert messages.pop() is None
    rows = [each for each in messages if isinstance(each, Progress)]
    assert rows == messages
    assert [each.played for each in rows] == [1, 2, 3]
    assert rows[0].bus_ns < rows[1].bus_ns < rows[2].bus_ns
    assert rows[0].frames <= rows[1].frames <= rows[2].frames
    assert told(job(), 0, 0) == [None]


def test_findings_are_small_and_play_again() -> None:
    """Each is told with the number of its walk and a text that shows it anywhere."""
    messages = told(job("key-frame-doubled", 1, "keys"), 0, 2)
    findings = [each for each in messages if isinstance(each, Found)]
    assert [each.number for each in findings] == [0, 1]
    for each in findings:
        again = Lab(model="key-frame-doubled").play(scenario(each.scenario))
        assert again is not None
        assert str(again.verdicts[0]) == each.text
        assert again.verdicts[0].requirement == each.requirement
        assert len(scenario(each.scenario).steps) < len(walk(4, each.number, ("keys",)).steps)


def test_workers_take_every_nth_walk() -> None:
    """What one finds is what it would find alone."""
    numbers = [
        [each.number for each in told(job("entry-frame-missing", 2, "keys"), worker, 2)
         if isinstance(each, Found)]
        for worker in (0, 1)
    ]  # fmt: skip
    assert numbers == [[0, 2], [1, 3]]


def test_findings_that_are_alike_are_counted() -> None:
    """Three of one requirement are told; the walk goes on."""
    messages = told(job("entry-frame-missing", 1, "keys"), 0, 6)
    assert sum(isinstance(each, Found) for each in messages) == 3
    assert sum(isinstance(each, Progress) for each in messages) == 6


def test_there_is_a_processor() -> None:
    """At least one."""
    assert soak.cores() >= 1


@pytest.mark.slow
def test_workers_are_processes_that_all_come_to_their_end() -> None:
    """What each finds is heard; the time is over for all of them."""
    messages: list[Progress | Found] = []
    plan = Soak("keypad", "entry-frame-missing", seed=4, seconds=0.5, jobs=2, families=("keys",))
    assert soak.run(plan, messages.append)
    found = [each for each in messages if isinstance(each, Found)]
    assert {each.requirement for each in found} == {"KEY-01"}
    assert len({each.number for each in found}) == len(found)


@pytest.mark.slow
@pytest.mark.filterwarnings("default")
def test_a_worker_that_is_lost_is_told() -> None:
    """Here one that cannot even build its model."""
    plan = Soak("keypad", "no-such-model", seed=4, seconds=0.5, jobs=1)
    assert not soak.run(plan, lambda _: None)


def test_what_a_bench_cannot_play_is_told() -> None:
    """Nothing is found where nothing was played, and why stands there until the next scenario."""
    lab = Lab()
    leds, lab.bench.leds = lab.bench.leds, None
    assert lab.play(scenario("operational: 0ms look")) is None
    assert "leds" in lab.why_not
    lab.bench.leds = leds
    assert lab.play(scenario("operational: 0ms look")) is None
    assert lab.why_not == ""
