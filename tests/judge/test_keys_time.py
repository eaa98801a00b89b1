"""With which debounce time a keypad works: told by changes that nothing else can have moved."""

from __future__ import annotations

from collections.abc import Sequence

import pytest

from hil_tests.clock import MS
from hil_tests.judge.keys_time import worked_with
from tests.judge.key_scene import ENTRY, A, At, B, rules, timeline

Reports = Sequence[tuple[At, int]]

EDGES = [(2000, A), (3000, 0)]


def steps(
    edges: Sequence[tuple[At, int]],
    reports: Reports,
    *acts_ms: float,
    debounce_ms: int = 500,
    turns: Sequence[tuple[At, bool]] = (),
) -> set[int]:
    """The debounce times that explain all of it, the device having been given 500 ms."""
    scene = timeline(edges, [ENTRY, *reports], turns)
    return set(worked_with(scene, rules(debounce_ms), [round(at * MS) for at in acts_ms]))


@pytest.mark.parametrize("after_ms", [190, 200, 230])
def test_a_time_explains_what_lies_within_scan_and_key_frame(after_ms: float) -> None:
    """From a scan before it to a scan and a key frame after it."""
    assert steps(EDGES, [(2000 + after_ms, A), (3000 + after_ms, 0)]) == {2}


@pytest.mark.parametrize("after_ms", [189, 231, 150])
def test_between_two_times_there_is_none(after_ms: float) -> None:
    """A ms outside on either side: it is late or early, and no other number."""
    assert steps(EDGES, [(2000 + after_ms, A), (3000 + after_ms, 0)]) == set()


def test_no_time_at_all_is_one_too() -> None:
    """Nothing is filtered where 500 ms were asked for."""
    assert steps(EDGES, [((1999.9, 2000), A), (3001, 0)]) == {0}


def test_a_right_device_works_with_its_own() -> None:
    """That is for the caller to compare."""
    assert steps(EDGES, [(2500, A), (3500, 0)]) == {5}


def test_one_change_is_too_little() -> None:
    """It may come at such a time by chance."""
    assert steps(EDGES[:1], [(2200, A)]) == set()
    assert steps([], []) == set()


def test_changes_must_agree() -> None:
    """A press after 200 ms and a release after 300 ms keep to no one time."""
    assert steps(EDGES, [(2200, A), (3300, 0)]) == set()


@pytest.mark.parametrize(("act_ms", "found"), [(1999, {2}), (2100, set()), (2201, {2})])
def test_what_we_sent_meanwhile_may_have_moved_it(act_ms: float, found: set[int]) -> None:
    """A frame between a change and its report: the change tells nothing."""
    assert steps(EDGES, [(2200, A), (3200, 0)], act_ms) == found


@pytest.mark.parametrize(("again_ms", "found"), [(2510, set()), (2511, {2})])
def test_changes_must_be_calm(again_ms: float, found: set[int]) -> None:
    """Another one within the debounce time and a scan before it may have to do with it."""
    edges = [(2000, A), (again_ms, 0)]
    assert steps(edges, [(2200, A), (again_ms + 200, 0)]) == found


def test_another_change_before_the_frame_spoils_it() -> None:
    """Whose frame it is cannot be told."""
    edges = [*EDGES, (4000, A), (4200, A | B)]
    assert steps(edges, [(2200, A), (3200, 0), (4200, A)]) == {2}
    assert steps(edges[2:], [(4200, A), (4400, A | B)]) == set()


def test_the_frame_must_show_this_change_alone() -> None:
    """Not another state, nor after one that was not shown."""
    assert steps(EDGES, [(2200, B), (3200, 0)]) == set()
    assert steps(EDGES, [(2200, A), (3200, B)]) == set()
    assert steps(EDGES, [(2200, A)]) == set()


def test_without_an_entry_frame_nothing_is_known_before() -> None:
    """The first frame has no one before it."""
    scene = timeline(EDGES, [(2200, A), (3200, 0)])
    assert worked_with(scene, rules(500), []) == frozenset()


@pytest.mark.parametrize(("press_ms", "found"), [(1049, set()), (1050, {2})])
def test_the_node_must_have_been_operational(press_ms: float, found: set[int]) -> None:
    """What is held on entry may count at once or later (KEY-22)."""
    edges = [(press_ms, A), (3000, 0)]
    assert steps(edges, [(press_ms + 200, A), (3200, 0)]) == found


@pytest.mark.parametrize(("stop_ms", "found"), [(3200, set()), (3201, {2})])
def test_the_node_must_still_be_operational(stop_ms: float, found: set[int]) -> None:
    """A frame that crosses a stop is another matter."""
    reports = [(2200, A), (3200, 0)]
    assert steps(EDGES, reports, turns=[(stop_ms, False)]) == found
