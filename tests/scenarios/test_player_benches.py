"""Playing scenarios: what a bench must have, and what it may do to others and to the device."""

from __future__ import annotations

import pytest

from hil_tests.bench.virtual import VirtualStage
from hil_tests.explore.lab import Lab
from hil_tests.judge.verdict import NotRun
from hil_tests.scenarios.player import Player
from hil_tests.scenarios.scenario import Step, scenario
from tests.bench.fakes import bench_of


@pytest.mark.parametrize(
    ("text", "lack"),
    [
        ("off: 0ms power on", "Power"),
        ("operational: 0ms keys 1", "Keys"),
        ("operational: 0ms look", "Leds"),
        ("operational: 0ms rate 500000", "BitRate"),
    ],
)
def test_what_the_bench_lacks_is_said_before_anything_is_done(text: str, lack: str) -> None:
    """The refusal names the bench, what it has not, and the section that adds it."""
    section = lack.lower()
    bench, stage = bench_of(without=[section])
    with pytest.raises(
        NotRun, match=rf"bench 'desk' has no {lack}; add \[{section}\] to its file"
    ):
        Player(bench).begin(scenario(text))
    assert stage.asked == []
    assert not stage.port.sent


def test_a_bench_that_sees_no_changes_of_light_cannot_watch() -> None:
    """An eye that looks at LEDs is not enough."""
    lab = Lab()
    stage = lab.bench.stage
    assert isinstance(stage, VirtualStage)
    stage.sees_edges = False
    assert lab.play(scenario("operational: 0ms watch 2s")) is None
    assert lab.why_not == "bench 'virtual' cannot tell when an LED changes"


@pytest.mark.parametrize("step", ["send 123#", "rate 500000", "load 60% high"])
def test_a_shared_bus_is_left_in_peace(step: str) -> None:
    """What would disturb others is not done where others live on the bus."""
    bench, stage = bench_of()
    stage.exclusive = False
    with pytest.raises(NotRun, match="shares its bus"):
        Player(bench).begin(scenario(f"operational: 0ms {step}"))
    assert stage.asked == []


def test_memory_is_written_only_where_that_is_allowed() -> None:
    """A scenario that commissions is refused before anything is done."""
    bench, stage = bench_of(writes_allowed=False)
    with pytest.raises(NotRun, match="--can-allow-writes"):
        Player(bench).begin(scenario("off: 0ms keys 11; 0ms power on; 0ms request 06"))
    assert stage.asked == []


def test_commissioning_by_keys_alone_is_refused_where_writes_are() -> None:
    """Even without a request nobody is brought there who must not be written."""
    bench, _ = bench_of(writes_allowed=False)
    player = Player(bench)
    player.begin(scenario("off: 0ms keys 11; 0ms power on"))
    player.do(Step(0, "keys", "11"))
    with pytest.raises(NotRun, match="--can-allow-writes"):
        player.do(Step(0, "power", "on"))


def test_a_load_that_a_bench_cannot_make_is_not_run() -> None:
    """Nobody pretends that the bus was loaded."""
    bench, _ = bench_of()
    player = Player(bench)
    with pytest.raises(NotRun, match="cannot load the bus"):
        player.do(Step(0, "load", "60% high"))


@pytest.mark.parametrize("before", ["", "0ms load 20% low; ", "0ms load 90% low; "])
def test_a_load_ends_the_one_before(before: str) -> None:
    """A share is that of the whole bus: what was loaded before adds little that still waits."""
    lab = Lab()
    lab.play(scenario(f"operational heartbeat_ms=0: {before}0ms load 20% low; 1s load off"))
    loaded = len(lab.bench.trace)
    lab.play(scenario("operational heartbeat_ms=0: 0ms load 20% low; 1s load off"))
    assert len(lab.bench.trace) <= loaded <= len(lab.bench.trace) + 8


def test_a_lab_finds_nothing_where_nothing_can_be_played() -> None:
    """Frames that the wire cannot carry are not run."""
    assert Lab().play(scenario("operational: 0ms wait")) is None


def test_a_load_is_ended_only_where_there_is_one() -> None:
    """A trace tells of no station falling silent that never spoke."""
    lab = Lab()
    lab.play(scenario("operational: 0ms load off; 0ms load 20% low; 1s load off; 0ms load off"))
    told = [each.what for each in lab.bench.trace.moments() if each.what.endswith("load")]
    assert told == ["load", "unload"]
