"""The oracle of commissioning: which message is taken, and its echo (COM-03..05, COM-20..24)."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import pytest

from hil_tests.clock import FOREVER, MS, Interval
from hil_tests.judge.echoes import Echo, EchoRules, Request, Stay, is_valid, judge_echoes, taken
from hil_tests.judge.verdict import Limits, Outcome, Verdict
from node_model.frame import Frame

RULES = EchoRules(Limits(90 * MS, 110 * MS), Limits(98 * MS, 102 * MS))
ONE = "050200640001"
TWO = "060300C80002"
LATE = 100_000


def asked(at_ms: float, data: str = ONE, can_id: int = 0x4F8, **kind: bool) -> Request:
    """A frame of the tester that ended then."""
    return Request(round(at_ms * MS), Frame(can_id, bytes.fromhex(data), **kind))


def echo(first_ms: float, data: str = ONE, last_ms: float | None = None) -> Echo:
    """An echo that was asked for then, or between two instants."""
    last_ms = first_ms if last_ms is None else last_ms
    return Echo(Interval(round(first_ms * MS), round(last_ms * MS)), bytes.fromhex(data))


def row(first_ms: float, count: int, every_ms: float = 100, data: str = ONE) -> list[Echo]:
    """Echoes at a regular distance."""
    return [echo(first_ms + index * every_ms, data) for index in range(count)]


def judged(
    requests: Sequence[Request],
    echoes: Iterable[Echo] = (),
    until_ms: float | None = None,
    ready_ms: float = 0,
) -> list[Verdict]:
    """What is wrong with a stay; it ends 50 ms after its last echo unless told otherwise."""
    echoes = list(echoes)
    if until_ms is None:
        until_ms = echoes[-1].wanted.latest / MS + 50 if echoes else LATE
    return list(
        judge_echoes(Stay(round(ready_ms * MS), requests, echoes, round(until_ms * MS)), RULES)
    )


def blamed(
    requests: Sequence[Request],
    echoes: Iterable[Echo] = (),
    until_ms: float | None = None,
    ready_ms: float = 0,
) -> list[str]:
    """The requirements that are blamed; every verdict here is certain."""
    found = judged(requests, echoes, until_ms, ready_ms)
    assert all(verdict.outcome is Outcome.FAIL for verdict in found)
    return [verdict.requirement for verdict in found]


# The one message (COM-04, COM-08, COM-22, COM-24).


@pytest.mark.parametrize(
    ("data", "valid"),
    [
        ("010000000000", True),
        ("0FFFFFFFFFFF", True),
        ("000200640001", False),
        ("100200640001", False),
        ("FF0200640001", False),
        ("0502006400", False),
        ("", False),
        (ONE + "AA", True),
        (ONE + "AA55", True),
    ],
)
def test_six_bytes_and_a_node_id_make_the_message(data: str, valid: bool) -> None:
    """Node ids 1..15 and six bytes or more; what the others mean is not asked."""
    assert is_valid(Frame(0x4F8, bytes.fromhex(data))) is valid


def test_another_kind_of_frame_is_not_the_message() -> None:
    """Neither another identifier, nor an extended or a remote frame with that one."""
    data = bytes.fromhex(ONE)
    assert not is_valid(Frame(0x4F9, data))
    assert not is_valid(Frame(0x4F8, data, extended=True))
    assert not is_valid(Frame(0x4F8, dlc=6, remote=True))


def test_the_first_valid_one_is_taken() -> None:
    """What came before it was none, what comes later is too late."""
    requests = [asked(1, "00" + ONE[2:]), asked(2, TWO), asked(3, ONE)]
    assert taken(requests) is requests[1]
    assert taken(requests[:1]) is None
    assert taken([]) is None


# Nothing was asked for.


def test_a_wait_without_a_message_is_silent() -> None:
    """No message, no echo: nothing is wrong."""
    assert judged([]) == []
    assert judged([asked(10, "00" + ONE[2:]), asked(20, ONE, 0x123)]) == []


def test_an_echo_before_any_frame_is_told_by_the_monitor() -> None:
    """Nobody asked at all: the monitor of allowed frames blames it, once."""
    assert judged([], [echo(10)]) == []
    assert judged([asked(50)], [echo(10), echo(60)]) == []


@pytest.mark.parametrize(
    ("lure", "blame"),
    [
        (asked(10, "00" + ONE[2:]), "COM-22"),
        (asked(10, "10" + ONE[2:]), "COM-22"),
        (asked(10, ONE[:10]), "COM-24"),
        (asked(10, ONE, extended=True), "COM-24"),
        (Request(10 * MS, Frame(0x4F8, dlc=6, remote=True)), "COM-24"),
        (asked(10, ONE, 0x13E00000, extended=True), "COM-24"),
        (asked(10, ONE, 0x123), "COM-03"),
        (asked(10, ONE, 0x605), "COM-03"),
        (asked(10, ONE, 0x000), "COM-20"),
        (asked(10, "", 0x080), "COM-20"),
        (asked(10, ONE, 0x7E4), "COM-20"),
        (asked(10, ONE, 0x7E5), "COM-20"),
        (Request(10 * MS, Frame(0x3F8, dlc=6, remote=True)), "COM-20"),
    ],
)
def test_an_echo_of_what_is_no_message(lure: Request, blame: str) -> None:
    """The requirement says why that frame was to be ignored; the text shows the frame."""
    (verdict,) = judged([lure], [echo(20)])
    assert verdict.requirement == blame
    assert verdict.outcome is Outcome.FAIL
    assert str(lure.frame) in verdict.text
    assert verdict.at == 20 * MS


def test_the_frame_whose_bytes_it_shows_is_what_it_answers() -> None:
    """Among several the one that is echoed is blamed, else the last before the echo."""
    short, other = asked(10, ONE[:10]), asked(20, TWO, 0x123)
    assert blamed([short, other], [echo(30, ONE[:10])]) == ["COM-24"]
    assert blamed([short, other], [echo(30, TWO)]) == ["COM-03"]
    assert blamed([short, other], [echo(30, "FFFFFFFFFFFF")]) == ["COM-03"]
    assert blamed([short, other], [echo(15, TWO)]) == ["COM-24"]


def test_an_echo_too_early_for_the_message_answers_what_was_before() -> None:
    """It was asked for before the message had ended, so another frame made it."""
    requests = [asked(10, ONE, 0x123), asked(50)]
    assert blamed(requests, [echo(20)], ready_ms=0) == ["COM-03"]
    assert blamed(requests, [echo(20, last_ms=50)], until_ms=100) == []


# What it shows (COM-05, COM-21).


@pytest.mark.parametrize("size", [6, 7, 8])
def test_six_bytes_count(size: int) -> None:
    """The length of the echo and what stands past the sixth byte are the maker's (COM-25)."""
    longer = (ONE + "AA55")[: 2 * size]
    assert blamed([asked(10)], row(20, 3, data=longer)) == []
    assert blamed([asked(10, longer)], row(20, 3)) == []


