"""The key oracle where the node comes and goes: entry frames, silence outside, what is kept."""

from __future__ import annotations

import pytest

from hil_tests.clock import MS
from tests.judge.key_scene import ENTRY, A, At, B, blame, judge, timeline

# The entry into operational (KEY-01).


@pytest.mark.parametrize(
    ("at", "found"),
    [
        (1000.1, ""),
        (1050, ""),
        (1050.1, "KEY-01"),
        ((1049, 1051), "?KEY-01"),
        (1200, "KEY-01"),
    ],
)
def test_entry_frame_comes_in_time(at: At, found: str) -> None:
    """The entry frame is asked for within 50 ms of the command."""
    assert blame(timeline([], [(at, 0)])) == found


def test_late_entry_frame_is_measured() -> None:
    """A verdict on a late entry frame tells how late; on a missing one it cannot."""
    (late,) = judge(timeline([], [(1060, 0)]))
    assert late.measured is not None
    assert late.measured.latest == 60 * MS
    (missing,) = judge(timeline([], []))
    assert missing.measured is None


def test_frame_of_a_later_window_is_no_late_entry_frame() -> None:
    """The frame of the second entry does not stand for the one that the first lacks."""
    turns = [(1500, False), (2000, True)]
    (missing,) = judge(timeline([], [(2001, 0)], turns))
    assert (missing.requirement, missing.measured) == ("KEY-01", None)


def test_short_window_owes_no_entry_frame() -> None:
    """A node that left operational before the limit need not have spoken."""
    assert blame(timeline([], [], [(1049, False)])) == ""
    assert blame(timeline([], [], [(1051, False)])) == "KEY-01"


def test_entry_frame_is_not_missing_before_its_time_is_over() -> None:
    """What was not yet due when the recording ended is not missing."""
    assert blame(timeline([], [], until=1049)) == ""


@pytest.mark.parametrize(("again", "found"), [(1002, "KEY-01"), (1051, "KEY-06")])
def test_entry_frame_sent_twice(again: float, found: str) -> None:
    """The same frame twice on entry is a doubled entry frame, later a doubled report."""
    assert blame(timeline([], [ENTRY, (again, 0)])) == found


def test_entry_frame_shows_keys_settled_before() -> None:
    """A key held since before the node left operational is in the next entry frame."""
    edges = [(1200, A)]
    turns = [(2000, False), (3000, True)]
    first = [ENTRY, (1300, A)]
    assert blame(timeline(edges, [*first, (3001, A)], turns)) == ""
    assert blame(timeline(edges, [*first, (3001, 0)], turns)) == "KEY-01"


def test_second_entry_frame_that_is_past_is_made_up() -> None:
    """After the entry frame no states of the time outside follow (KEY-07)."""
    edges = [(1200, A), (2200, 0)]
    turns = [(2000, False), (3000, True)]
    reports = [ENTRY, (1300, A), (3001, 0), (3002, B), (3003, 0)]
    assert blame(timeline(edges, reports, turns)) == "KEY-03"
    edges = [(1200, A), (1400, A | B), (1600, A)]
    reports = [ENTRY, (1300, A), (1500, A | B), (1700, A), (3001, A), (3002, A | B), (3003, A)]
    assert blame(timeline(edges, reports, turns)) == "KEY-07"


# Outside operational (KEY-07, KEY-21, KEY-22).


@pytest.mark.parametrize(("at", "found"), [(2049, ""), (2051, "KEY-07"), ((2040, 2060), "")])
def test_frame_after_the_node_left(at: At, found: str) -> None:
    """Until 50 ms after the command "stop" a change may still be shown, then no more."""
    assert blame(timeline([(1945, A)], [ENTRY, (at, A)], [(2000, False)])) == found


@pytest.mark.parametrize(("at", "found"), [(999, "KEY-07"), (1000, "")])
def test_frame_before_the_start(at: float, found: str) -> None:
    """Before the command "start" has ended no key frame is asked for."""
    assert blame(timeline([], [(at, 0), (1002, 0)][: 2 if found else 1])) == found


