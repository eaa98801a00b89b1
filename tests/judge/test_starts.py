"""The oracle of starts: an EMCY "hardware" follows each boot-up, in time (NMT-02, NMT-20)."""

from __future__ import annotations

from collections.abc import Sequence

import pytest

from hil_tests.clock import FOREVER, MS, Interval
from hil_tests.judge.starts import Emergency, Start, judge_starts
from hil_tests.judge.verdict import Outcome, Verdict
from node_model.frame import Frame

RIGHT = "0050010000000000"
LATE = 10_000
"""Everything that was asked for is known by then, in ms."""


def when(first_ms: float, last_ms: float | None = None) -> Interval:
    """An instant in ms, or one that lies between two."""
    last_ms = first_ms if last_ms is None else last_ms
    return Interval(round(first_ms * MS), round(last_ms * MS))


def start(at_ms: float = 50, disturbed_ms: float | None = None) -> Start:
    """A boot-up, and what may have kept its EMCY back."""
    return Start(when(at_ms), FOREVER if disturbed_ms is None else round(disturbed_ms * MS))


def emcy(at: float | Interval, data: str = RIGHT) -> Emergency:
    """An EMCY of node 5."""
    wanted = at if isinstance(at, Interval) else when(at)
    return Emergency(wanted, Frame(0x085, bytes.fromhex(data)))


def judged(
    starts: Sequence[Start], seen: Sequence[Emergency] = (), until_ms: float = LATE
) -> list[Verdict]:
    """What is wrong; an EMCY may come 100 ms after its boot-up."""
    return list(judge_starts(starts, seen, 100 * MS, round(until_ms * MS)))


def blamed(
    starts: Sequence[Start], seen: Sequence[Emergency] = (), until_ms: float = LATE
) -> list[str]:
    """The requirements that are blamed."""
    return [verdict.requirement for verdict in judged(starts, seen, until_ms)]


def test_without_a_start_nothing_is_asked_for() -> None:
    """An EMCY by itself is the business of the monitor of allowed frames."""
    assert judged([]) == []
    assert judged([], [emcy(10, "00FF000000000000")]) == []


@pytest.mark.parametrize(("at_ms", "blame"), [(50, []), (150, []), (150.001, ["NMT-02"])])
def test_it_comes_within_its_limit(at_ms: float, blame: list[str]) -> None:
    """With the boot-up or at the limit is in time; later is too late."""
    assert blamed([start(50)], [emcy(at_ms)]) == blame


def test_one_that_is_missing_is_told_with_its_limit() -> None:
    """The verdict is certain, says what was waited for, and points at the limit."""
    (verdict,) = judged([start(50)])
    assert verdict.outcome is Outcome.FAIL
    assert verdict.text == "no EMCY within 100 ms after the boot-up"
    assert verdict.at == 150 * MS
    assert verdict.limits is not None
    assert verdict.limits.at_most_ns == 100 * MS


def test_one_before_the_boot_up_is_not_its_own() -> None:
    """The EMCY comes after the boot-up; a doubt about which came first is the device's."""
    assert blamed([start(50)], [emcy(49)]) == ["NMT-02"]
    assert blamed([start(50)], [emcy(when(40, 50))]) == []


def test_doubt_about_its_instant_is_the_devices() -> None:
    """One that may have been asked for in time was in time."""
    assert blamed([start(50)], [emcy(when(150, 400))]) == []
    assert blamed([start(50)], [emcy(when(151, 400))]) == ["NMT-02"]
    unsharp = Start(when(50, 60), FOREVER)
    assert blamed([unsharp], [emcy(160)]) == []
    assert blamed([unsharp], [emcy(160.001)]) == ["NMT-02"]


@pytest.mark.parametrize(("until_ms", "blame"), [(150, []), (150.001, ["NMT-02"])])
def test_what_may_still_come_is_not_missed(until_ms: float, blame: list[str]) -> None:
    """Nothing is missing before everything up to the limit was seen."""
    assert blamed([start(50)], until_ms=until_ms) == blame


@pytest.mark.parametrize(("disturbed_ms", "blame"), [(150, []), (150.001, ["NMT-02"])])
def test_what_came_between_may_have_kept_it_back(disturbed_ms: float, blame: list[str]) -> None:
    """A command or power-off before the limit excuses it, one after the limit does not."""
    assert blamed([start(50, disturbed_ms)]) == blame


def test_after_a_disturbance_an_emcy_is_not_held_against_this_start() -> None:
    """Its content counts only where it surely belongs to the boot-up."""
    wrong = "00FF010000000000"
    assert blamed([start(50, 90)], [emcy(90, wrong)]) == ["NMT-02"]
    assert blamed([start(50, 90)], [emcy(91, wrong)]) == []


@pytest.mark.parametrize(
    ("data", "blame"),
    [
        (RIGHT, []),
        ("0050810000000000", []),  # further bits of the register
        ("0051010000000000", ["NMT-02"]),
        ("004F010000000000", ["NMT-02"]),
        ("5000010000000000", ["NMT-02"]),  # high byte first
        ("0000000000000000", ["NMT-02"]),
        ("0150010000000000", ["NMT-20"]),
        ("FF50010000000000", ["NMT-20"]),
        ("0050000000000000", ["NMT-20"]),
        ("0050FE0000000000", ["NMT-20"]),
        ("0050010100000000", ["NMT-20"]),
        ("0050010000000080", ["NMT-20"]),
    ],
)
def test_it_tells_of_the_hardware(data: str, blame: list[str]) -> None:
    """50xxh little-endian is a must; 5000h, generic error and zeros are our own reading."""
    (verdict,) = judged([start(50)], [emcy(60, data)]) or (None,)
    assert ([verdict.requirement] if verdict else []) == blame
    assert verdict is None or f"085#{data}" in verdict.text.replace(" ", "")
    assert verdict is None or verdict.at == 60 * MS


def test_each_start_has_one_of_its_own() -> None:
    """What the second start sends does not make up for the first, nor the other way round."""
    both = [start(50), start(1050)]
    assert blamed(both, [emcy(60), emcy(1060)]) == []
    assert blamed(both, [emcy(1060)]) == ["NMT-02"]
    (late,) = judged(both, [emcy(60)])
    assert late.at == 1150 * MS
