"""The key oracle on timelines made by hand: every limit from both sides, every blame."""

from __future__ import annotations

import pytest

from hil_tests.clock import MS
from hil_tests.judge.keys import KeyRules
from tests.judge.key_scene import ENTRY, START, A, At, B, C, blame, judge, rules, timeline

# What is right.


def test_press_and_release_in_time_are_right() -> None:
    """An entry frame, a press and a release, each after the debounce time."""
    edges = [(2000, A), (3000, 0)]
    assert blame(timeline(edges, [ENTRY, (2100, A), (3100, 0)])) == ""


def test_nothing_happens_and_nothing_is_asked_for() -> None:
    """A node that was never started owes no frame."""
    scene = timeline([], [])
    assert blame(scene) == "KEY-01"
    alone = type(scene)(scene.edges, scene.turns[:1], [], scene.until)
    assert blame(alone) == ""


# The bits (KEY-03).


def test_bit_of_a_key_that_never_moved() -> None:
    """A press of one key shown as another is a wrong bit."""
    assert blame(timeline([(2000, A)], [ENTRY, (2100, B)])) == "KEY-03"


def test_bit_that_belongs_to_no_key() -> None:
    """A bit without a key is always wrong; what else the frame says is looked at too."""
    found = judge(timeline([(2000, A)], [ENTRY, (2100, A | 4)]))
    assert [verdict.requirement for verdict in found] == ["KEY-03"]


def test_state_that_the_keys_never_had_at_one_time() -> None:
    """Two keys that were never held together are not shown together, though each was held."""
    quick = rules(0)
    edges = [(2000, A), (2030, 0), (2045, B)]
    reports = [ENTRY, (2000, A), (2030, 0), (2046, A | B), (2047, B)]
    found = judge(timeline(edges, reports), quick)
    assert "at one time" in found[0].text


# The debounce time (KEY-04, KEY-05).


@pytest.mark.parametrize(
    ("at", "found"),
    [
        (2089.9, "KEY-05"),
        (2090, ""),
        ((2089.5, 2090.5), "?KEY-05"),
        (2110, ""),
        (2130, ""),
        ((2129.5, 2130.5), "?KEY-05"),
        (2130.1, "KEY-05"),
    ],
)
def test_press_is_reported_neither_early_nor_late(at: At, found: str) -> None:
    """The frame of a press at 2 s is asked for between 2.09 and 2.13 s."""
    assert blame(timeline([(2000, A)], [ENTRY, (at, A)])) == found


@pytest.mark.parametrize(("at", "found"), [(3089.9, "KEY-05"), (3090, ""), (3130.1, "KEY-05")])
def test_release_is_reported_neither_early_nor_late(at: float, found: str) -> None:
    """The same holds for a release."""
    edges = [(2000, A), (3000, 0)]
    assert blame(timeline(edges, [ENTRY, (2100, A), (at, 0)])) == found


def test_doubt_of_the_stimulus_widens_the_limits() -> None:
    """A press somewhere between 2.00 and 2.02 s may be reported from 2.09 to 2.15 s."""
    edges: list[tuple[At, int]] = [((2000, 2020), A)]
    assert blame(timeline(edges, [ENTRY, (2085, A)])) == "KEY-05"
    assert blame(timeline(edges, [ENTRY, (2095, A)])) == "?KEY-05"
    assert blame(timeline(edges, [ENTRY, (2125, A)])) == ""
    assert blame(timeline(edges, [ENTRY, (2145, A)])) == "?KEY-05"
    assert blame(timeline(edges, [ENTRY, (2155, A)])) == "KEY-05"


def test_early_and_late_verdicts_are_measured() -> None:
    """They say after which time the frame came, and what is allowed."""
    (early,) = judge(timeline([(2000, A)], [ENTRY, (2050, A)]))
    assert (early.measured, early.at) == ((50 * MS, 50 * MS), 2050 * MS)
    (late,) = judge(timeline([(2000, A)], [ENTRY, (2150, A)]))
    assert late.measured == (150 * MS, 150 * MS)
    assert late.limits is not None
    assert late.limits.at_most_ns == 130 * MS


@pytest.mark.parametrize(
    ("span", "seen", "found"),
    [
        (89.9, False, ""),
        (89.9, True, "KEY-04"),
        (90, True, ""),
        (90, False, ""),
        (110, False, ""),
        (110.1, False, "KEY-06"),
        (110.1, True, ""),
    ],
)
def test_pulse_near_the_debounce_time(span: float, seen: bool, found: str) -> None:
    """Below 90 ms a press never counts, above 110 ms it always does, between it may."""
    reports = [(2100, A), (2000 + span + 100, 0)] if seen else []
    assert blame(timeline([(2000, A), (2000 + span, 0)], [ENTRY, *reports])) == found


