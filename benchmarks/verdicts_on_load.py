"""Timing verdicts on a loaded bus, in virtual time, where the truth is known.

    python -m benchmarks.verdicts_on_load [--seconds 600] [--jobs 2]

A device beats every 100 ms and is held to 1 % either way, by causal intervals and, beside
that, by plain differences of stamps. The right device asks for each beat up to 0.25 % of
the period before or after its place on a fixed grid, so that two requests are at most 0.5 %
off; the wrong one does the same on a grid of 101.5 ms. Two stations load the wire, one with
frames of higher priority than the beat, one with lower, 0 to 8 bytes long.

The truth about an interval is the difference of the instants of request, which the world
knows, against the limit. A verdict is false where it passes what is wrong or fails what is
right. Ends with status 1 where the project's bar is missed: no false verdict, on no
interval and not on the whole; the truth always inside; at 125 kbit/s and 30 % load at most
20 % of the intervals (of both devices together) inconclusive and no verdict on the whole.

How many stay inconclusive is not the judge's to choose: a beat behind another frame can have
been asked for at any instant while that was sent, and nothing on the wire tells which.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from itertools import pairwise
from statistics import fmean

from benchmarks.tables import against, show
from hil_tests.clock import Interval, exactly
from hil_tests.judge.causal import CausalClock
from hil_tests.judge.periodic import around, judge_periodic
from hil_tests.judge.verdict import Outcome
from hil_tests.trace import Sighting
from node_model.frame import INTERMISSION_BITS, Frame
from node_model.load import Load
from node_model.node import MS, NOTHING, US, Frames, S
from node_model.world import World

PERIOD_NS = 100 * MS
LIMITS = around(PERIOD_NS, PERIOD_NS // 100)
JITTER_NS = 250 * US
WRONG_PERIOD_NS = PERIOD_NS * 1015 // 1000
BEAT_ID = 0x70A
BIT_RATES = (1_000_000, 125_000, 50_000)
LOADS_PERCENT = (0, 30, 60, 90)
MOST_INCONCLUSIVE = 0.2
"""Share of the intervals at `BAR`."""
BAR = (125_000, 30)
"""Bit rate and load in percent at which the bar says how much may stay undecided."""

_MULTIPLIER, _INCREMENT, _MODULUS = 6364136223846793005, 1442695040888963407, 1 << 64
"""Knuth's MMIX generator: the same on every machine."""


class Metronome:
    """A node that does nothing but beat: on a grid, each beat a little early or late.

    Args:
        period_ns: of the grid.
        jitter_ns: at most so far from the grid.
        bit_rate: bit/s.
        seed: of the sequence of jitters.
    """

    listens_to: frozenset[int] | None = frozenset()

    def __init__(self, period_ns: int, jitter_ns: int, bit_rate: int, seed: int = 1) -> None:
        self.bit_rate = bit_rate
        self._period_ns = period_ns
        self._jitter_ns = jitter_ns
        self._state = seed
        self._beats: Frames = (Frame(BEAT_ID, b"\x05"),)
        self._grid_at = 0
        self._due_at = 0
        self._plan()

    def _plan(self) -> None:
        """When the next beat is asked for."""
        self._state = (self._state * _MULTIPLIER + _INCREMENT) % _MODULUS
        self._grid_at += self._period_ns
        spread = 2 * self._jitter_ns + 1
        self._due_at = self._grid_at - self._jitter_ns + (self._state >> 32) * spread // (1 << 32)

    def power_on(self, now: int) -> Frames:  # noqa: ARG002  a verb of every node
        """It beats already."""
        return NOTHING

    def power_off(self, now: int) -> Frames:  # noqa: ARG002  a verb of every node
        """It beats on."""
        return NOTHING

    def receive(self, frame: Frame, now: int) -> Frames:  # noqa: ARG002  a verb of every node
        """It heeds nothing."""
        return NOTHING

    def advance(self, now: int) -> Frames:
        """The beats that are due."""
        frames = NOTHING
        while self._due_at <= now:
            frames = (*frames, *self._beats)
            self._plan()
        return frames

    def deadline(self) -> int | None:
        """The next beat."""
        return self._due_at