def test_frame_on_leaving_is_no_report() -> None:
    """The same frame again when operational is left does not belong there."""
    assert blame(timeline([], [ENTRY, (2001, 0)], [(2000, False)])) == "KEY-07"


def test_start_again_may_repeat_the_state() -> None:
    """A start command while operational may bring the state again (KEY-21)."""
    answers: list[tuple[At, str]] = [(2040, ""), (2060, "KEY-06"), ((1999.9, 2000.1), "")]
    for at, found in answers:
        assert blame(timeline([], [ENTRY, (at, 0)], [(2000, True)])) == found


def test_entry_frames_may_look_alike() -> None:
    """Each entry has its frame, whatever the one before showed; also when they come quickly."""
    turns = [(1060, False), (1070, True)]
    assert blame(timeline([], [ENTRY, (1080, 0)], turns)) == ""
    assert blame(timeline([], [ENTRY, (1069, 0), (1080, 0)], turns)) == "KEY-07"


@pytest.mark.parametrize("shown_at", [1001, 1100, 1150])
def test_key_held_at_power_up_counts_soon_after_entry(shown_at: float) -> None:
    """At once, or after the debounce time from entry: all are right (KEY-22)."""
    reports = [(1001, 0), (shown_at, A)][1 if shown_at == 1001 else 0 :]
    assert blame(timeline([], reports, held=A)) == ""


def test_key_held_at_power_up_must_be_shown() -> None:
    """By the debounce time after entry it must be shown."""
    assert blame(timeline([], [ENTRY], held=A)) == "KEY-22"
    assert blame(timeline([], [ENTRY, (1300, A)], held=A)) == "KEY-05"


def test_key_pressed_just_before_entry() -> None:
    """It counts at once on entry, after the debounce time from the edge, or from entry."""
    edges = [(980, A)]
    for reports in ([(1001, A)], [ENTRY, (1080, A)], [ENTRY, (1150, A)]):
        assert blame(timeline(edges, reports)) == ""
    assert blame(timeline(edges, [ENTRY, (1181, A)])) == "KEY-05"


def test_short_press_before_entry_leaves_no_trace() -> None:
    """A press too short to count, over long before the entry, is not in the entry frame."""
    edges = [(500, A), (580, 0)]
    assert blame(timeline(edges, [(1001, 0)])) == ""
    assert blame(timeline(edges, [(1001, A), (1101, 0)])) == "KEY-01"


def test_key_that_moves_while_the_node_starts() -> None:
    """What is held until the initialisation is over may count at once."""
    edges = [(90, A), (950, 0)]
    assert blame(timeline(edges, [(1001, A), (1050, 0)])) == ""


def test_node_need_not_look_at_its_keys_outside_operational() -> None:
    """A press under way when operational was left may last, to the node, until the entry."""
    edges = [(1950, A), (2040, 0)]
    turns = [(2000, False), (3000, True)]
    assert blame(timeline(edges, [ENTRY, (3001, 0)], turns)) == ""
    assert blame(timeline(edges, [ENTRY, (3001, A), (3100, 0)], turns)) == ""


def test_press_that_came_and_went_outside() -> None:
    """It may be unseen: a key held before and after was then held all the time."""
    edges = [(1200, A), (2200, 0), (2600, A)]
    turns = [(2000, False), (3000, True)]
    first = [ENTRY, (1300, A)]
    assert blame(timeline(edges, [*first, (3001, A)], turns)) == ""
    assert blame(timeline(edges, [*first, (3001, 0), (3100, A)], turns)) == ""


def test_reset_forgets_the_keys() -> None:
    """After a reset a held key counts at once on entry, or the debounce time later."""
    scene = timeline([(1200, A)], [ENTRY, (1300, A), (3001, 0), (3100, A)], [(3000, True)])
    reset = scene.turns[0]._replace(when=scene.turns[0].when.shifted(2000 * MS))
    reset = reset._replace(ready_at=2100 * MS)
    turns = [*scene.turns[:2], reset, scene.turns[2]]
    again = type(scene)(scene.edges, turns, scene.reports, scene.until)
    assert blame(again) == ""
