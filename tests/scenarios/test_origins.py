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
    origin.started()
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
    origin.started()
    found = ["HB-01", "HB-05", "HB-06", "KEY-04", "KEY-05"]
    assert blamed(origin, *found) == ["COM-26"] * 5
    assert blamed(origin, "KEY-06", "NMT-07") == ["KEY-06", "NMT-07"]
    origin.starts(90, held=False)
    origin.started()
    assert blamed(origin, "HB-01") == ["HB-01"]
