"""When did the device *want* to send? Causal intervals from the trace of a timed wire.

A frame's stamp says when it ended. If the wire was idle before it started, it was asked
for at that start. If it stands in a chain of back-to-back frames, it was asked for after
the start of the last frame of lower priority in the chain (it would have won against it)
or, where there is none, after the chain began, and before it started itself.

A device may queue its own frames first in, first out, in one queue or several. Where that
frame of lower priority is the device's own, the next one may have waited behind it, and was
asked for no earlier than that. (Own frames of higher priority since then are no worse: they
have the same evidence themselves.) What was on the wire unseen (an error frame, a loss, the
time before the watch began) is no evidence: the chain goes on through it.
On an untimed wire a frame is asked for at its stamp, within the stamp's doubt.
"""

from __future__ import annotations

from bisect import bisect_left, insort
from collections.abc import Callable, Iterator
from operator import sub
from typing import NamedTuple

from hil_tests.clock import FOREVER, Interval, exactly, named
from hil_tests.trace import Sighting
from node_model.frame import INTERMISSION_BITS, Frame

LONGEST_BITS = 160
"""A longest frame, 157 bits (29-bit identifier, 8 bytes, most stuffing), and intermission."""

ERROR_FRAME_BITS = 28
"""Error flag 6, its echo 6, delimiter 8, and 8 in which an error-passive sender stays back."""


class Seen(NamedTuple):
    """A frame with the interval in which its sender asked for it to be sent."""

    frame: Frame
    at: int
    """Stamp: when it had ended."""
    wanted: Interval
    own: bool
    index: int  # type: ignore[assignment]  # hides tuple.index, which nobody needs here
    """Its place among the frames of the trace."""

    @property
    def when(self) -> Interval:
        """When it counts: a stimulus of ours from its end, others from their request."""
        return exactly(self.at) if self.own else self.wanted


def seen_between(frame: Frame, at: int, earliest: int, latest: int, own: bool, index: int) -> Seen:
    """A frame that was asked for between two instants."""
    wanted = named(Interval, (earliest, latest))
    return named(Seen, (frame, at, wanted, own, index))


