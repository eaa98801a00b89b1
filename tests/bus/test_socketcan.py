"""The SocketCAN port over a scripted socket; `guest_checks` has it on a real vcan0.

The interface is "lo", which is up everywhere, and is not spoken to.
"""

from __future__ import annotations

import contextlib
import errno
import os
import socket
import struct
from collections import deque
from collections.abc import Iterator
from functools import partial
from typing import Any, cast

import pytest

from hil_tests.bus import rawcan
from hil_tests.bus.socketcan import HARDWARE_DOUBT_NS, SIMULATED_DOUBT_NS, SocketCanPort
from hil_tests.clock import MS, S
from hil_tests.errors import BusUnavailable
from hil_tests.trace import BusEvent, EventKind, Sighting
from node_model.frame import Frame

Note = tuple[int, int, bytes]
Received = tuple[bytes, list[Note], int, object] | OSError


class ScriptedSocket:
    """A raw CAN socket that receives what it is told to."""

    def __init__(self) -> None:
        self.ours, self.theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_DGRAM)
        self.script: deque[Received] = deque()
        self.refusals: deque[OSError] = deque()
        self.sent: list[bytes] = []
        self.options: set[tuple[int, int]] = set()

    def arrives(self, frame: Frame | bytes, at: int = 0, own: bool = False, **more: Any) -> None:
        """A frame comes in, stamped by the kernel; `drops` is the running total of drops."""
        raw = rawcan.pack(frame) if isinstance(frame, Frame) else frame
        notes: list[Note] = []
        if "hard" in more:
            body = struct.pack("@6l", *divmod(at, S), 0, 0, *divmod(more["hard"], S))
            notes.append((1, rawcan.SO_TIMESTAMPING, body))
        elif at:
            notes.append((1, rawcan.SO_TIMESTAMPNS, struct.pack("@ll", *divmod(at, S))))
        if "drops" in more:
            notes.append((1, rawcan.SO_RXQ_OVFL, struct.pack("=I", more["drops"])))
        self.script.append((raw, notes, rawcan.MSG_CONFIRM if own else 0, None))
        self.theirs.send(b"x")

    def fails(self, code: int) -> None:
        """The kernel reports an error on the socket."""
        self.script.append(OSError(code, os.strerror(code)))
        self.theirs.send(b"x")

    def recvmsg(self, *_: int) -> Any:
        """As socket.recvmsg."""
        if not self.script:
            raise BlockingIOError
        self.ours.recv(1)
        found = self.script.popleft()
        if isinstance(found, OSError):
            raise found
        return found

    def send(self, raw: bytes) -> int:
        """As socket.send."""
        if self.refusals:
            raise self.refusals.popleft()
        self.sent.append(raw)
        return len(raw)

    def setsockopt(self, level: int, option: int, _: object) -> None:
        """As socket.setsockopt."""
        if option == 33:  # SO_RCVBUFFORCE needs a privilege
            raise PermissionError(errno.EPERM, "no")
        self.options.add((level, option))

    def getsockopt(self, *_: int) -> int:
        """As socket.getsockopt."""
        return 0

    def bind(self, _: object) -> None:
        """As socket.bind."""

    def setblocking(self, _: bool) -> None:
        """As socket.setblocking."""

    def fileno(self) -> int:
        """As socket.fileno."""
        return self.ours.fileno()

    def close(self) -> None:
        """As socket.close."""
        self.ours.close()
        self.theirs.close()


@pytest.fixture
def wire() -> ScriptedSocket:
    """What the port believes to be a raw CAN socket."""
    return ScriptedSocket()


@pytest.fixture
def port(wire: ScriptedSocket) -> Iterator[SocketCanPort]:
    """A port on it."""
    opened = SocketCanPort("lo", make_socket=lambda: cast("socket.socket", wire))
    with contextlib.closing(opened):
        yield opened