def test_pulse_of_uncertain_length() -> None:
    """A press that lasted 80 to 100 ms may have counted; whether it may is in doubt."""
    edges: list[tuple[At, int]] = [(2000, A), ((2080, 2100), 0)]
    assert blame(timeline(edges, [ENTRY])) == ""
    assert blame(timeline(edges, [ENTRY, (2095, A), (2200, 0)])) in {"", "?KEY-04"}


def test_short_pulses_do_not_add_up() -> None:
    """Three presses of 50 ms with pauses of 12 ms are no press; the pauses must be seen."""
    edges = [(2000, A), (2050, 0), (2062, A), (2112, 0), (2124, A), (2174, 0)]
    assert blame(timeline(edges, [ENTRY])) == ""
    assert blame(timeline(edges, [ENTRY, (2162, A), (2280, 0)])) == "KEY-04"


def test_pause_shorter_than_a_scan_may_be_missed() -> None:
    """A keypad that reads its keys every 10 ms may take two presses for one long one."""
    edges = [(2000, A), (2050, 0), (2059, A), (2120, 0)]
    assert blame(timeline(edges, [ENTRY, (2100, A), (2220, 0)])) == ""
    assert blame(timeline(edges, [ENTRY])) == ""
    assert blame(timeline(edges, [ENTRY, (2085, A), (2220, 0)])) == "KEY-05"


def test_bounce_may_hide_where_the_time_began() -> None:
    """A keypad that missed a bounce may report while the bounce lasts."""
    edges = [(2000, A), (2089, 0), (2095, A)]
    assert blame(timeline(edges, [ENTRY, (2091, A)])) == ""


def test_without_debounce_time_a_report_may_come_at_once() -> None:
    """Debounce 0: from the edge on, pulses shorter than a scan perhaps, others surely."""
    quick = rules(0)
    assert blame(timeline([(2000, A)], [ENTRY, (2000, A)]), quick) == ""
    assert blame(timeline([(2000, A)], [ENTRY, (2030, A)]), quick) == ""
    assert blame(timeline([(2000, A)], [ENTRY, (2031, A)]), quick) == "KEY-05"
    assert blame(timeline([(2000, A), (2009, 0)], [ENTRY]), quick) == ""
    assert blame(timeline([(2000, A), (2011, 0)], [ENTRY]), quick) == "KEY-06"
    assert blame(timeline([(2000, A)], [ENTRY, (1999, A)]), quick) == "KEY-03"


def test_report_on_the_wire_when_the_edge_comes_was_not_caused_by_it() -> None:
    """A frame that shows the state from before an edge may be asked for until that counts."""
    edges = [(2000, A), (2095, A | B)]
    assert blame(timeline(edges, [ENTRY, ((2090, 2120), A), (2195, A | B)])) == ""


# Nothing lost, nothing twice, nothing out of order (KEY-06, KEY-20).


@pytest.mark.parametrize("missing", [1, 3])
def test_lost_press_is_missed(missing: int) -> None:
    """Each press that certainly counts must be shown."""
    edges = [(2000, A), (3000, 0), (4000, A), (5000, 0)]
    reports = [ENTRY, (2100, A), (3100, 0), (4100, A), (5100, 0)]
    del reports[missing]
    assert blame(timeline(edges, reports)) == "KEY-06"


def test_releases_that_are_never_shown_are_silent() -> None:
    """Where no release at all is shown, that they are is missing (KEY-20); else one is lost."""
    edges = [(2000, A), (3000, 0), (4000, B), (5000, 0)]
    silent = [ENTRY, (2100, A), (4100, B)]
    assert blame(timeline(edges, silent)) == "KEY-20"
    edges = [(2000, A), (3000, 0), (4000, A), (5000, 0)]
    assert blame(timeline(edges, [ENTRY, (2100, A), (3100, 0), (4100, A)])) == "KEY-06"


def test_a_key_frame_on_entry_shows_no_release() -> None:
    """It shows what is held, also on a board whose releases are silent."""
    edges = [(2000, A), (3000, 0), (6000, A), (7000, 0)]
    turns = [(4000, False), (5000, True)]
    told = [ENTRY, (2100, A), (5001, 0), (6100, A)]
    assert blame(timeline(edges, told, turns)) == "KEY-20"
    released = [ENTRY, (2100, A), (3100, 0), (5001, 0), (6100, A)]
    assert blame(timeline(edges, released, turns)) == "KEY-06"


