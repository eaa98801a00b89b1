"""Periodic services: each interval and the mean, judged from both sides of their limits."""

from __future__ import annotations

from collections.abc import Iterable

import pytest

from hil_tests.clock import MS, Interval, exactly
from hil_tests.judge.periodic import ENOUGH, around, judge_periodic, mean_interval, survey
from hil_tests.judge.verdict import Limits, Outcome, Verdict

PERIOD = 100 * MS
EACH = around(PERIOD, MS)
MEAN = around(PERIOD, MS // 2)


def row(spans: Iterable[int], doubt_ns: int = 0) -> list[Interval]:
    """Beats with these distances, each known to `doubt_ns`."""
    at = 0
    beats = [Interval(-doubt_ns, 0)]
    for span in spans:
        at += span
        beats.append(Interval(at - doubt_ns, at))
    return beats


def verdict_on(beats: list[Interval]) -> Verdict:
    """On a heartbeat of 100 ms, 1 ms each way and half a ms in the mean."""
    return judge_periodic("heartbeat", beats, EACH, MEAN, "HB-01")


def test_enough_right_intervals_pass() -> None:
    """Twenty intervals that lie clearly inside, and their mean, are a PASS."""
    verdict = verdict_on(row([PERIOD] * ENOUGH))

    assert verdict.outcome is Outcome.PASS
    assert verdict.requirement == "HB-01"
    assert verdict.text == "heartbeat: 20 intervals, 20 conclusive, mean 100 ms"


def test_one_interval_less_is_not_enough() -> None:
    """Nineteen right intervals prove nothing yet, and the verdict says what it needs."""
    verdict = verdict_on(row([PERIOD] * (ENOUGH - 1)))

    assert verdict.outcome is Outcome.INCONCLUSIVE
    assert verdict.text.endswith("a verdict needs 20 conclusive ones")


@pytest.mark.parametrize("span", [99 * MS, 101 * MS])
def test_intervals_at_the_limit_pass(span: int) -> None:
    """Both ends of the limit are allowed."""
    assert verdict_on(row([span, 200 * MS - span] * 10)).outcome is Outcome.PASS


@pytest.mark.parametrize("span", [99 * MS - 1, 101 * MS + 1])
def test_one_wrong_interval_fails_at_once(span: int) -> None:
    """One interval outside is a FAIL, however few there are; the verdict shows which and where."""
    beats = row([PERIOD, span, PERIOD])
    verdict = verdict_on(beats)

    assert verdict.outcome is Outcome.FAIL
    assert verdict.measured == exactly(span)
    assert verdict.limits == EACH
    assert verdict.at == beats[2].latest
    assert "interval 2 of 3" in verdict.text


def test_the_first_wrong_interval_is_the_one_shown() -> None:
    """Later ones, even worse, do not hide the first."""
    seen = survey(row([PERIOD, 102 * MS, 150 * MS]), EACH, MEAN)

    assert (seen.failed, seen.worst) == (2, exactly(102 * MS))


def test_a_doubt_across_the_limit_is_no_failure() -> None:
    """An interval whose doubt straddles the limit counts neither way."""
    beats = row([PERIOD] * 10 + [102 * MS - 1, 98 * MS] + [PERIOD] * 12)
    beats[11] = Interval(beats[11].latest - MS, beats[11].latest)
    seen = survey(beats, EACH, MEAN)

    assert seen.failed is None
    assert (seen.intervals, seen.conclusive) == (24, 22)
    assert seen.inconclusive_share == pytest.approx(2 / 24)
    assert verdict_on(beats).outcome is Outcome.PASS


def test_a_row_of_doubts_is_inconclusive() -> None:
    """Where no interval is clear there is no verdict, though the mean passes."""
    verdict = verdict_on(row([PERIOD] * 40, doubt_ns=MS + 1))

    assert verdict.outcome is Outcome.INCONCLUSIVE
    assert verdict.text == (
        "heartbeat: 40 intervals, 0 conclusive; a verdict needs 20 conclusive ones"
    )


@pytest.mark.parametrize("off", [-MS // 2 - 1, MS // 2 + 1])
def test_a_wrong_mean_fails_though_each_interval_is_right(off: int) -> None:
    """A drift that no single interval shows is found in the mean."""
    verdict = verdict_on(row([PERIOD + off] * ENOUGH))

    assert verdict.outcome is Outcome.FAIL
    assert verdict.limits == MEAN
    assert verdict.measured == exactly(PERIOD + off)


@pytest.mark.parametrize("off", [-MS // 2, MS // 2])
def test_a_mean_at_its_limit_passes(off: int) -> None:
    """Both ends of the mean's limit are allowed."""
    assert verdict_on(row([PERIOD + off] * ENOUGH)).outcome is Outcome.PASS


def test_the_mean_of_a_few_is_not_judged() -> None:
    """A wrong mean of nineteen intervals is no verdict yet."""
    verdict = verdict_on(row([PERIOD + MS // 2 + 1] * (ENOUGH - 1)))

    assert verdict.outcome is Outcome.INCONCLUSIVE
    assert "a clear mean (now 100.501 ms" in verdict.text or "and a clear mean" in verdict.text


def test_a_doubtful_mean_is_inconclusive() -> None:
    """Enough clear intervals, but the mean's doubt lies across its limit."""
    beats = row([PERIOD + MS // 2] * ENOUGH)
    beats[0] = Interval(-2, 0)
    verdict = verdict_on(beats)

    assert verdict.outcome is Outcome.INCONCLUSIVE
    assert "and a clear mean" in verdict.text


def test_the_mean_is_rounded_outwards() -> None:
    """A mean that is no whole number of ns keeps both neighbours as its doubt."""
    assert mean_interval(row([10, 10, 11])) == Interval(10, 11)
    assert mean_interval(row([10, 10])) == exactly(10)


@pytest.mark.parametrize("beats", [[], [exactly(5)]])
def test_without_an_interval_there_is_no_verdict(beats: list[Interval]) -> None:
    """No beat or one beat: nothing was measured."""
    seen = survey(beats, EACH, MEAN)

    assert (seen.intervals, seen.mean, seen.worst) == (0, None, None)
    assert seen.inconclusive_share == 0.0
    assert verdict_on(beats).outcome is Outcome.INCONCLUSIVE


def test_the_worst_of_a_good_row_is_the_one_nearest_a_limit() -> None:
    """A PASS shows the interval that came nearest to failing."""
    verdict = verdict_on(row([PERIOD] * 10 + [PERIOD - 900_000, PERIOD + 900_001] + [PERIOD] * 10))

    assert verdict.measured == exactly(PERIOD + 900_001)


def test_how_many_are_enough_can_be_said() -> None:
    """A short observation with a lower bar of its own is judged by that."""
    beats = row([PERIOD] * 3)

    assert judge_periodic("node guard", beats, EACH, MEAN, enough=3).outcome is Outcome.PASS
    assert judge_periodic("node guard", beats, EACH, MEAN, enough=4).outcome is not Outcome.PASS


def test_limits_lie_around_the_period() -> None:
    """The tolerance counts both ways, and cannot be negative."""
    assert around(100, 1) == Limits(99, 101)
    assert around(100, 0) == Limits(100, 100)
    with pytest.raises(ValueError, match="tolerance -1 ns is negative"):
        around(100, -1)
