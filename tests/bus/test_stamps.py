"""Foreign clocks followed onto ours, steps of the clock, and long waits made in two."""

from __future__ import annotations

import os
import select

import pytest

from hil_tests.bus.stamps import STEP_NS, Follower, StepWatch, patience_ns
from hil_tests.clock import FOREVER, MS, US, S


class Clocks:
    """A realtime and a monotonic clock that move together unless somebody sets one."""

    def __init__(self) -> None:
        self.monotonic_at = 5 * S
        self.offset = 1_700_000_000 * S
        self.pause_ns = 0

    def real(self) -> int:
        """CLOCK_REALTIME; the process may be stopped right after reading it."""
        found = self.monotonic_at + self.offset
        self.monotonic_at += self.pause_ns
        return found

    def monotonic(self) -> int:
        """CLOCK_MONOTONIC."""
        return self.monotonic_at


def test_stamps_follow_the_quickest_sight() -> None:
    """The smallest delay seen so far is taken for the offset of the clocks."""
    follower = Follower()

    assert follower.ours(1000, 11_000) == 11_000
    assert follower.ours(2000, 10_500) == 10_500
    assert follower.ours(3000, 19_000) == 11_500


def test_stamps_follow_a_drifting_clock() -> None:
    """Old minima are forgotten: a crystal that is 100 ppm fast stays within 2 ms."""
    follower = Follower()
    worst = 0
    for second in range(600):
        true_at = second * S
        stamp = true_at + true_at // 10_000
        found = follower.ours(stamp, true_at + 100 * US)
        worst = max(worst, abs(found - true_at))

    assert worst <= 2100 * US


def test_a_stamp_is_never_put_after_its_sight() -> None:
    """A frame ended before it was seen."""
    follower = Follower()

    for seen_at, stamp in ((10, 7), (20, 19), (30, 10), (40, 39), (60, 55)):
        assert follower.ours(stamp, seen_at) <= seen_at


@pytest.mark.parametrize("step", [STEP_NS + MS, -STEP_NS - MS, 3600 * S, -3600 * S])
def test_a_step_of_the_clock_is_told_once(step: int) -> None:
    """Setting the clock forward or back is seen, with its size, one time."""
    clocks = Clocks()
    watch = StepWatch(clocks.real, clocks.monotonic)
    clocks.offset += step

    assert watch.step() == step
    assert watch.step() == 0


def test_slewing_is_no_step() -> None:
    """NTP moves the clock by 500 ppm at most: that is no step, however long it lasts."""
    clocks = Clocks()
    watch = StepWatch(clocks.real, clocks.monotonic)
    for _ in range(100):
        clocks.monotonic_at += 60 * S
        clocks.offset += 30 * MS

        assert watch.step() == 0


def test_being_stopped_between_readings_is_no_step() -> None:
    """A pause of the process while it reads the clocks proves nothing."""
    clocks = Clocks()
    watch = StepWatch(clocks.real, clocks.monotonic)
    clocks.pause_ns = 3 * S

    assert watch.step() == 0
    clocks.pause_ns = 0
    assert watch.step() == 0


@pytest.mark.parametrize(
    ("left_ns", "wait_ns"),
    [(-1, 0), (0, 0), (5 * MS, 5 * MS), (5 * MS + 500, 4_990_499), (S, 998 * MS)],
)
def test_long_waits_are_made_in_two(left_ns: int, wait_ns: int) -> None:
    """Short waits are made at once, of long ones all but a five-hundredth."""
    assert patience_ns(left_ns) == pytest.approx(wait_ns, abs=1)


def test_the_longest_wait_is_one_that_select_takes() -> None:
    """An instant in the far future is no overflow."""
    reader, writer = os.pipe()
    os.write(writer, b"x")

    assert select.select([reader], [], [], patience_ns(FOREVER) / S)[0] == [reader]
    os.close(reader)
    os.close(writer)