def test_board_that_reports_presses_only() -> None:
    """With the profile's word releases may be silent; presses may not, and may look alike."""
    edges = [(2000, A), (3000, 0), (4000, A), (5000, 0)]
    presses = rules(releases=False)
    assert blame(timeline(edges, [ENTRY, (2100, A), (4100, A)]), presses) == ""
    assert blame(timeline(edges, [ENTRY, (2100, A)]), presses) == "KEY-06"


def test_change_that_is_soon_undone_must_still_be_shown() -> None:
    """Two sure changes in a row bring two frames, also where the second one comes at once."""
    quick = rules(0)
    edges = [(2000, A), (2012, 0)]
    assert blame(timeline(edges, [ENTRY, (2018, A), (2030, 0)]), quick) == ""
    assert blame(timeline(edges, [ENTRY, (2030, 0)]), quick) == "KEY-06"


def test_frames_out_of_order() -> None:
    """The later state first leaves the node at an old one."""
    assert blame(timeline([(2000, A | B)], [ENTRY, (2100, A | B), (2100, A)])) == "KEY-06"


def test_stale_frame_is_wrong() -> None:
    """Once a release must have counted no frame shows the key pressed."""
    edges = [(2000, A), (3000, 0), (3050, B)]
    reports = [ENTRY, (2100, A), (3100, 0), (3150, A | B)]
    assert blame(timeline(edges, reports)) == "KEY-06"


def test_last_frame_must_show_the_state() -> None:
    """A change that may have counted long ago must be right once it is sure."""
    edges = [(2000, A), (2100, 0), (2112, A)]
    assert blame(timeline(edges, [ENTRY, (2100, A), (2201, 0), (2212, A)])) == ""
    assert blame(timeline(edges, [ENTRY, (2100, A), (2201, 0)])) == "KEY-06"


def test_release_that_may_have_counted_is_taken_back() -> None:
    """A release of 100 ms may be shown; then the press after it must be shown as well."""
    edges = [(2000, A), (2500, 0), (2600, A)]
    first = [ENTRY, (2100, A)]
    assert blame(timeline(edges, first)) == ""
    assert blame(timeline(edges, [*first, (2600, 0), (2700, A)])) == ""
    assert blame(timeline(edges, [*first, (2600, 0)])) == "KEY-06"


def test_only_frame_of_uncertain_time_shows_another_state() -> None:
    """Whenever the one frame was asked for, it does not show the key that is held."""
    assert blame(timeline([], [((1001, 1300), 0)], held=A)) == "KEY-22"


def test_change_is_not_lost_before_its_time_is_over() -> None:
    """What was not yet due when the recording ended, or when the node left, is not lost."""
    assert blame(timeline([(2000, A)], [ENTRY], until=2129)) == ""
    assert blame(timeline([(2000, A)], [ENTRY], until=2131)) == "KEY-06"
    assert blame(timeline([(2000, A)], [ENTRY], [(2129, False)])) == ""
    assert blame(timeline([(2000, A)], [ENTRY], [(2131, False)])) == "KEY-06"


def test_doubt_over_which_frame_was_last() -> None:
    """A frame that may have been asked for just after the limit leaves a doubt."""
    assert blame(timeline([(2000, A)], [ENTRY, ((2125, 2140), A)])) == "?KEY-05"


def test_keys_that_mature_together_in_one_frame_or_several() -> None:
    """Both are right, in any order of the keys (KEY-23)."""
    edges = [(2000, A | B | C)]
    for first in ([], [(2100, A)], [(2100, C), (2100.2, B | C)]):
        assert blame(timeline(edges, [ENTRY, *first, (2100.4, A | B | C)])) == ""
    assert blame(timeline(edges, [ENTRY, (2100, A)])) == "KEY-06"


def test_key_is_timed_by_itself() -> None:
    """A second key neither hastens nor delays the first one."""
    edges = [(2000, A), (2060, A | B)]
    assert blame(timeline(edges, [ENTRY, (2100, A), (2160, A | B)])) == ""
    assert blame(timeline(edges, [ENTRY, (2160, A | B)])) == "KEY-05"
    assert blame(timeline(edges, [ENTRY, (2100, A | B)])) == "KEY-05"


def test_verdicts_come_in_order_of_time() -> None:
    """The first of several faults stands first."""
    edges = [(2000, A), (3000, 0), (4000, A), (5000, 0)]
    found = judge(timeline(edges, [ENTRY, (2050, A), (3050, 0), (4050, A), (5050, 0)]))
    assert [verdict.at for verdict in found] == sorted(v.at or 0 for v in found)
    assert len(found) == 4


def test_rules_of_a_keypad_without_filtering() -> None:
    """With debounce 0 nothing can be too early."""
    assert KeyRules({}, 0, 10, 20, 50).soonest_ns == 0
    assert rules().surely_ns == 110 * MS
    assert START
