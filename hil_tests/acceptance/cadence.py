"""Rows of heartbeats, and the verdict on them: what the heartbeat tests share."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from hil_tests.acceptance.nmt_steps import enter
from hil_tests.api import (
    MS,
    EventKind,
    Interval,
    KeypadBench,
    NotRun,
    Outcome,
    S,
    Seen,
    State,
    exactly,
    judge_periodic,
    matchers,
)
from hil_tests.judge.periodic import ENOUGH

LONG_PERIOD_MS = 5000
"""Where time is real, few intervals of longer periods are waited for."""

FEW = 3

SPARE = 4
"""More intervals than a verdict needs: some may be inconclusive."""

_LOSSES = frozenset((EventKind.GAP, EventKind.OVERFLOW, EventKind.BUS_OFF, EventKind.DOWN))


def period_ns(bench: KeypadBench) -> int:
    """The commissioned heartbeat period.

    Raises:
        NotRun: there is none.
    """
    found = bench.watch.expected.heartbeat_ns
    if not found:
        raise NotRun("the device is commissioned without heartbeat")
    return found


def enough(bench: KeypadBench) -> int:
    """How many intervals a verdict asks for: 20, or 3 long ones where time is real."""
    long = period_ns(bench) > LONG_PERIOD_MS * MS
    return FEW if long and not bench.stage.virtual else ENOUGH


def some_row(bench: KeypadBench, first: Seen) -> list[Seen]:
    """`first` and as many beats more as a verdict on the period needs."""
    need = enough(bench)
    return row(bench, need + SPARE if need == ENOUGH else need, first)


def settle_in(bench: KeypadBench, state: State, requirement: str = "NMT-04") -> Seen:
    """Command the node into a state; that it goes there is what `requirement` says.

    Returns:
        A beat that falls due when the command has surely acted: an extra beat at the change
        of state and the new phase after it lie behind.
    """
    sent = enter(bench, state, requirement)
    settled = sent.at + bench.profile.limits.command_ns
    bench.wait_until(settled)
    return next_beat(bench, exactly(settled))


def next_beat(bench: KeypadBench, after: Seen | Interval, requirement: str = "HB-01") -> Seen:
    """The next beat; that it comes within a period is what `requirement` says."""
    each = bench.watch.expected.heartbeat_each
    matcher = matchers.heartbeat(bench.node_id)
    return bench.expect(matcher, after=after, within=each.at_most_ns, requirement=requirement)


def row(bench: KeypadBench, count: int, first: Seen) -> list[Seen]:
    """`first` and the next `count` beats; fails where one stays away."""
    period = period_ns(bench)
    matcher = matchers.heartbeat(bench.node_id)
    if bench.stage.virtual:  # where silence takes no time it is not looked out for at each beat
        bench.wait_until(first.at + (count - 1) * period)
    beats = [first, *bench.beats(matcher, count, after=first, patience_ns=2 * period + S)]
    if len(beats) <= count:
        beats.append(next_beat(bench, beats[-1]))
    return beats


def beats_since(bench: KeypadBench, first: Seen) -> list[Seen]:
    """`first` and all beats that came after it until now."""
    matcher = matchers.heartbeat(bench.node_id)
    bench.settle()
    return [first, *bench.collect(matcher, after=first, until=bench.now())]


def judge_row(
    bench: KeypadBench, beats: Sequence[Seen], requirement: str = "", what: str = ""
) -> None:
    """Each interval and their mean keep the limits.

    A mean of fewer than 20 intervals is held to the limits of one. Frames that the adapter
    lost are never held against the node.
    """
    expected = bench.watch.expected
    need = min(enough(bench), len(beats) - 1)
    each = expected.heartbeat_each
    mean = expected.heartbeat_mean if len(beats) > ENOUGH else each
    name = f"heartbeat of node {bench.node_id}{what}"
    spans = [bench.when(beat) for beat in beats]
    verdict = judge_periodic(name, spans, each, mean, requirement, need)
    if verdict.outcome is Outcome.FAIL and lost_frames(bench, beats[0].at, beats[-1].at):
        text = f"{verdict.text}; frames were lost meanwhile"
        verdict = replace(verdict, outcome=Outcome.INCONCLUSIVE, text=text)
    begin = max((verdict.at or 0) - 3 * period_ns(bench), beats[0].at)
    bench.conclude(verdict, since=begin)


def lost_frames(bench: KeypadBench, since: int, until: int) -> bool:
    """Whether frames got lost on their way to us between two instants."""
    return any(
        event.kind in _LOSSES and since <= event.at <= until for event in bench.trace.events()
    )