@pytest.mark.parametrize("byte", range(6))
def test_each_of_the_six_bytes_is_the_one_received(byte: int) -> None:
    """One wrong bit is enough, in the first echo or in a later one."""
    wrong = bytearray.fromhex(ONE)
    wrong[byte] ^= 0x10
    (verdict,) = judged([asked(10)], [*row(20, 2), echo(220, wrong.hex())])
    assert verdict.requirement == "COM-05"
    assert wrong.hex(" ").upper() in verdict.text
    assert verdict.at == 220 * MS


def test_a_shorter_echo_does_not_show_the_parameters() -> None:
    """Five bytes are not six."""
    assert blamed([asked(10)], row(20, 3, data=ONE[:10])) == ["COM-05"]


def test_a_second_message_changes_nothing() -> None:
    """The echo goes on with the first; one that shows the second is blamed for that."""
    requests = [asked(10), asked(250, TWO)]
    assert blamed(requests, row(20, 6)) == []
    assert blamed(requests, [*row(20, 3), *row(320, 3, data=TWO)]) == ["COM-21"]


# When it comes (COM-04, COM-05, COM-24).


@pytest.mark.parametrize(("first_ms", "blame"), [(10, []), (120, []), (120.001, ["COM-05"])])
def test_the_first_comes_after_a_period_at_most(first_ms: float, blame: list[str]) -> None:
    """At once is as good as one period after the message, with its tolerance."""
    assert blamed([asked(10)], row(first_ms, 3)) == blame


@pytest.mark.parametrize(
    ("every_ms", "blame"), [(89.999, ["COM-05"]), (90, []), (110, []), (110.001, ["COM-05"])]
)
def test_each_interval_lies_within_its_limits(every_ms: float, blame: list[str]) -> None:
    """Ten milliseconds to either side, both ends allowed."""
    assert blamed([asked(10)], row(20, 4, every_ms), 20 + 3 * every_ms + 50) == blame


