"""What a start rests on is blamed where the start is wrong."""

from __future__ import annotations

from collections.abc import Sequence

import pytest

from hil_tests.config import Parameters
from hil_tests.judge.echoes import Request
from hil_tests.judge.verdict import Outcome, Verdict
from hil_tests.scenarios.origins import Origin
from node_model.frame import Frame

OLD = Parameters(node_id=1, bit_rate_code=2, heartbeat_ms=1000, sync_time=0, debounce=1)
OTHER_ID = Parameters(node_id=6, bit_rate_code=2, heartbeat_ms=1000, sync_time=0, debounce=1)
OTHER_RATE = Parameters(node_id=6, bit_rate_code=3, heartbeat_ms=1000, sync_time=0, debounce=1)
ASKED = Request(0, Frame(0x4F8, bytes(6)))
GARBAGE = Request(0, Frame(0x123))


def wrong(requirement: str, at: int | None = 100) -> Verdict:
    """Something that a device did."""
    return Verdict(requirement, Outcome.FAIL, "it is wrong", at=at)


def blamed(origin: Origin, *requirements: str, at: int | None = 100) -> list[str]:
    """On what verdicts at an instant are."""
    found = origin.told([wrong(each, at) for each in requirements])
    assert all(verdict.outcome is Outcome.FAIL for verdict in found)
    return [verdict.requirement for verdict in found]


@pytest.mark.parametrize(
    ("after", "requests", "requirement"),
    [
        ((OLD,), [], "COM-29"),
        ((OLD,), [GARBAGE, GARBAGE], "COM-29"),
        ((OLD,), [ASKED], "COM-29"),
        ((OTHER_ID,), [ASKED, GARBAGE], "COM-06"),
        ((OLD, OTHER_ID), [ASKED], "COM-06"),
        ((OTHER_RATE,), [ASKED], "COM-07"),
        ((OLD, OTHER_RATE), [ASKED], "COM-07"),
        ((OTHER_ID,), [ASKED, ASKED], "COM-21"),
        ((OTHER_RATE,), [ASKED, ASKED], "COM-21"),
    ],
)
def test_a_start_after_commissioning_rests_on_what_is_kept(
    after: Sequence[Parameters], requests: Sequence[Request], requirement: str
) -> None:
    """Nothing new, a new set, a new bit rate, or a second message that changes nothing."""
    origin = Origin()
    origin.stayed(OLD, after, requests)
    assert origin.starts(50, held=False) == requirement


def test_a_plain_start_rests_on_itself() -> None:
    """After garbage it shows that nothing was changed; with keys held, that it is regular."""
    origin = Origin()
    assert origin.starts(50, held=False) == "NMT-02"
    assert origin.starts(50, held=True) == "COM-27"
    origin.littered()
    assert origin.starts(50, held=False) == "ROB-01"
    origin.stayed(OLD, (OLD,), [])
    assert origin.starts(50, held=True) == "COM-27"
    assert origin.starts(50, held=False) == "COM-29"


def test_a_second_stay_does_not_wash_off_the_first() -> None:
    """What was stored before, and never shown by a start, is still what the next one rests on."""
    origin = Origin()
    origin.stayed(OLD, (OTHER_ID,), [ASKED])
    origin.stayed(OTHER_ID, (OTHER_ID,), [])
    assert origin.starts(50, held=False) == "COM-06"


def test_a_right_start_ends_it() -> None:
    """What the device does later is judged for itself."""
    origin = Origin()
    origin.littered()
    origin.stayed(OLD, (OTHER_ID,), [ASKED])
    origin.starts(50, held=False)
    assert blamed(origin, "NMT-02", "ROB-02") == ["COM-06", "COM-06"]
    origin.started(OTHER_ID)
    assert blamed(origin, "NMT-02", "ROB-02") == ["NMT-02", "ROB-02"]
    assert origin.starts(60, held=False) == "NMT-02"


def test_what_was_wrong_before_a_wrong_start_is_judged_for_itself() -> None:
    """Only what follows from the start is blamed on what it rests on."""
    origin = Origin()
    origin.stayed(OLD, (OTHER_ID,), [ASKED])
    origin.starts(50, held=False)
    assert blamed(origin, "KEY-05", at=49) == ["KEY-05"]
    assert blamed(origin, "KEY-05", at=50) == ["COM-06"]
    assert blamed(origin, "KEY-05", at=None) == ["KEY-05"]


def test_times_of_the_other_set_are_a_mixture() -> None:
    """After a cut the node id tells which set was kept; all of it must be that one (COM-26)."""
    origin = Origin()
    origin.identified()
    assert origin.starts(50, held=False) == "COM-26"
    origin.started(OTHER_ID)
    found = ["HB-01", "HB-05", "HB-06", "KEY-04", "KEY-05"]
    assert blamed(origin, *found) == ["COM-26"] * 5
    assert blamed(origin, "KEY-06", "NMT-07") == ["KEY-06", "NMT-07"]
    origin.starts(90, held=False)
    origin.started(OTHER_ID)
    assert blamed(origin, "HB-01") == ["HB-01"]


def test_a_mixture_ends_with_its_life() -> None:
    """What was wrong before the cut, or is after the next start, is judged for itself."""
    origin = Origin()
    origin.starts(20, held=False)
    origin.started(OLD)
    origin.identified()
    origin.starts(50, held=False)
    origin.started(OLD)
    assert blamed(origin, "HB-01", at=49) == ["HB-01"]
    assert blamed(origin, "HB-01", at=50) == ["COM-26"]
    assert blamed(origin, "HB-01", at=None) == ["HB-01"]
    origin.starts(200, held=False)
    origin.started(OLD)
    assert blamed(origin, "HB-01", at=199) == ["COM-26"]
    assert blamed(origin, "HB-01", at=200) == ["HB-01"]


