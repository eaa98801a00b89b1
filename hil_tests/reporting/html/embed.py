"""The bus of a test for the timeline: columns, deflated, in base64.

    u32 length of the head | head (JSON) | 6 planes of instants | 3 planes of kinds

Instants are the distances from frame to frame in ns, each byte of them in a plane of its
own: most are alike, so deflate finds them. An hour of a quiet bus takes about two bytes a
frame. A report has a budget: what is argued about comes first and whole, then what came
near a limit; of the rest, windows round the checks, or nothing. What is left out is said,
and stands in the recording.
"""

from __future__ import annotations

import base64
import json
import zlib
from array import array
from bisect import bisect_left, bisect_right
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import chain
from operator import sub
from typing import Any

from hil_tests.clock import S
from hil_tests.reporting import journal
from hil_tests.reporting.html.checks import Check
from hil_tests.reporting.html.lanes import lane_of, lanes_of, other_moments, spans_of
from hil_tests.reporting.html.recording import Recording
from hil_tests.reporting.html.view import TestView
from hil_tests.reporting.rows import PASSING
from hil_tests.trace import BusEvent

BUDGET = 3_600_000
"""Characters that all timelines of a report may take."""
_WHOLE_FRAMES = 1_500_000
"""A longer recording is never tried as a whole."""
_WINDOW_NS = 5 * S
_WINDOW_FRAMES = 60_000
_MOST_EVENTS, _MOST_CHECKS, _MOST_WORDS = 2000, 600, 20_000
_AT_PLANES, _KIND_PLANES = 6, 3
_NEAR_DOUBTS = 10.0

Stretch = tuple[int, int]
"""Frames from one index up to, not including, another."""


@dataclass(slots=True)
class _Purse:
    """What is left of the budget."""

    left: int

    def pay(self, text: str) -> bool:
        """Take a text if it can be afforded."""
        if len(text) > self.left:
            return False
        self.left -= len(text)
        return True


def embed(tests: Sequence[TestView], budget: int = BUDGET) -> None:
    """Give each test its timeline, as far as the budget goes."""
    purse = _Purse(budget)
    for test in sorted(tests, key=_urgency):
        recording = test.recording
        if recording is None or not (len(recording) or recording.notes):
            continue
        for stretches in _choices(test, recording):
            data = pack(test, recording, stretches)
            if purse.pay(data):
                test.data = data
                break


def _urgency(test: TestView) -> tuple[int, int]:
    """What is argued about first, then what came near a limit, then the short ones."""
    rank = 0 if test.is_argued else 1 if any(map(is_near, test.checks)) else 2
    return rank, len(test.recording) if test.recording else 0


def is_near(check: Check) -> bool:
    """Whether a check did not plainly pass: its margin is a few doubts."""
    margin = check.margin
    if check.row.outcome not in PASSING:
        return True
    return margin is not None and margin.doubts != margin.ns and margin.doubts < _NEAR_DOUBTS


def _choices(test: TestView, recording: Recording) -> Iterator[list[Stretch]]:
    """What may be kept, the best first."""
    if len(recording) <= _WHOLE_FRAMES:
        yield [(0, len(recording))]
    yield _windows(test, recording)


def _windows(test: TestView, recording: Recording) -> list[Stretch]:
    """Some seconds round each check that matters; else the beginning and the end."""
    near = [c.at for c in test.checks if c.at is not None and is_near(c)]
    instants = sorted(near)[:50] or [*recording.at[:1], *recording.at[-1:]]
    found: list[Stretch] = []
    for at in instants:
        start = bisect_left(recording.at, at - _WINDOW_NS)
        stop = min(bisect_right(recording.at, at + _WINDOW_NS), start + _WINDOW_FRAMES)
        if found and start <= found[-1][1]:
            found[-1] = (found[-1][0], max(stop, found[-1][1]))
        else:
            found.append((start, stop))
    return found


