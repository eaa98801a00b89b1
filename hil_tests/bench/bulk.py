"""Frames by the hundred, where nobody looks at each: in virtual time, and in a flood."""

from __future__ import annotations

from typing import TYPE_CHECKING

from hil_tests.bus.port import FEW, BurstPort, GatheringPort, Port

if TYPE_CHECKING:
    from hil_tests.bench.core import BenchCore


class Bulk:
    """What a port can hand out besides one frame after the other.

    Args:
        bench: takes it.
        port: the bench's.
    """

    def __init__(self, bench: BenchCore, port: Port) -> None:
        self._bench = bench
        self._next = port.next
        self._burst = port.burst if isinstance(port, BurstPort) else None
        self._gather = port.gather if isinstance(port, GatheringPort) else None

    def glide(self, instant: int) -> bool:
        """In virtual time: while nothing is planned; whether `instant` has come so."""
        bench, burst_until, next_item = self._bench, self._burst, self._next
        while not bench.planned:
            if burst_until is not None:
                burst = burst_until(instant)
                if len(burst.frames) > FEW:
                    bench.take_burst(burst)
                elif burst.frames:
                    for sighting in burst.sightings():
                        bench.take(sighting)
                if burst.over:
                    return True
                if burst.frames:
                    continue
            if (item := next_item(instant)) is None:
                return True
            bench.take(item)
        return False

    def catch_up(self) -> None:
        """In real time: what the port had to read in a hurry goes into the trace at once."""
        while self._gather is not None and (columns := self._gather()) is not None:
            self._bench.take_columns(columns)
