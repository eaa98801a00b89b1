"""Tells that a test in real time still runs: after two seconds, and after as long again.

It stands on the bench's own calendar, so the suite still waits in one place and no frame waits
unread behind it.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from hil_tests.clock import S

if TYPE_CHECKING:
    from hil_tests.bench.bench import Bench

FIRST_NS = 2 * S
"""Whoever waits that long wants to know for what."""


class Progress:
    """Lines about the test that is under way.

    Args:
        say: writes a line for people.
    """

    def __init__(self, say: Callable[[str], None]) -> None:
        self._say = say

    def begin(self, bench: Bench, test: str) -> None:
        """A test begins on a bench whose calendar is empty."""
        began_at, name = bench.now(), test.rpartition("::")[2]

        def tell(span_ns: int) -> None:
            count = len(bench.trace)
            frames = f"{count} frame{'s' * (count != 1)}"
            self._say(f"  {name} has run for {span_ns // S} s: {frames} so far")
            bench.at(began_at + 2 * span_ns, lambda: tell(2 * span_ns))

        bench.at(began_at + FIRST_NS, lambda: tell(FIRST_NS))
