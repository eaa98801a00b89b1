"""The checks of a test, each with its place in the recording, and what it was timed between.

Results say from when to when a span was measured, each end with its doubt. A device's frame
counts from when it was asked for; the timeline shows it where it ended. So an end that is
the request of a recorded frame is drawn at that frame, and every other where it was.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Sequence
from typing import NamedTuple

from hil_tests.clock import MS, S
from hil_tests.reporting.html.recording import Recording
from hil_tests.reporting.margins import Margin
from hil_tests.reporting.rows import VerdictRow

_FRAME_NS = 20 * MS
"""The longest frame at the slowest rate takes less: 16 ms at 10 kbit/s."""
_BIT_RATES = (10_000, 20_000, 50_000, 100_000, 125_000, 250_000, 500_000, 800_000, 1_000_000)
_BIT_TIMES = frozenset(S // rate for rate in _BIT_RATES)
"""Of CiA 301 4.2.0, 5.4, and two that adapters offer besides."""

Ends = tuple[int, int]


class Check(NamedTuple):
    """One verdict of a test.

    Args:
        row: as `results.json` has it.
        cause_at: where the cause of a measured span is drawn; None = nothing was timed.
        effect_at: where its effect is drawn; None = there is none.
        margin: the room that its measurement left; None = it has none.
    """

    row: VerdictRow
    cause_at: int | None = None
    effect_at: int | None = None
    margin: Margin | None = None

    @property
    def at(self) -> int | None:
        """The instant to look at; None = none in particular."""
        return self.effect_at if self.row.at is None else self.row.at


def checks_of(rows: Sequence[VerdictRow], recording: Recording | None) -> list[Check]:
    """The checks of a test, in the order in which they were made."""
    if recording is None:
        return [Check(row, margin=row.margin) for row in rows]
    return [
        Check(row, _drawn(row.cause_at, recording), _drawn(row.effect_at, recording), row.margin)
        for row in rows
    ]


def _drawn(end: Ends | None, recording: Recording) -> int | None:
    """Where one end of a measured span is drawn: at its frame, if it is one."""
    if end is None:
        return None
    began_at = end[1]
    stamps, kinds = recording.at, recording.kinds.all
    for index in range(bisect_left(stamps, began_at), len(recording)):
        spent_ns = stamps[index] - began_at
        if spent_ns == 0:
            return stamps[index]
        if spent_ns > _FRAME_NS:
            break
        bit_ns, rest = divmod(spent_ns, kinds[recording.kind[index]].frame.bits)
        if rest == 0 and bit_ns in _BIT_TIMES:
            return stamps[index]
    return began_at
