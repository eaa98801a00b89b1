"""The clock as a test reads it, in real time: an input like a frame, so it is recorded."""

from __future__ import annotations

from typing import TYPE_CHECKING

from hil_tests.bench import chronicle
from hil_tests.bus.port import ToldPort

if TYPE_CHECKING:
    from hil_tests.bench.core import BenchCore


class ReadClock:
    """Reads the clock of the bus, and notes what it showed.

    Between two frames nothing else says how late it was: a test that is kept from running
    begins to count later, or waits longer. In virtual time every instant is known anyway.

    Args:
        bench: whose clock it is.
    """

    def __init__(self, bench: BenchCore) -> None:
        port = bench.stage.port
        self._bench = bench
        self._read = port.told if isinstance(port, ToldPort) else port.now

    def __call__(self) -> int:
        """The present instant, ns."""
        now = self._read()
        trace = self._bench.trace
        if trace.sinks:
            trace.remark(chronicle.reading(now))
        return now
