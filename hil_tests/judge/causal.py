"""When did the device *want* to send? Causal intervals from the trace of a timed wire.

A frame's stamp says when it ended. If the wire was idle before it started, it was asked
for at that start. If it stands in a chain of back-to-back frames, it was asked for after
the start of the last frame of lower priority in the chain (it would have won against it)
or, where there is none, after the chain began, and before it started itself.

A device may queue its own frames first in, first out; then a frame may have waited behind
an earlier one of its own, so only what happened after that one counts as evidence.
On an untimed wire a frame is asked for at its stamp, within the stamp's doubt.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from hil_tests.clock import Interval
from hil_tests.trace import Sighting
from node_model.frame import INTERMISSION_BITS, Frame


class Seen(NamedTuple):
    """A frame with the interval in which its sender asked for it to be sent."""

    frame: Frame
    at: int
    """Stamp: when it had ended."""
    wanted: Interval
    own: bool
    index: int
    """Its place among the frames of the trace."""

    @property
    def when(self) -> Interval:
        """When it counts: a stimulus of ours from its end, others from their request."""
        return Interval(self.at, self.at) if self.own else self.wanted


class CausalClock:
    """Turns sightings into `Seen`, one after the other, in the order of the wire.

    Args:
        bit_ns: duration of a bit; 0 on an untimed wire.
        from_device: tells the frames of the device under test; the queue rule applies to
            them. Other stations count one by one as evidence only by their priority.
    """

    __slots__ = (
        "_chain_from",
        "_device_from",
        "_device_start",
        "_from_device",
        "_last_end",
        "_lower",
        "bit_ns",
    )

    def __init__(self, bit_ns: int, from_device: Callable[[Frame], bool]) -> None:
        self.bit_ns = bit_ns
        self._from_device = from_device
        self._last_end = -(1 << 62)
        self._chain_from = 0
        self._lower: list[tuple[int, int]] = []
        """(order, start) of frames in the chain, orders falling from bottom to top."""
        self._device_from: int | None = None
        """Earliest request of the device's last frame in the chain, None = none yet."""
        self._device_start = 0

    def disturb(self, at: int) -> None:
        """Something unseen (an error frame, a loss) kept the wire busy until `at`.

        What follows may have been asked for at any time since the last certain idle, so
        the chain goes on through it.
        """
        if at > self._last_end:
            self._last_end = at

    def idle_before(self, until: int) -> int:
        """A frame asked for before the instant returned would have ended by `until`.

        While the wire is busy that is the start of the present chain; else it is the time
        that a longest frame takes before `until`.
        """
        longest_ns = 160 * self.bit_ns
        if until - self._last_end <= longest_ns:
            return min(self._chain_from, until - longest_ns)
        return until - longest_ns

    def see(self, sighting: Sighting, index: int) -> Seen:
        """The causal interval of the next frame of the trace."""
        frame, at, doubt_ns, own = sighting
        bit_ns = self.bit_ns
        if not bit_ns:
            return Seen(frame, at, Interval(at - doubt_ns, at), own, index)
        start = at - frame.bits * bit_ns
        gap_ns = start - self._last_end
        self._last_end = at
        if gap_ns > (INTERMISSION_BITS + 1) * bit_ns + doubt_ns:
            # The wire was idle: no chain, and the start is the request, to one bit.
            earliest = start - doubt_ns - bit_ns
            self._chain_from = earliest
            self._lower.clear()
            self._lower.append((frame.order, start))
            self._device_from = earliest if not own and self._from_device(frame) else None
            self._device_start = start
            return Seen(frame, at, Interval(earliest, start), own, index)
        earliest = self._in_chain(frame, start, doubt_ns, own)
        return Seen(frame, at, Interval(earliest, start), own, index)

    def _in_chain(self, frame: Frame, start: int, doubt_ns: int, own: bool) -> int:
        lower = self._lower
        order = frame.order
        while lower and lower[-1][0] <= order:
            lower.pop()
        evidence = lower[-1][1] - doubt_ns if lower else self._chain_from
        lower.append((order, start))
        if own or not self._from_device(frame):
            return evidence
        if self._device_from is not None and evidence <= self._device_start:
            # It may have waited behind the device's own earlier frame.
            evidence = min(evidence, self._device_from)
        self._device_from = evidence
        self._device_start = start
        return evidence


class Lateness:
    """What is known of a host that was late: pairs (due, sent) of frames or actions.

    A frame that was seen between such a pair may have been due as early as `due`; that is
    held against the host, never against the device.
    """

    def __init__(self, slack_ns: int = 2_000_000) -> None:
        self._slack_ns = slack_ns
        self._pairs: list[tuple[int, int]] = []

    def add(self, due_at: int, sent_at: int) -> None:
        """The host sent at `sent_at` what was due at `due_at`."""
        self._pairs.append((due_at, sent_at))

    @property
    def worst_ns(self) -> int:
        """The largest lateness so far."""
        return max((sent - due for due, sent in self._pairs), default=0)

    def __len__(self) -> int:
        return len(self._pairs)

    def widen(self, seen: Seen) -> Interval:
        """The interval of a frame's request, with the host's lateness in it."""
        earliest, latest = seen.wanted
        for due, sent in self._pairs:
            if due < earliest and due <= seen.at <= sent + self._slack_ns:
                earliest = due
        return Interval(earliest, latest)
