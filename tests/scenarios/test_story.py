"""Stories: what is done on a bench is what the timeline holds, and is judged by it."""

from __future__ import annotations

from itertools import pairwise

import pytest

from hil_tests.bench.keypad import KeypadBench
from hil_tests.clock import MS
from hil_tests.explore.lab import Lab
from hil_tests.judge.cobs import Nmt
from hil_tests.judge.verdict import DeviceFailure, InconclusiveResult, NotRun, Outcome
from hil_tests.scenarios.player import Player
from hil_tests.scenarios.scenario import scenario
from hil_tests.scenarios.story import KeyStory, key_rules
from hil_tests.trace import BusEvent, EventKind
from tests.bench.fakes import bench_of


def make_bench(mutant: str | None = None) -> KeypadBench:
    """A virtual bench with a keypad, right or faulty."""
    bench = Lab(model=mutant).bench
    bench.begin()
    return bench


@pytest.fixture
def bench() -> KeypadBench:
    """A virtual bench with a right keypad."""
    return make_bench()


def told(bench: KeypadBench, steps: str) -> KeyStory:
    """A story from operational on, with some steps of a scenario done in it."""
    story = KeyStory.operational(bench, debounce=1)
    player = Player(bench)
    for step in scenario(f"operational: {steps}; 0ms wait").steps:
        player.do(step)
    return story


def test_timeline_holds_what_was_done(bench: KeypadBench) -> None:
    """Edges, turns and frames stand in it, with the masks of the profile."""
    story = KeyStory.operational(bench, debounce=1)
    assert bench.keys is not None
    bench.wait(20 * MS)
    bench.keys.hold("on_off", "k8")
    bench.wait(200 * MS)
    bench.nmt(Nmt.STOP)
    bench.wait(100 * MS)
    bench.keys.release()
    bench.wait(50 * MS)
    bench.nmt(Nmt.START)
    story.settle()
    found = story.timeline(bench.now())
    assert [edge.held for edge in found.edges] == [0, 0x81, 0]
    assert [turn.operational for turn in found.turns] == [False, True, False, True]
    spans = [b.when.latest - a.when.latest for a, b in pairwise(found.turns[1:])]
    assert 220 * MS <= spans[0] <= 222 * MS
    assert [report.mask for report in found.reports] == [0, 0x81, 0x81, 0]


def test_a_start_is_over_with_its_boot_up(bench: KeypadBench) -> None:
    """A power-on and a reset are ready when their boot-up was seen, not when it is due."""
    story = KeyStory.operational(bench)
    sent = bench.nmt(Nmt.RESET_NODE)
    bench.wait(200 * MS)
    starts = [turn for turn in story.timeline(bench.now()).turns if turn.ready_at is not None]
    assert len(starts) == 2
    assert starts[1].when.latest == sent.at
    for turn in starts:
        assert turn.ready_at is not None
        assert turn.ready_at < turn.when.latest + 100 * MS


def test_timeline_begins_with_the_device(bench: KeypadBench) -> None:
    """What keys and frames did before the story began is no part of it."""
    KeyStory.operational(bench)
    assert bench.keys is not None
    bench.keys.hold("k3")
    bench.wait(200 * MS)
    story = KeyStory.operational(bench, debounce=1)
    found = story.timeline(bench.now())
    assert [edge.held for edge in found.edges] == [0]
    assert [report.mask for report in found.reports] == [0]


def test_keys_held_before_the_start_are_the_first_edge(bench: KeypadBench) -> None:
    """Contacts that moved without power count as they were at the start."""
    bench.fresh()
    story = KeyStory(bench)
    assert bench.keys is not None
    bench.keys.hold("k3")
    bench.keys.hold("k4")
    bench.boot()
    assert [edge.held for edge in story.timeline(bench.now()).edges] == [8]


def test_power_off_leads_out_of_operational(bench: KeypadBench) -> None:
    """Without power the node is not operational; the next start is a new one."""
    story = KeyStory.operational(bench)
    assert bench.power is not None
    bench.power.off()
    bench.boot()
    turns = story.timeline(bench.now()).turns
    assert [turn.operational for turn in turns] == [False, True, False, False]


def test_right_keypad_passes_and_leaves_verdicts(bench: KeypadBench) -> None:
    """Each claim is recorded as passed."""
    told(bench, "20ms keys 1; 200ms keys 0").judge("KEY-05", "KEY-06")
    last = bench.verdicts[-2:]
    assert [(v.requirement, v.outcome) for v in last] == [
        ("KEY-05", Outcome.PASS),
        ("KEY-06", Outcome.PASS),
    ]


def test_faulty_keypad_fails_with_its_frames() -> None:
    """The error names the requirement and shows the frames around."""
    bench = make_bench("debounce-too-short")
    with pytest.raises(DeviceFailure, match=r"KEY-05: .*too early") as caught:
        told(bench, "20ms keys 1; 200ms keys 0").judge("KEY-06")
    assert "key frame of node 1" in str(caught.value)


def test_lost_frames_make_a_fault_doubtful() -> None:
    """Where the bus cost us frames, a missing one may be among them."""
    bench = make_bench("entry-only-first-time")
    story = KeyStory.operational(bench)
    bench.nmt(Nmt.STOP)
    bench.wait(100 * MS)
    bench.nmt(Nmt.START)
    bench.take(BusEvent(EventKind.OVERFLOW, bench.now(), "the reader was too slow", 3))
    with pytest.raises(InconclusiveResult, match=r"KEY-01: perhaps, for frames were lost"):
        story.judge("KEY-01")


def test_doubt_about_something_else_does_not_end_a_test() -> None:
    """A doubtful verdict on a requirement that is not claimed is passed over."""
    bench = make_bench("entry-only-first-time")
    story = KeyStory.operational(bench)
    bench.nmt(Nmt.STOP)
    bench.wait(100 * MS)
    bench.nmt(Nmt.START)
    bench.take(BusEvent(EventKind.GAP, bench.now()))
    story.judge("KEY-05")
    assert [verdict.requirement for verdict in bench.verdicts[-1:]] == ["KEY-05"]


def test_rules_need_what_the_device_is_commissioned_to() -> None:
    """Without its debounce time its keys cannot be judged."""
    bench, _ = bench_of(parameters=None)
    with pytest.raises(NotRun, match="is not known"):
        key_rules(bench)