def drain(port: SocketCanPort) -> list[Sighting | BusEvent]:
    """Everything that is there."""
    found = []
    while (item := port.next(0)) is not None:
        found.append(item)
    return found


def test_frame_has_the_kernels_stamp(port: SocketCanPort, wire: ScriptedSocket) -> None:
    """To the nanosecond, with the doubt of the wire, and own by MSG_CONFIRM alone."""
    at = 1_795_329_081_123_456_789
    wire.arrives(Frame(0x705, b"\x05"), at)
    wire.arrives(Frame(0x705, b"\x05"), at + 1, own=True)

    doubt = SIMULATED_DOUBT_NS
    assert drain(port) == [
        Sighting(Frame(0x705, b"\x05"), at, doubt, own=False),
        Sighting(Frame(0x705, b"\x05"), at + 1, doubt, own=True),
    ]


def test_frame_without_a_stamp_has_the_present(port: SocketCanPort, wire: ScriptedSocket) -> None:
    """A kernel that stamps nothing is no reason to fail."""
    began = port.now()
    wire.arrives(Frame(1))
    (seen,) = drain(port)

    assert began <= seen.at <= port.now()


def test_hardware_stamps_are_followed(port: SocketCanPort, wire: ScriptedSocket) -> None:
    """The adapter's own clock gives the spacing, the kernel's the place."""
    wire.arrives(Frame(1), 1000 * S + 300_000, hard=5 * S)
    wire.arrives(Frame(1), 1001 * S + 900_000, hard=6 * S)
    first, second = drain(port)

    assert second.at - first.at == S
    assert isinstance(first, Sighting)
    assert first.doubt_ns == HARDWARE_DOUBT_NS


def test_dropped_frames_are_told_where_they_are_missing(
    port: SocketCanPort, wire: ScriptedSocket
) -> None:
    """The kernel's total is turned into losses; its wrap at 32 bits is no loss of billions."""
    wire.arrives(Frame(1), S)
    wire.arrives(Frame(2), 2 * S, drops=0xFFFF_FFFE)
    wire.arrives(Frame(3), 3 * S, drops=0xFFFF_FFFE)
    wire.arrives(Frame(4), 4 * S, drops=1)
    found = drain(port)
    told = [item.lost if isinstance(item, BusEvent) else item.frame.can_id for item in found]

    assert told == [1, 0xFFFF_FFFE, 2, 3, 3, 4]
    assert found[4].at == 4 * S


def test_what_came_before_the_interface_went_down_is_not_lost(
    port: SocketCanPort, wire: ScriptedSocket
) -> None:
    """The kernel reports the error first; the port puts the order right."""
    wire.fails(errno.ENETDOWN)
    wire.arrives(Frame(1), S)
    wire.arrives(Frame(2), 2 * S, drops=7)
    found = drain_until_unavailable(port)

    assert [item.frame.can_id for item in found if isinstance(item, Sighting)] == [1, 2]
    kinds = [item.kind for item in found if isinstance(item, BusEvent)]
    assert kinds == [EventKind.GAP, EventKind.DOWN]
    assert isinstance(found[-1], BusEvent)


def drain_until_unavailable(port: SocketCanPort) -> list[Sighting | BusEvent]:
    """Everything up to the error."""
    found: list[Sighting | BusEvent] = []
    with contextlib.suppress(BusUnavailable):
        while (item := port.next(0)) is not None:
            found.append(item)
        pytest.fail("the port went on")
    return found


@pytest.mark.parametrize(
    ("code", "text"),
    [
        (errno.ENETDOWN, "ip link set lo up"),
        (errno.ENODEV, "the interface went away"),
        (errno.EIO, "errno 5"),
    ],
)
def test_error_names_its_remedy(
    code: int, text: str, port: SocketCanPort, wire: ScriptedSocket
) -> None:
    """The event and each later verb say the same."""
    wire.fails(code)
    (event,) = drain_until_unavailable(port)

    assert isinstance(event, BusEvent)
    assert text in event.text
    with pytest.raises(BusUnavailable, match=text):
        port.send(Frame(1))


