"""The checks of a test, each with its place in the recording and what it counted from.

A check that names its cause ("... after 701#00") is traced back to that frame or stimulus, and
forward to the frame that was judged; then an arrow can be drawn.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Sequence
from dataclasses import dataclass

from hil_tests.clock import MS
from hil_tests.reporting.html.recording import Recording
from hil_tests.reporting.rows import VerdictRow
from hil_tests.trace import Moment

_FRAME_NS = 20 * MS
"""A frame ends later than it was asked for: at 20 kbit/s by 7 ms, on a busy bus by more."""
_LOOK_BACK = 5000


@dataclass(frozen=True, slots=True)
class Check:
    """One verdict of a test.

    Args:
        row: as `results.json` has it.
        cause_at: instant of the stimulus or frame from which it counted.
        effect: index of the frame that was judged.
    """

    row: VerdictRow
    cause_at: int | None = None
    effect: int | None = None


def checks_of(rows: Sequence[VerdictRow], recording: Recording | None) -> list[Check]:
    """The checks of a test, in the order in which they were made."""
    if recording is None:
        return [Check(row) for row in rows]
    moments = recording.moments()
    return [Check(row, *_traced(row, recording, moments)) for row in rows]


def _traced(
    row: VerdictRow, recording: Recording, moments: Sequence[Moment]
) -> tuple[int | None, int | None]:
    """Cause and effect of a measured span, as far as the recording shows them."""
    _, after, name = row.what.rpartition(" after ")
    if not after or row.measured_ns is None or row.at is None:
        return None, None
    cause_at = _frame_named(name, row.at, recording)
    if cause_at is None:
        cause_at = _moment_named(name, row.at, moments)
    if cause_at is None:
        return None, None
    return cause_at, _effect(cause_at, row.measured_ns, recording)


def _frame_named(name: str, at: int, recording: Recording) -> int | None:
    """The last frame that is written so, before an instant."""
    wanted = recording.kinds.by_text.get(name.removesuffix(" has acted"))
    if not wanted:
        return None
    index = bisect_right(recording.at, at) - 1
    for place in range(index, max(-1, index - _LOOK_BACK), -1):
        if recording.kind[place] in wanted:
            return recording.at[place]
    return None


def _moment_named(name: str, at: int, moments: Sequence[Moment]) -> int | None:
    """The last stimulus of that name before an instant."""
    place = bisect_right(moments, at, key=lambda moment: moment.began_at)
    for moment in reversed(moments[max(0, place - 50) : place]):
        if _names(moment, name):
            return moment.ended_at
    return None


def _names(moment: Moment, name: str) -> bool:
    """Whether a check calls that stimulus by that name."""
    if moment.what == "power":
        return name.startswith("power-on" if moment.detail.get("on") else "power-off")
    if moment.what == "keys":
        held = moment.detail.get("held")
        names = ", ".join(map(str, held)) if isinstance(held, list) else ""
        return name == (f"keys held: {names}" if names else "keys released")
    return name.startswith(moment.what)


def _effect(cause_at: int, measured_ns: tuple[int, int], recording: Recording) -> int | None:
    """The frame of the device that ended next to the measured span after the cause."""
    earliest, latest = cause_at + measured_ns[0], cause_at + measured_ns[1]
    first = bisect_left(recording.at, earliest)
    for index in range(first, min(first + 200, len(recording))):
        if recording.at[index] > latest + _FRAME_NS:
            return None
        if not recording.kinds.all[recording.kind[index]].own and recording.at[index] > cause_at:
            return index
    return None
