"""The record of a property's example: each one takes the place of the one before."""

from __future__ import annotations

from collections.abc import Callable

from hil_tests.reporting.pcapng import PcapngSink
from hil_tests.trace import Columns, Entry, Mark, Moment


class Draft:
    """A sink that keeps the example under way, and of those before nothing.

    Args:
        sink: the file.
        dress: says of a beginning which test it is of.
    """

    def __init__(self, sink: PcapngSink, dress: Callable[[Moment], Moment]) -> None:
        self.sink = sink
        self._dress = dress

    def write(self, entry: Entry | Mark) -> None:
        """Store one entry; a beginning is that of the next example.

        Raises:
            BenchError: the disk is full, or gone.
        """
        if isinstance(entry, Moment) and entry.what == "begin":
            self.sink.restart()
            entry = self._dress(entry)
        self.sink.write(entry)

    def write_all(self, columns: Columns) -> None:
        """Store many frames.

        Raises:
            BenchError: the disk is full, or gone.
        """
        self.sink.write_all(columns)

    def drop(self) -> None:
        """No example is worth keeping.

        Raises:
            BenchError: the disk is gone.
        """
        self.sink.close()
        self.sink.path.unlink(missing_ok=True)