def test_full_queue_is_tried_again(port: SocketCanPort, wire: ScriptedSocket) -> None:
    """ENOBUFS and EAGAIN pass by themselves."""
    wire.refusals.extend(
        OSError(code, "full") for code in (errno.ENOBUFS, errno.EAGAIN, errno.ENOBUFS)
    )
    port.send(Frame(0x123, b"a"))

    assert wire.sent == [rawcan.pack(Frame(0x123, b"a"))]


def test_queue_that_stays_full_is_an_error(port: SocketCanPort, wire: ScriptedSocket) -> None:
    """`send` never waits for ever; the message says what to look at."""
    port.send_limit_ns = 0
    wire.refusals.extend(OSError(errno.ENOBUFS, "full") for _ in range(100))

    with pytest.raises(BusUnavailable, match="termination"):
        port.send(Frame(0x123, b"a"))


def test_send_to_a_dead_interface_is_an_error(port: SocketCanPort, wire: ScriptedSocket) -> None:
    """The remedy is named."""
    wire.refusals.append(OSError(errno.ENETDOWN, "down"))

    with pytest.raises(BusUnavailable, match="ip link set lo up"):
        port.send(Frame(1))


def test_no_stranger_bytes_become_frames(port: SocketCanPort, wire: ScriptedSocket) -> None:
    """CAN FD frames and error frames are events."""
    wire.arrives(struct.pack("=IBBxx64s", 0x80000123, 20, 1, bytes(64)), S)
    wire.arrives(struct.pack("=IB3x8s", 0x20000040, 8, bytes(8)), 2 * S)
    found = drain(port)

    kinds = [item.kind for item in found if isinstance(item, BusEvent)]
    assert kinds == [EventKind.FD_FRAME, EventKind.BUS_OFF]
    assert [item.at for item in found] == [S, 2 * S]


def test_wait_ends_at_the_instant_or_with_a_descriptor(port: SocketCanPort) -> None:
    """None in both cases."""
    until = port.now() + 12 * MS
    assert port.next(until) is None
    assert port.now() >= until

    reader, writer = os.pipe()
    os.write(writer, b"x")
    assert port.next(port.now() + 3600 * S, [reader]) is None
    os.close(reader)
    os.close(writer)


def test_many_different_frames_are_all_right(port: SocketCanPort, wire: ScriptedSocket) -> None:
    """The memory of frames seen is bounded, and never mixes them up."""
    for number in range(9000):
        wire.arrives(Frame(number % 0x7FF, number.to_bytes(2, "big")), S)
        seen = port.next(0)
        assert isinstance(seen, Sighting)
        assert seen.frame == Frame(number % 0x7FF, number.to_bytes(2, "big"))


def test_close_releases_the_channel(wire: ScriptedSocket) -> None:
    """Closing twice is allowed; then the next run may come."""
    for _ in range(2):
        again = ScriptedSocket()
        port = SocketCanPort("lo", make_socket=partial(cast, "socket.socket", again))
        assert not port.timed
        port.set_bit_rate(250_000)
        port.close()
        port.close()
    wire.close()


def test_missing_interface_releases_the_channel() -> None:
    """A port that did not open holds nothing."""
    for _ in range(2):
        again = ScriptedSocket()
        with pytest.raises(BusUnavailable, match="no CAN interface 'vcan-none'"):
            SocketCanPort("vcan-none", make_socket=partial(cast, "socket.socket", again))
        assert again.ours.fileno() == -1


def test_step_of_the_clock_is_a_gap(port: SocketCanPort) -> None:
    """Intervals across it mean nothing."""
    port._steps._offset += 5 * S
    event = port.next(0)

    assert isinstance(event, BusEvent)
    assert event.kind is EventKind.GAP
    assert "clock was set by -" in event.text