def test_the_first_interval_that_is_wrong_is_told() -> None:
    """Number, measure and limits are named, and others are not."""
    (verdict,) = judged([asked(10)], [*row(20, 3), *row(350, 3, 150)], 700)
    assert verdict.text == "interval 3 of the echo"
    assert verdict.measured == Interval(130 * MS, 130 * MS)
    assert verdict.limits == RULES.each
    assert verdict.at == 350 * MS


def test_doubt_about_an_interval_is_the_devices() -> None:
    """An interval fails only where none of its possible lengths is right."""
    assert blamed([asked(10)], [echo(20), echo(120, last_ms=200)], 250) == []
    assert blamed([asked(10)], [echo(20), echo(131, last_ms=200)], 250) == ["COM-05"]


@pytest.mark.parametrize(
    ("every_ms", "count", "blame"),
    [(102, 21, []), (102.1, 21, ["COM-05"]), (97.9, 21, ["COM-05"]), (102.1, 20, [])],
)
def test_twenty_intervals_have_a_mean(every_ms: float, count: int, blame: list[str]) -> None:
    """It lies within two per cent; fewer intervals have none."""
    found = judged([asked(10)], row(20, count, every_ms), 20 + (count - 1) * every_ms + 50)
    assert [verdict.requirement for verdict in found] == blame
    assert all(verdict.text == "mean of 20 intervals of the echo" for verdict in found)


@pytest.mark.parametrize(("until_ms", "blame"), [(120, []), (120.001, ["COM-04"])])
def test_a_message_without_an_echo(until_ms: float, blame: list[str]) -> None:
    """The wait has not ended: that is COM-04, once the first echo is overdue."""
    assert blamed([asked(10)], until_ms=until_ms) == blame


def test_a_longer_message_without_an_echo() -> None:
    """Bytes past the sixth mean nothing; a device that refuses them breaks COM-24."""
    assert blamed([asked(10, ONE + "AA")]) == ["COM-24"]


@pytest.mark.parametrize(("until_ms", "blame"), [(330, []), (330.001, ["COM-05"])])
def test_an_echo_that_ends(until_ms: float, blame: list[str]) -> None:
    """It goes on until power is cut; the silence is measured from the last one."""
    found = judged([asked(10)], row(20, 3), until_ms)
    assert [verdict.requirement for verdict in found] == blame
    assert all(verdict.at == 330 * MS for verdict in found)


@pytest.mark.parametrize(
    ("at_ms", "can_id", "blame"),
    [
        (219, 0x000, "COM-05"),
        (220, 0x000, "COM-20"),
        (330, 0x7E5, "COM-20"),
        (331, 0x000, "COM-05"),
        (250, 0x123, "COM-05"),
    ],
)
def test_an_echo_that_is_ended_by_a_service(at_ms: float, can_id: int, blame: str) -> None:
    """That NMT, SYNC and LSS are ignored is a reading of ours; garbage ends nothing at all."""
    assert blamed([asked(10), asked(at_ms, "0200", can_id)], row(20, 3), 1000) == [blame]


def test_a_message_that_may_have_come_too_early() -> None:
    """Before the device surely waits it may be missed; once it is echoed all else counts."""
    early = [asked(10)]
    assert blamed(early, ready_ms=10.001) == []
    assert blamed(early, ready_ms=10) == ["COM-04"]
    assert blamed(early, row(500, 3), ready_ms=1000) == []
    assert blamed(early, row(500, 3, 120), 800, ready_ms=1000) == ["COM-05"]
    assert blamed(early, row(500, 3), 1000, ready_ms=1000) == ["COM-05"]


def test_the_message_after_one_that_was_missed() -> None:
    """The first message that the device surely hears is taken, unless an earlier one was."""
    requests = [asked(10), asked(1100, TWO), asked(1200, "0C0200640002")]
    assert blamed(requests, row(1110, 4, data=TWO), ready_ms=1000) == []
    assert blamed(requests, row(500, 8), ready_ms=1000) == []
    assert blamed(requests, until_ms=FOREVER / MS / 2, ready_ms=1000) == ["COM-04"]
    third = row(1210, 4, data="0C0200640002")
    assert blamed(requests, third, ready_ms=1000) == ["COM-21"]