def load_frames(base: int, step: int) -> list[Frame]:
    """Sixteen frames of 0 to 8 bytes, of various content and so of various stuffing."""
    return [
        Frame(base + step * turn, bytes(turn * 37 * place & 0xFF for place in range(turn * 5 % 9)))
        for turn in range(16)
    ]


HIGHER = load_frames(0x080, 0x61)
LOWER = load_frames(0x710, 0x0D)


@dataclass(frozen=True, slots=True)
class Case:
    """One line of the table.

    Args:
        bit_rate: bit/s.
        load_percent: asked for by the loading stations together.
        right: whether the device keeps its period.
        span_ns: how long it is watched.
    """

    bit_rate: int
    load_percent: int
    right: bool
    span_ns: int

    def world(self) -> World:
        """Device, loading stations and a tester on a wire."""
        world = World(self.bit_rate)
        world.attach()
        period_ns = PERIOD_NS if self.right else WRONG_PERIOD_NS
        world.attach(Metronome(period_ns, JITTER_NS, self.bit_rate))
        for seed, frames in enumerate((HIGHER, LOWER) if self.load_percent else (), 1):
            load = Load(frames, self.load_percent * 5000, self.bit_rate, seed)
            world.act(world.attach(load, depth=4), load.power_on)
        return world


@dataclass(frozen=True, slots=True)
class Watched:
    """What was seen of the beats, and what was true.

    Args:
        wanted: causal interval of each beat.
        stamps: end of each beat.
        truths: when each was asked for.
        busy_ns: how long the wire was taken.
    """

    wanted: Sequence[Interval]
    stamps: Sequence[Interval]
    truths: Sequence[Interval]
    busy_ns: int


def watch(case: Case) -> Watched:
    """Runs a case."""
    world = case.world()
    bit_ns = world.bit_ns
    clock = CausalClock(bit_ns, lambda frame: frame.can_id == BEAT_ID, since=0)
    wanted, stamps, truths = list[Interval](), list[Interval](), list[Interval]()
    busy_bits = 0
    while (delivery := world.next_frame(case.span_ns)) is not None:
        frame, at, _, wanted_at = delivery
        seen = clock.see(Sighting(frame, at), 0)
        busy_bits += frame.bits + INTERMISSION_BITS
        if frame.can_id == BEAT_ID:
            wanted.append(seen.wanted)
            stamps.append(exactly(at))
            truths.append(exactly(wanted_at))
    return Watched(wanted, stamps, truths, busy_bits * bit_ns)


def spans(beats: Sequence[Interval]) -> Iterator[Outcome]:
    """The verdict on each interval."""
    return (LIMITS.check(late.since(early)) for early, late in pairwise(beats))


def false_among(beats: Sequence[Interval], truths: Sequence[Interval]) -> int:
    """How many intervals were judged wrongly."""
    judged = zip(spans(beats), spans(truths), strict=True)
    return sum(said is not true and said is not Outcome.INCONCLUSIVE for said, true in judged)


def whole(beats: Sequence[Interval]) -> Outcome:
    """The verdict on the row."""
    return judge_periodic("heartbeat", beats, LIMITS, LIMITS).outcome


