"""Instants, intervals and spans: arithmetic of doubt, reading and showing times."""

from __future__ import annotations

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from hil_tests.clock import (
    FOREVER,
    MS,
    US,
    Interval,
    S,
    exactly,
    parse_span,
    show_interval,
    show_span,
)

instants = st.integers(-FOREVER, FOREVER)
spans = st.integers(-(10**15), 10**15)


@st.composite
def intervals(draw: st.DrawFn) -> Interval:
    """Any interval, those of one instant included."""
    one, other = draw(spans), draw(spans)
    return Interval(min(one, other), max(one, other))


# Intervals


@given(instants)
def test_an_exact_instant_has_no_doubt(instant: int) -> None:
    """An instant known to the nanosecond is an interval without width."""
    assert exactly(instant) == Interval(instant, instant)
    assert exactly(instant).doubt_ns == 0


@given(intervals(), intervals(), st.data())
def test_a_duration_between_doubtful_instants_holds_the_true_one(
    begin: Interval, end: Interval, data: st.DataObject
) -> None:
    """Wherever in their intervals two instants really lay, their difference is inside."""
    began_at = data.draw(st.integers(begin.earliest, begin.latest))
    ended_at = data.draw(st.integers(end.earliest, end.latest))
    duration = end.since(begin)
    assert duration.earliest <= ended_at - began_at <= duration.latest


@given(intervals(), intervals())
def test_doubts_add_up(begin: Interval, end: Interval) -> None:
    """The doubt of a duration is the sum of the doubts of its ends, no more."""
    assert end.since(begin).doubt_ns == begin.doubt_ns + end.doubt_ns


@given(intervals(), spans)
def test_shifting_keeps_the_doubt(interval: Interval, span_ns: int) -> None:
    """An interval that is moved keeps its width, and moving it back gives it again."""
    moved = interval.shifted(span_ns)
    assert moved.earliest == interval.earliest + span_ns
    assert moved.doubt_ns == interval.doubt_ns
    assert moved.shifted(-span_ns) == interval


# Reading a span


@pytest.mark.parametrize(
    ("text", "span_ns"),
    [
        ("0 ms", 0),
        ("1 ns", 1),
        ("20 us", 20 * US),
        ("500 ms", 500 * MS),
        ("1 s", S),
        ("2 min", 120 * S),
        ("1 h", 3600 * S),
        ("1.5 ms", 1_500 * US),
        ("0.000000001 s", 1),
        ("0.5 h", 1800 * S),
        ("500ms", 500 * MS),
        ("  7 s  ", 7 * S),
        ("1.0 ns", 1),
    ],
)
def test_a_number_with_a_unit_is_a_span(text: str, span_ns: int) -> None:
    """Every unit is read exactly, with or without spaces and decimals."""
    assert parse_span(text) == span_ns


@pytest.mark.parametrize(
    "text", ["", "500", "ms", "5 parsecs", "-1 ms", "+1 ms", "1e3 ms", ".5 s", "1. s", "1 s 2 ms"]
)
def test_a_text_that_is_no_span_is_refused_with_the_units(text: str) -> None:
    """The error shows the text and names the units that there are."""
    with pytest.raises(ValueError, match=r"is no time: .* ns, us, ms, s, min, h") as error:
        parse_span(text)
    assert repr(text) in str(error.value)


@pytest.mark.parametrize(("good", "bad"), [("0.001 us", "0.0001 us"), ("0.5 us", "0.5 ns")])
def test_a_fraction_of_a_nanosecond_is_refused(good: str, bad: str) -> None:
    """What is a whole number of nanoseconds is read; a digit further is an error."""
    assert parse_span(good) > 0
    with pytest.raises(ValueError, match="no whole number of nanoseconds"):
        parse_span(bad)


# Showing a span


@pytest.mark.parametrize(
    ("span_ns", "text"),
    [
        (0, "0 ns"),
        (1, "1 ns"),
        (999, "999 ns"),
        (1_000, "1 us"),
        (1_500, "1.5 us"),
        (-1_500, "-1.5 us"),
        (999_000, "999 us"),
        (1_000_000, "1 ms"),
        (99_876_543, "99.877 ms"),
        (100_000_000, "100 ms"),
        (1_000_000_000, "1 s"),
        (1_001_000_000, "1001 ms"),
        (1_500_000_000, "1500 ms"),
        (2_000_000_000, "2 s"),
        (9_999_000_000, "9999 ms"),
        (10_500_000_000, "10.5 s"),
        (65_535_000_000, "65.535 s"),
        (3_600_000_000_000, "3600 s"),
    ],
)
def test_a_span_is_shown_in_the_unit_that_suits_it(span_ns: int, text: str) -> None:
    """Three decimals at most, no idle zeros; below 10 s broken seconds read as ms."""
    assert show_span(span_ns) == text


@given(st.integers(0, 10**15))
@example(999_999_999)
@example(9_999_999_999)
def test_what_is_shown_reads_back_to_three_decimals(span_ns: int) -> None:
    """Reading a shown span gives it back, at worst off by half of its last decimal."""
    scale = next((unit for unit in (S, MS, US) if span_ns >= unit), 1)
    assert abs(parse_span(show_span(span_ns)) - span_ns) <= scale / 2_000


@given(st.integers(0, 10_000_000))
def test_whole_microseconds_below_ten_seconds_are_shown_exactly(span_us: int) -> None:
    """The values of limits, heartbeats and debounce times survive showing."""
    assert parse_span(show_span(span_us * US)) == span_us * US


@given(st.integers(1, 10**15))
def test_a_negative_span_is_shown_like_a_positive_one(span_ns: int) -> None:
    """Only the sign differs."""
    assert show_span(-span_ns) == f"-{show_span(span_ns)}"


def test_an_exact_duration_is_shown_as_one_value() -> None:
    """Without doubt there is one number."""
    assert show_interval(exactly(99_800_000)) == "99.8 ms"


def test_a_doubtful_duration_is_shown_by_its_ends() -> None:
    """With doubt both ends are shown."""
    assert show_interval(Interval(99_800_000, 100_400_000)) == "99.8 ms .. 100.4 ms"
