"""Debouncer: a change counts once it has lasted, each key by itself.

A state that lasts `time_ns` after its last edge is taken at exactly that instant; an edge
back before that cancels it. Time 0 takes every edge at once.
"""

from __future__ import annotations


class Debouncer:
    """Debounced state of up to 64 keys, as a bit mask.

    Args:
        time_ns: how long a state must last.
        raw: the mask that counts as settled at the start.
    """

    def __init__(self, time_ns: int, raw: int = 0) -> None:
        self.time_ns = time_ns
        self.raw = raw
        self.settled = raw
        self.due_at: int | None = None
        """When the next change counts; None = nothing is pending."""
        self._mature_at: dict[int, int] = {}
        """Bit of each key that differs from its settled state -> when it will count."""

    def edge(self, raw: int, now: int) -> None:
        """From `now` on the contacts are as in `raw`; keys that did not move keep their time."""
        moved = raw ^ self.raw
        self.raw = raw
        while moved:
            bit = moved & -moved
            moved ^= bit
            if (raw ^ self.settled) & bit:
                self._mature_at[bit] = now + self.time_ns
            else:
                self._mature_at.pop(bit, None)
        self.due_at = min(self._mature_at.values(), default=None)

    def advance(self, now: int) -> int:
        """Settle what has lasted long enough.

        Returns:
            Mask of the keys whose settled state changed; 0 = none.
        """
        ripe = 0
        for bit, at in self._mature_at.items():
            if at <= now:
                ripe |= bit
        if ripe:
            self._mature_at = {b: at for b, at in self._mature_at.items() if not b & ripe}
            self.settled ^= ripe
            self.due_at = min(self._mature_at.values(), default=None)
        return ripe