@dataclass(frozen=True, slots=True)
class Result:
    """What a case showed.

    Args:
        case: which.
        load: share of the wire that was taken, 0..1.
        intervals: between beats.
        inside: beats whose request lay in the causal interval.
        false: intervals judged wrongly by causal intervals.
        inconclusive: intervals left undecided by them.
        verdict: on the whole, by them.
        plain_false: intervals judged wrongly by differences of stamps.
        plain_verdict: on the whole, by those.
    """

    case: Case
    load: float
    intervals: int
    inside: int
    false: int
    inconclusive: int
    verdict: Outcome
    plain_false: int
    plain_verdict: Outcome

    @property
    def expected(self) -> Outcome:
        """The true verdict on the whole."""
        return Outcome.PASS if self.case.right else Outcome.FAIL

    @property
    def undecided(self) -> float:
        """Share of the inconclusive intervals."""
        return self.inconclusive / self.intervals

    @property
    def misses(self) -> list[str]:
        """Where the bar is missed."""
        found = []
        if self.inside != self.intervals + 1:
            found.append("truth outside")
        if self.false:
            found.append("false interval")
        if self.verdict not in {self.expected, Outcome.INCONCLUSIVE}:
            found.append("false verdict")
        if self.at_bar and self.verdict is Outcome.INCONCLUSIVE:
            found.append("no verdict")
        return found

    @property
    def at_bar(self) -> bool:
        """Whether the bar says how much may stay undecided here."""
        return (self.case.bit_rate, self.case.load_percent) == BAR


def undecided(results: Iterable[Result]) -> float:
    """Share of the inconclusive intervals among all of these."""
    return fmean(result.undecided for result in results)


def judge(case: Case) -> Result:
    """Runs a case and judges it both ways."""
    seen = watch(case)
    inside = sum(
        want.earliest <= true.earliest <= want.latest
        for want, true in zip(seen.wanted, seen.truths, strict=True)
    )
    return Result(
        case,
        seen.busy_ns / case.span_ns,
        len(seen.wanted) - 1,
        inside,
        false_among(seen.wanted, seen.truths),
        sum(outcome is Outcome.INCONCLUSIVE for outcome in spans(seen.wanted)),
        whole(seen.wanted),
        false_among(seen.stamps, seen.truths),
        whole(seen.stamps),
    )


def cases(span_ns: int) -> list[Case]:
    """All lines of the table, the longest to run first."""
    return [
        Case(bit_rate, load, right, span_ns)
        for bit_rate in BIT_RATES
        for load in LOADS_PERCENT
        for right in (True, False)
    ]


def row(result: Result) -> list[str]:
    """A line of the table."""
    case = result.case
    plain = result.plain_verdict
    return [
        f"{case.bit_rate // 1000} kbit/s, {case.load_percent} %",
        "right" if case.right else "wrong",
        f"{result.load:.1%}",
        f"{result.intervals}",
        f"{result.inside / (result.intervals + 1):.2%}",
        f"{result.false}",
        f"{result.undecided:.1%}",
        result.verdict.value,
        f"{result.plain_false / result.intervals:.1%}",
        plain.value + ("" if plain is result.expected else ": FALSE"),
        ", ".join(result.misses) or "kept",
    ]


HEADS = (
    "bit rate, load",
    "device",
    "wire taken",
    "intervals",
    "truth inside",
    "false",
    "inconclusive",
    "whole",
    "stamps: false",
    "whole",
    "bar",
)


def main() -> int:
    """Runs all cases and prints the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--seconds", type=int, default=600, help="bus time of each case")
    parser.add_argument("--jobs", type=int, default=os.cpu_count(), help="processes")
    options = parser.parse_args()
    with ProcessPoolExecutor(options.jobs) as pool:
        results = list(pool.map(judge, cases(options.seconds * S)))
    title = f"Heartbeat of 100 ms held to 1 %, {options.seconds} s each: causal intervals, stamps"
    show(title, HEADS, map(row, results))
    share = undecided(result for result in results if result.at_bar)
    bar = against(100 * share, 100 * MOST_INCONCLUSIVE, least=False)
    print(f"\nInconclusive at {BAR[0] // 1000} kbit/s and {BAR[1]} %: {share:.1%}, bar {bar}")
    kept = share <= MOST_INCONCLUSIVE and not any(result.misses for result in results)
    return 0 if kept else 1


if __name__ == "__main__":
    sys.exit(main())
