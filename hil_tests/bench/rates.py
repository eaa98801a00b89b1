"""How long a bit took on the wire, frame by frame of a trace."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterator

from hil_tests.clock import FOREVER


class Rates:
    """Bit times, each from some frame of a trace on.

    Args:
        bit_ns: of the first frame; 0 on a wire without bit times.
    """

    def __init__(self, bit_ns: int) -> None:
        self._since = [(0, bit_ns)]

    def keep(self, index: int, bit_ns: int) -> None:
        """The frame with that index and those after it have this bit time."""
        if bit_ns != self._since[-1][1]:
            self._since.append((index, bit_ns))

    def of(self, index: int) -> int:
        """The bit time of a frame, ns."""
        since = self._since
        return since[bisect_right(since, (index, FOREVER)) - 1 if len(since) > 1 else 0][1]

    def stretches(self, stop: int) -> Iterator[tuple[int, int, int]]:
        """First frame, the one after the last, and bit time, up to the frame `stop`."""
        ends = [*(start for start, _ in self._since[1:]), stop]
        for (start, bit_ns), end in zip(self._since, ends, strict=True):
            if end > start:
                yield start, end, bit_ns
