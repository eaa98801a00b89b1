"""Stories: what is played on a bench is what the timeline holds, and scenarios are plain data."""

from __future__ import annotations

from functools import partial
from itertools import pairwise

import pytest
from hypothesis import given, settings

from hil_tests.bench.bench import Bench
from hil_tests.bench.virtual import VirtualStage
from hil_tests.clock import MS
from hil_tests.config import load_profile
from hil_tests.judge.verdict import DeviceFailure, InconclusiveResult, Outcome
from hil_tests.scenarios.scenario import COMMANDS, Scenario
from hil_tests.scenarios.story import KeyStory, held_by, play, play_steps
from hil_tests.scenarios.strategies import MOST_STEPS, decode, key_scenarios, spans_ms
from hil_tests.trace import BusEvent, EventKind
from node_model import faults, keypad


def make_bench(mutant: str | None = None) -> Bench:
    """A virtual bench with a keypad, right or faulty."""
    stage = VirtualStage(partial(faults.make, mutant), keypad.load("keypad"))
    bench = Bench(stage, load_profile("keypad"), None)
    bench.begin()
    return bench


@pytest.fixture
def bench() -> Bench:
    """A virtual bench with a right keypad."""
    return make_bench()


def test_timeline_holds_what_was_played(bench: Bench) -> None:
    """Edges, turns and frames stand in it, with the masks of the profile."""
    story = play(bench, Scenario(1, ((20, 0b101), (200, "stop"), (100, 0), (50, "start"))))
    story.settle()
    found = story.timeline(bench.now())
    assert [edge.held for edge in found.edges] == [0, 0x81, 0]
    assert [turn.operational for turn in found.turns] == [False, True, False, True]
    spans = [b.when.latest - a.when.latest for a, b in pairwise(found.turns[1:])]
    assert 220 * MS <= spans[0] <= 222 * MS
    assert [report.mask for report in found.reports] == [0, 0x81, 0x81, 0]


def test_start_is_over_with_the_boot_up(bench: Bench) -> None:
    """A power-on and a reset are ready when their boot-up was seen, not when it is due."""
    story = play(bench, Scenario(1, ((20, "reset"), (20, "start"))))
    starts = [turn for turn in story.timeline(bench.now()).turns if turn.ready_at is not None]
    assert len(starts) == 2
    for turn in starts:
        assert turn.ready_at is not None
        assert turn.ready_at < turn.when.latest + 100 * MS


def test_timeline_begins_with_the_device(bench: Bench) -> None:
    """What keys and frames did before the story began is no part of it."""
    play(bench, Scenario(1, ((20, 0b1), (200, 0b11), (200, 0b1))))
    story = KeyStory.operational(bench, debounce=1)
    found = story.timeline(bench.now())
    assert [edge.held for edge in found.edges] == [0]
    assert [report.mask for report in found.reports] == [0]


def test_keys_held_before_the_start_are_the_first_edge(bench: Bench) -> None:
    """Contacts that moved without power count as they were at the start."""
    bench.fresh()
    story = KeyStory(bench)
    assert bench.keys is not None
    bench.keys.hold("k3")
    bench.keys.hold("k4")
    bench.boot()
    assert [edge.held for edge in story.timeline(bench.now()).edges] == [8]


def test_power_off_leads_out_of_operational(bench: Bench) -> None:
    """Without power the node is not operational; the next start is a new one."""
    story = KeyStory.operational(bench)
    assert bench.power is not None
    bench.power.off()
    bench.boot()
    turns = story.timeline(bench.now()).turns
    assert [turn.operational for turn in turns] == [False, True, False, False]


def test_right_keypad_passes_and_leaves_verdicts(bench: Bench) -> None:
    """Each claim is recorded as passed."""
    play(bench, Scenario(1, ((20, 0b1), (200, 0)))).judge("KEY-05", "KEY-06")
    last = bench.verdicts[-2:]
    assert [(v.requirement, v.outcome) for v in last] == [
        ("KEY-05", Outcome.PASS),
        ("KEY-06", Outcome.PASS),
    ]


def test_faulty_keypad_fails_with_its_frames() -> None:
    """The error names the requirement and shows the frames around."""
    bench = make_bench("debounce-too-short")
    with pytest.raises(DeviceFailure, match=r"KEY-05: .*too early") as caught:
        play(bench, Scenario(1, ((20, 0b1), (200, 0)))).judge("KEY-06")
    assert "key frame of node 6" in str(caught.value)


def test_lost_frames_make_a_fault_doubtful() -> None:
    """Where the bus cost us frames, a missing one may be among them."""
    bench = make_bench("entry-only-first-time")
    story = play(bench, Scenario(1, ((20, "stop"), (100, "start"))))
    bench.take(BusEvent(EventKind.OVERFLOW, bench.now(), "the reader was too slow", 3))
    with pytest.raises(InconclusiveResult, match=r"KEY-01: perhaps, for frames were lost"):
        story.judge("KEY-01")


def test_doubt_about_something_else_does_not_end_a_test() -> None:
    """A doubtful verdict on a requirement that is not claimed is passed over."""
    bench = make_bench("entry-only-first-time")
    story = play(bench, Scenario(1, ((20, "stop"), (100, "start"))))
    bench.take(BusEvent(EventKind.GAP, bench.now()))
    story.judge("KEY-05")


@settings(max_examples=50)
@given(scenario=key_scenarios(1))
def test_scenarios_are_plain_and_bounded(scenario: Scenario) -> None:
    """Steps are ms and a mask or a known word; a scenario prints as what makes it again."""
    assert 1 <= len(scenario.steps) <= MOST_STEPS
    for span_ms, what in scenario.steps:
        assert span_ms in spans_ms(1)
        assert what in COMMANDS if isinstance(what, str) else 0 <= what < 8
    assert eval(repr(scenario), {"Scenario": Scenario}) == scenario  # noqa: S307


def test_scenarios_leave_and_enter_in_turn() -> None:
    """Words of one list alternate between a way out and the start."""
    codes = [7 * len(spans_ms(1)), 7 * len(spans_ms(1)) + 1, 7 * len(spans_ms(1)) + 1]
    words = [what for _, what in decode(1, codes).steps]
    assert words == ["stop", "start", "pre-operational"]


@pytest.mark.parametrize("debounce", [0, 1, 2, 5])
def test_spans_stand_on_both_sides_of_the_limits(debounce: int) -> None:
    """There are spans just below and just above each limit."""
    spans = spans_ms(debounce)
    for limit in (100 * debounce - 10, 100 * debounce, 100 * debounce + 10):
        if limit > 0:
            assert {limit - 2, limit + 2} <= set(spans)


def test_pulses_of_a_scenario() -> None:
    """Each key's stays between two of its edges, in ms."""
    scenario = Scenario(1, ((20, 0b1), (30, 0b11), (40, "stop"), (50, 0b10), (60, 0)))
    assert list(scenario.pulses()) == [120, 150]


def test_masks_choose_keys_from_both_ends(bench: Bench) -> None:
    """Bits 0 and 1 are the first two keys, bit 2 the last one."""
    bench.fresh()
    assert held_by(bench, 0b111) == {"on_off", "aut", "k8"}


def test_steps_are_played_when_they_should(bench: Bench) -> None:
    """On an exact bench each step comes its span after the one before."""
    KeyStory.operational(bench, debounce=1)
    start = bench.now()
    play_steps(bench, ((30, 1), (5, 0), (7, 1), (100, "stop")))
    edges = [moment.ended_at - start for moment in bench.trace.moments() if moment.what == "keys"]
    assert edges == [30 * MS, 35 * MS, 42 * MS]