def test_what_is_always_wrong_is_no_mixture() -> None:
    """A beat that is lost in every life was not lost by the cut."""
    origin = Origin()
    origin.identified()
    origin.starts(50, held=False)
    origin.started(OLD)
    found = origin.told([wrong("HB-01", 40), wrong("HB-01", 60), wrong("HB-06", 60)])
    assert [verdict.requirement for verdict in found] == ["HB-01", "HB-01", "COM-26"]


# What a device that starts elsewhere, or debounces otherwise, has taken its parameters for.


def elsewhere(origin: Origin, own: Parameters, rate: int) -> str:
    """What is blamed on a start of the device at that bit rate instead of its own."""
    origin.starts(50, held=False)
    origin.elsewhere(own, rate)
    return origin.blames


def test_another_rate_is_another_meaning_of_the_code() -> None:
    """On a plain start, and after a set that was stored (COM-07)."""
    assert elsewhere(Origin(), OLD, 125_000) == "COM-07"
    origin = Origin()
    origin.stayed(OLD, (OTHER_RATE,), [ASKED])
    assert elsewhere(origin, OTHER_RATE, 100_000) == "COM-07"
    origin.blamed("NMT-02")
    assert blamed(origin, "ROB-02", at=50) == ["NMT-02"]


def test_keys_that_are_held_may_have_nothing_to_do_with_it() -> None:
    """Where it does not start without them either, it is what the start rests on."""
    origin = Origin()
    origin.stayed(OLD, (OTHER_ID,), [ASKED])
    assert origin.starts(50, held=True) == origin.blames == "COM-27"
    origin.keys_tell_nothing()
    assert origin.blames == "COM-06"


def test_another_rate_that_has_another_cause() -> None:
    """The code was right before, an older rate was kept, or garbage may have changed it."""
    right = Origin()
    right.started(OLD)
    assert elsewhere(right, OLD, 125_000) == "NMT-02"
    kept = Origin()
    kept.stayed(OTHER_RATE, (OLD,), [ASKED])
    kept.started(OTHER_RATE)
    kept.stayed(OLD, (OTHER_ID,), [ASKED])
    assert elsewhere(kept, OTHER_ID, 125_000) == "COM-06"
    assert elsewhere(kept, OTHER_ID, 100_000) == "COM-07"
    littered = Origin()
    littered.littered()
    assert elsewhere(littered, OLD, 125_000) == "ROB-01"
    waited = Origin()
    waited.stayed(OLD, (OLD,), [])
    assert elsewhere(waited, OLD, 125_000) == "COM-29"


def debounced(origin: Origin, own: Parameters, *steps: int) -> list[str]:
    """On what verdicts on keys are that come of a device which works with these times."""
    found = [wrong("KEY-04"), wrong("KEY-05"), wrong("KEY-06")]
    return [each.requirement for each in origin.debounced(found, frozenset(steps), own)]


def keyed(debounce: int, sync_time: int = 0) -> Parameters:
    """Parameters with these."""
    return Parameters(6, 2, 1000, sync_time, debounce)


def test_another_debounce_time_is_another_meaning_of_the_byte() -> None:
    """Where it keeps to one that it was never given (COM-10); other verdicts stay."""
    assert debounced(Origin(), keyed(255), 10) == ["COM-10", "COM-10", "KEY-06"]
    (found, *_) = Origin().debounced([wrong("KEY-05")], frozenset((10,)), keyed(255))
    assert found.text == "it is wrong; it works with debounce time 10, not 255"


UNTOUCHED = ["KEY-04", "KEY-05", "KEY-06"]


def test_nothing_is_known_of_a_device_without_one_debounce_time() -> None:
    """It keeps to none, or to its own."""
    assert debounced(Origin(), keyed(255)) == UNTOUCHED
    assert debounced(Origin(), keyed(255), 255) == UNTOUCHED


@pytest.mark.parametrize(
    ("sync_time", "right"),
    [(0, False), (25, False), (26, True), (30, True), (34, True), (35, False), (255, False)],
)
def test_a_sync_time_that_makes_up_the_difference(sync_time: int, right: bool) -> None:
    """It must not count (COM-11); where it may be the cause, nobody can tell."""
    found = debounced(Origin(), keyed(2, sync_time), 5)
    assert found == (UNTOUCHED if right else ["COM-10", "COM-10", "KEY-06"])


def test_a_debounce_time_that_was_stored_before_may_have_been_kept() -> None:
    """That would be COM-06."""
    origin = Origin()
    origin.stayed(keyed(1), (keyed(2),), [ASKED])
    origin.stayed(keyed(2), (keyed(3),), [ASKED])
    assert debounced(origin, keyed(3), 1) == UNTOUCHED
    assert debounced(origin, keyed(3), 2) == UNTOUCHED
    assert debounced(origin, keyed(3), 0) == ["COM-10", "COM-10", "KEY-06"]


def test_a_debounce_time_that_may_have_been_changed_tells_nothing() -> None:
    """By garbage, a second request, or a cut."""
    littered, asked, cut = Origin(), Origin(), Origin()
    littered.littered()
    asked.stayed(keyed(1), (keyed(3),), [ASKED, ASKED])
    cut.identified()
    for origin in (littered, asked, cut):
        assert debounced(origin, keyed(3), 0) == UNTOUCHED
