"""Timelines of keys by hand, in milliseconds: the default limits, two keys."""

from __future__ import annotations

from collections.abc import Sequence

from hil_tests.clock import FOREVER, MS, Interval
from hil_tests.judge.keys import Edge, KeyRules, KeyTimeline, Report, Turn, judge_keys
from hil_tests.judge.verdict import Outcome, Verdict

At = float | tuple[float, float]
"""An instant in ms, or the two ends of the interval in which it was."""

A, B, C = 1, 2, 128
KEYS = {"a": 0, "b": 1, "c": 7}
START = 1000
"""When the command "start" ended in every scene."""

ENTRY = (START + 1, 0)
"""The key frame of that entry, no key held."""


def when(at: At) -> Interval:
    """The interval of an instant in ms."""
    first, last = at if isinstance(at, tuple) else (at, at)
    return Interval(round(first * MS), round(last * MS))


def rules(debounce_ms: int = 100, *, releases: bool = True) -> KeyRules:
    """The limits of the default profile."""
    return KeyRules(KEYS, debounce_ms * MS, 10 * MS, 20 * MS, 50 * MS, releases_reported=releases)


def timeline(
    edges: Sequence[tuple[At, int]],
    reports: Sequence[tuple[At, int]],
    turns: Sequence[tuple[At, bool]] = (),
    *,
    held: int = 0,
    until: float = 60_000,
) -> KeyTimeline:
    """A node that was switched on at 0 with `held`, ready at 100 ms, started at 1 s.

    Args:
        edges: instant, and the keys held from then on.
        reports: instant at which a key frame was asked for, and its mask.
        turns: instants of commands after the first; True = start.
        held: keys held at the power-on.
        until: what was asked for before this was seen, in ms.
    """
    return KeyTimeline(
        [Edge(Interval(-1, -1), held), *(Edge(when(at), mask) for at, mask in edges)],
        [
            Turn(when(0), operational=False, ready_at=100 * MS),
            Turn(when(START), operational=True),
            *(Turn(when(at), operational=on) for at, on in turns),
        ],
        [Report(when(at), mask) for at, mask in reports],
        round(until * MS),
    )


def judge(scene: KeyTimeline, by: KeyRules | None = None) -> list[Verdict]:
    """What the oracle says."""
    return judge_keys(scene, by or rules())


def blame(scene: KeyTimeline, by: KeyRules | None = None) -> str:
    """The requirement that is blamed first; "" = nothing is wrong, "?" before it = doubt."""
    found = judge(scene, by)
    if not found:
        return ""
    assert len({verdict.outcome for verdict in found}) == 1
    doubt = "?" if found[0].outcome is Outcome.INCONCLUSIVE else ""
    return doubt + found[0].requirement


LATE = FOREVER // MS
