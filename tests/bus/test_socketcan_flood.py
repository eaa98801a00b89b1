"""The SocketCAN port where frames come faster than they are looked at: it reads by the hundred."""

from __future__ import annotations

import contextlib
import errno
import socket
import struct
from array import array
from collections import deque
from collections.abc import Iterator, Sequence
from typing import Any, cast

import pytest

from hil_tests.bus.manyframes import ManyFrames, Packed
from hil_tests.bus.socketcan import HARDWARE_DOUBT_NS, SIMULATED_DOUBT_NS, SocketCanPort
from hil_tests.clock import S
from hil_tests.errors import BusUnavailable
from hil_tests.trace import OWN, BusEvent, Columns, EventKind, Sighting
from node_model.frame import Frame
from tests.bus.test_socketcan import ScriptedSocket, drain, drain_until_unavailable


class ScriptedMany(ManyFrames):
    """Reads by the hundred what it is told to; then nothing waits any more."""

    def __init__(self) -> None:
        super().__init__()
        self.script: deque[Packed | list[Any] | OSError] = deque()
        self.last: Packed | list[Any] = []

    def receive(self, _: int) -> int:
        """The next of the script."""
        if not self.script:
            return 0
        found = self.script.popleft()
        if isinstance(found, OSError):
            raise found
        self.last = found
        return 1

    def packed(self) -> Packed | None:
        """What came last, if it is columns."""
        return self.last if isinstance(self.last, Packed) else None

    def datagrams(self) -> list[Any]:
        """What came last, if it is not."""
        return list(self.last)


def packed(*ids: int, drops: Sequence[int] = (), hard: Sequence[int] = ()) -> Packed:
    """Empty frames with these identifiers, a second apart from 100 s on; odd ones our own."""
    heads = array("q", [Frame(each).head | (OWN if each & 1 else 0) for each in ids])
    soft = [(100 + place) * S for place in range(len(ids))]
    return Packed(heads, array("Q", bytes(8 * len(ids))), soft, list(hard), list(drops))


@contextlib.contextmanager
def flooded(*script: Packed | list[Any] | OSError) -> Iterator[SocketCanPort]:
    """A port at which frames waited so often that it reads on by the hundred."""
    wire, many = ScriptedSocket(), ScriptedMany()
    many.script.extend(script)
    port = SocketCanPort("lo", make_socket=lambda: cast("socket.socket", wire), many=many)
    with contextlib.closing(port):
        for _ in range(16):
            wire.arrives(Frame(0), S)
            assert port.gather() is None
            assert port.next(0) == Sighting(Frame(0), S, SIMULATED_DOUBT_NS)
        yield port


def told(port: SocketCanPort) -> list[int]:
    """Identifiers, and of what is no frame how many were lost, as it comes one by one."""
    return [
        item.frame.can_id if isinstance(item, Sighting) else -item.lost for item in drain(port)
    ]


def test_a_flood_is_handed_out_one_by_one() -> None:
    """Frames read by the hundred come out of `next` like all others, our own as our own."""
    with flooded(packed(4, 5), packed(6)) as port:
        assert drain(port) == [
            Sighting(Frame(each), (100 + place) * S, SIMULATED_DOUBT_NS, own=each == 5)
            for each, place in ((4, 0), (5, 1), (6, 0))
        ]


def test_a_flood_is_handed_out_as_columns_to_whom_they_serve() -> None:
    """`gather` gives all that was read together, and leaves what is no column to `next`."""
    error: Any = (struct.pack("=IB3x8s", 0x20000040, 8, bytes(8)), [], 0)
    with flooded(packed(4, 5), [error], packed(6)) as port:
        columns = port.gather()
        assert isinstance(columns, Columns)
        assert [seen.frame.can_id for seen in columns.sightings()] == [4, 5]
        assert port.gather() is None
        event = port.next(0)
        assert isinstance(event, BusEvent)
        assert event.kind is EventKind.BUS_OFF
        assert told(port) == [6]


@pytest.mark.parametrize(
    ("drops", "expected"),
    [
        ((0, 0, 0), [4, 5, 6]),
        ((2, 2, 2), [-2, 4, 5, 6]),
        ((0, 7, 7), [4, -7, 5, 6]),
        ((0, 0, 1), [4, 5, -1, 6]),
        ((1, 2, 4), [-1, 4, -1, 5, -2, 6]),
    ],
)
def test_what_a_flood_drops_is_told_where_it_is_missing(
    drops: Sequence[int], expected: list[int]
) -> None:
    """The kernel's total rises at a frame: those before it are missing."""
    with flooded(packed(4, 5, 6, drops=drops)) as port:
        assert told(port) == expected


def test_a_gap_in_a_flood_has_the_instant_of_the_frame_after_it() -> None:
    """As where frames are read one by one."""
    with flooded(packed(4, 5, drops=(0, 1))) as port:
        assert [item.at for item in drain(port)] == [100 * S, 101 * S, 101 * S]


def test_stamps_of_an_adapter_are_followed_in_a_flood() -> None:
    """Where it made them; a frame without one has the kernel's and its doubt."""
    with flooded(packed(4, 6, 8, hard=(5 * S, 6 * S - 1000, 0))) as port:
        first, second, third = drain(port)
        assert second.at - first.at == S - 1000
        assert isinstance(second, Sighting)
        assert isinstance(third, Sighting)
        assert second.doubt_ns == HARDWARE_DOUBT_NS
        assert (third.at, third.doubt_ns) == (102 * S, SIMULATED_DOUBT_NS)


def test_an_interface_that_goes_down_in_a_flood_loses_nothing() -> None:
    """What was read before comes out, then the event, then every verb raises."""
    with flooded(packed(4), OSError(errno.ENETDOWN, "down")) as port:
        found = drain_until_unavailable(port)
        assert [type(item) for item in found] == [Sighting, BusEvent]
        with pytest.raises(BusUnavailable, match="ip link set lo up"):
            port.next(0)