def pack(test: TestView, recording: Recording, stretches: Sequence[Stretch]) -> str:
    """The timeline of a test, in base64."""
    at, kind = array("q"), array("I")
    for start, stop in stretches:
        at += recording.at[start:stop]
        kind += recording.kind[start:stop]
    at, kind = _in_order(at, kind)
    used = Counter(kind)
    numbers = {number: place for place, number in enumerate(used)}
    head = _head(test, recording, used)
    head["n"] = len(at)
    head["left"] = _left_out(recording, stretches, test.origin_at)
    text = json.dumps(head, separators=(",", ":")).encode()
    places = array("I", map(numbers.__getitem__, kind))
    steps = array("q", map(sub, at, chain((test.origin_at,), at)))
    body = _planes(steps, _AT_PLANES) + _planes(places, _KIND_PLANES)
    packer = zlib.compressobj(6, zlib.DEFLATED, -15)
    raw = packer.compress(len(text).to_bytes(4, "little") + text + body) + packer.flush()
    return base64.b64encode(raw).decode("ascii")


def _in_order(at: array[int], kind: array[int]) -> tuple[array[int], array[int]]:
    """By instant; stamps of a real port may step back."""
    if all(map(int.__le__, at, at[1:])):
        return at, kind
    order = sorted(range(len(at)), key=at.__getitem__)
    return array("q", map(at.__getitem__, order)), array("I", map(kind.__getitem__, order))


def _planes(column: array[int], count: int) -> bytes:
    """The bytes of a column, the lowest of all numbers first, then the next ones."""
    if not len(column):
        return b""
    if column.itemsize > 1 and array("H", [1]).tobytes()[0] == 0:
        column.byteswap()  # pragma: no cover - big-endian hosts
    raw = column.tobytes()
    return b"".join(raw[plane :: column.itemsize] for plane in range(count))


def _left_out(
    recording: Recording, stretches: Sequence[Stretch], origin_at: int
) -> list[tuple[int, int, int]]:
    """From, to and number of the frames between the stretches."""
    found = []
    before = 0
    for start, stop in [*stretches, (len(recording), len(recording))]:
        if start > before:
            first, last = recording.at[before], recording.at[start - 1]
            found.append((first - origin_at, last - origin_at, start - before))
        before = stop
    return found


def _head(test: TestView, recording: Recording, used: Counter[int]) -> dict[str, Any]:
    """All but the columns."""
    origin_at, kinds = test.origin_at, recording.kinds.all
    notes = [journal.stamp(note) for _, note in recording.notes]
    end_at = max([*recording.at[-1:], *notes[-1:], *notes[:1]], default=origin_at)
    lanes = lanes_of(recording, used)
    events = [note for _, note in recording.notes if isinstance(note, BusEvent)]
    words = [
        (
            recording.kinds.texts[number],
            recording.kinds.words(number) if place < _MOST_WORDS else "",
            lane_of(lanes, kinds[number].frame),
            int(kinds[number].own),
            kinds[number].doubt_ns,
        )
        for place, number in enumerate(used)
    ]
    return {
        "origin": str(origin_at),
        "end": end_at - origin_at,
        "words": words,
        "lanes": lanes.names,
        "spans": spans_of(recording, used, origin_at, end_at),
        "events": [
            (event.at - origin_at, event.kind.value, journal.describe(event))
            for event in events[:_MOST_EVENTS]
        ],
        "moments": list(other_moments(recording, origin_at))[:_MOST_EVENTS],
        "checks": _checks(test, origin_at),
    }


def _checks(test: TestView, origin_at: int) -> list[dict[str, Any]]:
    """Checks with an instant: those that matter, then the first ones."""
    timed = [check for check in test.checks if check.at is not None]
    if len(timed) > _MOST_CHECKS:
        timed = sorted(timed, key=lambda check: not is_near(check))[:_MOST_CHECKS]
    return [_check(check, origin_at) for check in sorted(timed, key=_instant)]


def _instant(check: Check) -> int:
    return check.at or 0


def _check(check: Check, origin_at: int) -> dict[str, Any]:
    row = check.row
    found: dict[str, Any] = {
        "at": _instant(check) - origin_at,
        "outcome": row.outcome,
        "text": row.text or row.what,
        "req": row.requirement,
    }
    if check.cause_at is not None:
        found["cause"] = check.cause_at - origin_at
    if check.effect_at is not None and row.measured_ns:
        found |= {
            "effect": check.effect_at - origin_at,
            "measured": row.measured_ns,
            "limits": row.limits_ns,
        }
    return found
