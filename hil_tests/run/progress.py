"""Shows that a test in real time still runs: after two seconds, and then each second.

It stands on the bench's own calendar, so the suite still waits in one place and no frame waits
unread behind it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from hil_tests.clock import S

if TYPE_CHECKING:
    from hil_tests.bench.bench import Bench
    from hil_tests.run.capture import Ticker

FIRST_NS = 2 * S
"""Whoever waits that long wants to know for what."""
STEP_NS = 1 * S


class Progress:
    """Tells of the test that is under way.

    Args:
        ticker: where it is shown.
    """

    def __init__(self, ticker: Ticker) -> None:
        self._ticker = ticker

    def begin(self, bench: Bench, test: str) -> None:
        """A test begins on a bench whose calendar is empty."""
        began_at, name = bench.stage.port.now(), test.rpartition("::")[2]

        def tell(span_ns: int) -> None:
            count = len(bench.trace)
            frames = f"{count} frame{'s' * (count != 1)}"
            self._ticker.show(f"{span_ns // S} s, {frames}: {name}")
            bench.at(began_at + span_ns + STEP_NS, lambda: tell(span_ns + STEP_NS))

        bench.at(began_at + FIRST_NS, lambda: tell(FIRST_NS))

    def end(self) -> None:
        """The test is over: the line is pytest's again."""
        self._ticker.wipe()
