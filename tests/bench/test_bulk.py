"""In a flood a bench takes its frames by the hundred; what it makes of them is the same."""

from __future__ import annotations

from array import array
from collections.abc import Sequence

import pytest

from hil_tests.clock import MS, S
from hil_tests.judge.cobs import Nmt, nmt_frame
from hil_tests.trace import OWN, BusEvent, Columns, EventKind, Sighting
from node_model.frame import Frame
from tests.bench.fakes import FakePort, bench_of

HUNDRED = 100


class FloodedPort(FakePort):
    """Reads what has come by the hundred, as soon as it was asked for one of them."""

    def __init__(self) -> None:
        super().__init__()
        self.gathered = 0

    def next(self, until: int, also: Sequence[int] = ()) -> Sighting | BusEvent | None:
        """See FakePort; meanwhile a second has passed."""
        found = super().next(until, also)
        self.at += S if found else 0
        return found

    def gather(self) -> Columns | None:
        """Frames that have come; None before an event."""
        taken: list[Sighting] = []
        while self.coming and self.coming[0].at <= self.at and len(taken) < HUNDRED:
            first = self.coming[0]
            if not isinstance(first, Sighting):
                break
            taken.append(first)
            self.coming.popleft()
        self.gathered += len(taken)
        if not taken:
            return None
        return Columns(
            array("q", [each.frame.head | (OWN if each.own else 0) for each in taken]),
            array("Q", [each.frame.body for each in taken]),
            array("q", [each.at for each in taken]),
            array("I", [each.doubt_ns for each in taken]),
        )


def played(port: FakePort) -> FakePort:
    """A device that beats late once, strangers, a command of ours, and a loss."""
    for number in range(1, 2000):
        at = number * 10 * MS
        port.plays(Frame(0x100 + number % 7, number.to_bytes(2, "big")), at)
        if number % 100 == 0:
            port.plays("701#7F", at + (300 * MS if number == 900 else MS))
    port._insert(Sighting(nmt_frame(Nmt.START, 1), 5 * S + 1, own=True))
    port.tells(BusEvent(EventKind.GAP, 12 * S + 1, "lost", 3))
    return port


@pytest.mark.parametrize("waits", [1, 3, 20])
def test_a_flood_is_recorded_and_judged_as_one_by_one(waits: int) -> None:
    """Same entries in the same order, same intervals, same verdicts."""
    found = []
    for port in (played(FakePort()), played(FloodedPort())):
        bench, _ = bench_of(port)
        bench.begin()
        for wait in range(1, waits + 1):
            bench.wait_until(wait * 21 * S // waits)
        entries = [each for each in bench.trace.entries() if not hasattr(each, "began_at")]
        seen = list(bench.frames_seen())
        found.append((entries, seen, list(map(str, bench.end()))))
    assert isinstance(port, FloodedPort)
    assert port.gathered > 1500
    assert found[0] == found[1]
    assert len(found[0][0]) == 2020
    assert found[0][2]
