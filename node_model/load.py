"""Bus load: stations that keep the wire busy to a given share, reproducibly."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import cycle

from node_model.frame import INTERMISSION_BITS, Frame
from node_model.node import NOTHING, Frames

_MULTIPLIER = 6364136223846793005
_INCREMENT = 1442695040888963407
_MODULUS = 1 << 64


class Load:
    """Sends its frames in turn so that they take `share_ppm` of the wire's time.

    The spaces between the requests vary between nothing and twice the mean, from a fixed
    linear congruential sequence (Knuth's MMIX constants), so that the load has no beat of
    its own. At a million ppm there is always a request waiting.

    Args:
        frames: what is sent, in turn.
        share_ppm: share of the wire's time, in parts per million, 1..1 000 000.
        bit_rate: bit/s.
        seed: another seed, another rhythm.
    """

    listens_to: frozenset[int] | None = frozenset()

    def __init__(
        self, frames: Sequence[Frame], share_ppm: int, bit_rate: int, seed: int = 1
    ) -> None:
        self._rate = bit_rate
        self.bit_rate = 0
        bit_ns = 1_000_000_000 // bit_rate
        self._turns: Iterator[tuple[Frames, int]] = cycle(
            [
                ((frame,), (frame.bits + INTERMISSION_BITS) * bit_ns * 1_000_000 // share_ppm)
                for frame in frames
            ]
        )
        """Each frame, and the mean span from its request to the next."""
        self._even = share_ppm >= 1_000_000
        self._state = seed
        self._due_at: int | None = None

    def power_on(self, now: int) -> Frames:
        """Begin to load the bus."""
        if not self.bit_rate:
            self.bit_rate = self._rate
            self._due_at = now + 1
        return NOTHING

    def power_off(self, now: int) -> Frames:  # noqa: ARG002  a verb of every node
        """Stop."""
        self.bit_rate = 0
        self._due_at = None
        return NOTHING

    def stop(self, now: int) -> Frames:  # noqa: ARG002  told the time like every node
        """Ask for no more; what waits is still sent."""
        self._due_at = None
        return NOTHING

    def receive(self, frame: Frame, now: int) -> Frames:  # noqa: ARG002  a verb of every node
        """It heeds nothing."""
        return NOTHING

    def advance(self, now: int) -> Frames:
        """The requests that are due."""
        due = self._due_at
        if due is None or now < due:
            return NOTHING
        frames, due = self._request(due)
        while due <= now:
            more, due = self._request(due)
            frames = (*frames, *more)
        self._due_at = due
        return frames

    def _request(self, due: int) -> tuple[Frames, int]:
        """The frame that is due, and when the next one is."""
        frames, span = next(self._turns)
        if not self._even:
            self._state = (self._state * _MULTIPLIER + _INCREMENT) % _MODULUS
            span = span * (self._state >> 44) >> 19
        return frames, due + span + (not span)

    def deadline(self) -> int | None:
        """The next request."""
        return self._due_at