class CausalClock:
    """Turns sightings into `Seen`, one after the other, in the order of the wire.

    Args:
        bit_ns: duration of a bit; 0 on an untimed wire.
        from_device: tells the frames of the device under test; the queue rule applies to
            them. Other stations count one by one as evidence only by their priority.
        since: from when on the wire is watched; a chain may have begun before. Left out,
            the wire is taken to be idle before the first frame.
    """

    __slots__ = (
        "_chain_from",
        "_first",
        "_from_device",
        "_last",
        "_last_end",
        "_last_ns",
        "_lower",
        "_pause_ns",
        "bit_ns",
    )

    def __init__(
        self, bit_ns: int, from_device: Callable[[Frame], bool], since: int = -FOREVER
    ) -> None:
        self.bit_ns = bit_ns
        self._pause_ns = INTERMISSION_BITS * bit_ns
        self._from_device = from_device
        self._last_end = since
        self._last: Frame | None = None
        """The last frame and its duration: most frames of a quiet bus are alike."""
        self._last_ns = 0
        self._chain_from = -FOREVER
        self._first: Frame | None = None
        """First frame of a chain, if it is not among `_lower` yet."""
        self._lower: list[tuple[int, int, int]] = []
        """Frames of the chain, orders falling from bottom to top: order, start, and the instant
        after which the device asked for what follows: its own may wait behind its own."""

    def disturb(self, at: int) -> None:
        """Something unseen (an error frame, a loss) kept the wire busy at `at`.

        What follows may have been asked for at any time since the last certain idle, so
        the chain goes on through it, and what came before is no evidence any more: a frame
        that was lost may have been the device's own, with others waiting behind it.
        """
        self._forget()
        until = at + ERROR_FRAME_BITS * self.bit_ns
        if until > self._last_end:
            self._last_end = until

    def _forget(self) -> None:
        """What was seen is no evidence any more."""
        self._first = None
        self._lower.clear()

    def retune(self, bit_ns: int, at: int) -> None:
        """From `at` on the wire runs at another bit rate; before, it was not to be seen."""
        self.bit_ns = bit_ns
        self._pause_ns = INTERMISSION_BITS * bit_ns
        self._forget()
        self._last = None
        self._last_end = at
        self._chain_from = -FOREVER

    def idle_before(self, until: int) -> int:
        """A frame asked for before the instant returned would have ended by `until`.

        While the wire is busy that is the start of the present chain; else it is the time
        that a longest frame takes before `until`.
        """
        longest_ns = LONGEST_BITS * self.bit_ns
        if until - self._last_end <= longest_ns:
            return min(self._chain_from, until - longest_ns)
        return until - longest_ns

    def see(self, sighting: Sighting, index: int) -> Seen:
        """The causal interval of the next frame of the trace."""
        frame, at, doubt_ns, own = sighting
        earliest = self.request(frame, at, doubt_ns, own=own)
        return self.seen(frame, at, earliest, own, index)

    def seen(self, frame: Frame, at: int, earliest: int, own: bool, index: int) -> Seen:
        """A frame with its causal interval, of which the earlier end is known."""
        latest = at - (frame.known_bits or frame.bits) * self.bit_ns if self.bit_ns else at
        return seen_between(frame, at, earliest, latest, own, index)

    def requests(self, frame: Frame, instants: list[int]) -> list[int]:
        """As `request`, for the same frame of others again and again, without doubt.

        Args:
            frame: which.
            instants: when it has ended, each time.
        """
        first_at, away_ns = instants[0], frame.bits * self.bit_ns + self.bit_ns
        far_ns = away_ns + self._pause_ns
        apart = (
            first_at - self._last_end > far_ns
            and min(map(sub, instants[1:], instants), default=far_ns + 1) > far_ns
        )
        if not apart or not self.bit_ns:
            return [self.request(frame, at, 0, own=False) for at in instants]
        # The wire was idle before each: as below, for all at once.
        found = [at - away_ns for at in instants]
        self._last, self._last_ns = frame, away_ns - self.bit_ns
        self._first, self._chain_from, self._last_end = frame, found[-1], instants[-1]
        return found

    def request(self, frame: Frame, at: int, doubt_ns: int, *, own: bool) -> int:
        """When the next frame of the trace can have been asked for at the earliest."""
        if not self.bit_ns:
            return at - doubt_ns
        if frame is not self._last:
            self._last, self._last_ns = frame, frame.bits * self.bit_ns
        start = at - self._last_ns - doubt_ns
        earliest = start - self.bit_ns
        if earliest > self._last_end + self._pause_ns:
            # The wire was idle: no chain, and the start is the request, to one bit.
            self._chain_from = earliest
            self._first = frame
        else:
            earliest = self._in_chain(frame, start, own)
        self._last_end = at
        return earliest

    def others(self, frames: list[Frame], instants: list[int]) -> list[int]:
        """As `request`, for one frame after the other that is neither ours nor the device's.

        Args:
            frames: which.
            instants: when each of them has ended, without doubt.
        """
        bit_ns, lower, last_end = self.bit_ns, self._lower, self._last_end
        if not bit_ns:
            return instants
        found: list[int] = []
        for frame, at in zip(frames, instants, strict=True):
            start = at - (frame.known_bits or frame.bits) * bit_ns
            earliest = start - bit_ns
            if earliest > last_end + self._pause_ns:
                self._chain_from, self._first = earliest, frame
            else:
                if self._first is not None:
                    self._begin(self._first)
                order = frame.order
                while lower and lower[-1][0] <= order:
                    lower.pop()
                earliest = lower[-1][1] if lower else self._chain_from
                lower.append((order, start, start))
            found.append(earliest)
            last_end = at
        self._last_end = last_end
        return found

    def _begin(self, first: Frame) -> None:
        """A second frame follows the first one of a chain: that becomes evidence."""
        earliest = self._chain_from
        start = earliest + self.bit_ns
        self._lower[:] = [(first.order, start, earliest if self._from_device(first) else start)]
        self._first = None

    def _in_chain(self, frame: Frame, start: int, own: bool) -> int:
        """Earliest request of a frame that stands in a chain; `start` is its earliest start."""
        lower = self._lower
        if self._first is not None:
            self._begin(self._first)
        order = frame.order
        while lower and lower[-1][0] <= order:
            lower.pop()
        queues = not own and self._from_device(frame)
        earliest = lower[-1][1 + queues] if lower else self._chain_from
        lower.append((order, start, earliest if queues else start))
        return earliest


class Lateness:
    """What is known of a host that was late: pairs (due, sent) of frames or actions.

    A frame that was seen between such a pair may have been due as early as `due`; that is
    held against the host, never against the device.
    """

    def __init__(self, slack_ns: int = 2_000_000) -> None:
        self._slack_ns = slack_ns
        self._pairs: list[tuple[int, int]] = []
        """When it was sent and when that was due, in the order of sending."""
        self.worst_ns = 0
        """The largest lateness so far."""

    def add(self, due_at: int, sent_at: int) -> None:
        """The host sent at `sent_at` what was due at `due_at`."""
        insort(self._pairs, (sent_at, due_at))
        self.worst_ns = max(self.worst_ns, sent_at - due_at)

    def __len__(self) -> int:
        return len(self._pairs)

    def _due(self, due_by: int, sent_from: int) -> Iterator[int]:
        """When that was due which was due by one instant and sent from another on."""
        pairs = self._pairs
        first = bisect_left(pairs, (sent_from,))
        # Nothing was later than the latest.
        last = bisect_left(pairs, (due_by + self.worst_ns + 1,), first)
        return (due for _, due in pairs[first:last] if due <= due_by)

    def held_back(self, limit_at: int, until: int) -> bool:
        """The host kept something back that was due by `limit_at`, and still at `until`."""
        return any(True for _ in self._due(limit_at, until))

    def widen(self, seen: Seen) -> Interval:
        """The interval of a frame's request, with the host's lateness in it."""
        if not self._pairs:
            return seen.wanted
        earliest, latest = seen.wanted
        due = self._due(seen.at, seen.at - self._slack_ns)
        return Interval(min((earliest, *due)), latest)
