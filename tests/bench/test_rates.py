"""Bit times by the place of a frame in its trace."""

from __future__ import annotations

from hil_tests.bench.rates import Rates


def test_a_frame_has_the_bit_time_that_counted_when_it_came() -> None:
    """The last one that was kept at or before its place; the first one before that."""
    rates = Rates(8_000)
    rates.keep(3, 4_000)
    rates.keep(5, 1_000)
    assert [rates.of(index) for index in range(7)] == [8_000] * 3 + [4_000] * 2 + [1_000] * 2


def test_what_changes_nothing_makes_no_stretch() -> None:
    """The same bit time again goes on with its stretch; an empty stretch is left out."""
    rates = Rates(8_000)
    rates.keep(2, 8_000)
    rates.keep(4, 4_000)
    rates.keep(4, 2_000)
    assert list(rates.stretches(6)) == [(0, 4, 8_000), (4, 6, 2_000)]
    assert list(rates.stretches(4)) == [(0, 4, 8_000)]
