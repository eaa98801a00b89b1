"""The debounce time with which a keypad works, where that is not the one that it was given.

Byte 5 times 100 ms is how long a press or a release must last (COM-10). A keypad that keeps
to another multiple, at every change that nothing else can have hurried or held up, takes the
byte for another number. That says more than a frame that came at the wrong time (KEY-05).
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Iterator, Sequence

from hil_tests.clock import MS, Interval
from hil_tests.judge.keys_facts import Edge, KeyRules, KeyTimeline, Report, Window, windows_of

STEP_NS = 100 * MS
"""What byte 5 counts (COM-10)."""

ENOUGH = 2
"""One change may come at such a time by chance."""

Steps = frozenset[int]


def worked_with(timeline: KeyTimeline, rules: KeyRules, acts: Sequence[int]) -> Steps:
    """The debounce times, in steps, that explain every undisturbed change.

    Args:
        timeline: see there.
        rules: with the debounce time that the device was given.
        acts: when the tester sent frames, in order: a change between which and its frame one
            was sent does not count.

    Returns:
        None of them, where the device keeps to no one time or too little is known.
    """
    spans = [
        _explained_by(report.wanted.since(edge.when), rules)
        for edge, report in _alone(timeline, rules)
        if bisect_right(acts, edge.when.earliest) == bisect_right(acts, report.wanted.latest)
    ]
    return frozenset.intersection(*spans) if len(spans) >= ENOUGH else frozenset()


def _explained_by(span: Interval, rules: KeyRules) -> Steps:
    """The debounce times that lead to a frame after that span (KEY-05)."""
    most = max(span.latest + rules.scan_ns, 0) // STEP_NS
    least = max(-(-(span.earliest - rules.scan_ns - rules.key_frame_ns) // STEP_NS), 0)
    return frozenset(range(least, most + 1))


def _alone(timeline: KeyTimeline, rules: KeyRules) -> Iterator[tuple[Edge, Report]]:
    """Each change that came when all was calm, and the frame that shows it."""
    windows, _ = windows_of(timeline.turns)
    edges, reports = timeline.edges, timeline.reports
    asked_at = [report.wanted.latest for report in reports]
    for index in range(1, len(edges)):
        (before, edge), after = edges[index - 1 : index + 1], edges[index + 1 : index + 2]
        place = bisect_left(asked_at, edge.when.earliest)
        if not 0 < place < len(reports):
            continue
        last, shows = reports[place - 1 : place + 1]
        calm_ns = edge.when.earliest - before.when.latest
        if (last.mask, shows.mask) != (before.held, edge.held) or calm_ns <= rules.surely_ns:
            continue
        if after and after[0].when.earliest <= shows.wanted.latest:
            continue
        if _inside(windows, edge, shows, rules):
            yield edge, shows


def _inside(windows: Sequence[Window], edge: Edge, report: Report, rules: KeyRules) -> bool:
    """Whether the node was operational from a calm time before the edge to the frame."""
    return any(
        opens.latest + rules.command_ns <= edge.when.earliest
        and report.wanted.latest < closes.earliest
        for opens, closes in windows
    )
