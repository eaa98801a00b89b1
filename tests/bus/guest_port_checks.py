"""Checks of the SocketCAN port on a real vcan0; run by `guest_checks`."""

from __future__ import annotations

import contextlib
import os
import socket
import struct
import time
from collections.abc import Callable

from hil_tests.bus import link, rawcan
from hil_tests.bus.choose import open_port
from hil_tests.clock import MS, S
from hil_tests.errors import BusUnavailable
from hil_tests.trace import BusEvent, EventKind, Sighting
from node_model.frame import Frame
from tests.bus.guest_bus import CHANNEL, classical, next_frame, port, run_ip, stranger


def check_own_frames_and_stamps() -> str:
    """Own frames alone are own; every stamp lies inside the sender's system call."""
    worst = 0
    with port() as opened, stranger() as other:
        assert not opened.timed
        for number in range(20):
            began = time.time_ns()
            opened.send(Frame(0x123, bytes([number])))
            ended = time.time_ns()
            seen = next_frame(opened)
            assert seen.own
            assert seen.frame == Frame(0x123, bytes([number]))
            assert began <= seen.at <= ended, (began, seen.at, ended)
            other.send(classical(0x123, bytes([number])))
            assert not next_frame(opened).own
            worst = max(worst, ended - began)
    return f"send takes up to {worst / 1000:.0f} us"


def check_every_kind_of_frame() -> str:
    """Remote, extended and long-DLC frames survive the way; FD and error frames are events."""
    frames = [
        Frame(0x7FF, b"12345678"),
        Frame(0x1FFFFFFF, b"", extended=True),
        Frame(0x701, remote=True, dlc=1),
        Frame(0x123, bytes(8), dlc=12),
        Frame(0, b"\x01\x00"),
    ]
    with port() as opened, stranger(fd_frames=True) as other:
        for frame in frames:
            opened.send(frame)
            assert next_frame(opened).frame == frame, frame
        other.send(struct.pack("=IBB2x64s", 0x234, 12, 0, bytes(64)))
        event = opened.next(opened.now() + S)
        assert isinstance(event, BusEvent), event
        assert event.kind is EventKind.FD_FRAME
        assert "234h, 12 bytes" in event.text
        kinds = []
        for word, data in ((0x40, bytes(8)), (4, b"\0\1" + bytes(6)), (8, bytes(8))):
            other.send(classical(0x20000000 | word, data))
            event = opened.next(opened.now() + S)
            assert isinstance(event, BusEvent), event
            kinds.append(event.kind)
        assert kinds == [EventKind.BUS_OFF, EventKind.OVERFLOW, EventKind.ERROR], kinds
    return "ok"


def check_waiting() -> str:
    """`next` ends at its instant, at a descriptor, or with what is there already."""
    with port() as opened, stranger() as other:
        began = opened.now()
        assert opened.next(began + 50 * MS) is None
        late = opened.now() - began - 50 * MS
        assert late >= 0
        reader, writer = os.pipe()
        os.write(writer, b"x")
        assert opened.next(opened.now() + 10 * S, [reader]) is None
        assert opened.now() - began < 5 * S
        other.send(classical(1, b""))
        assert opened.next(0) is not None
        assert opened.next(0) is None
        os.close(reader)
        os.close(writer)
    return f"wakes {late / 1000:.0f} us late"


def check_lost_frames_are_told() -> str:
    """What the kernel dropped is counted and stands where it is missing."""
    sent = 3000
    with port() as opened, stranger() as other:
        opened._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        for number in range(sent):
            other.send(classical(0x100, struct.pack("<H", number)))
        seen = [opened.next(0)]
        while seen[-1] is not None:
            seen.append(opened.next(0))
        other.send(classical(0x101, b""))
        gap, last = opened.next(opened.now() + S), opened.next(opened.now() + S)
        assert isinstance(gap, BusEvent), gap
        assert gap.kind is EventKind.GAP
        assert isinstance(last, Sighting)
        assert last.frame.can_id == 0x101
        assert len(seen) - 1 + gap.lost == sent, (len(seen), gap)
    return f"{gap.lost} of {sent} lost and told"


def check_nothing_is_lost_by_default() -> str:
    """A reader that sleeps through 20 000 frames still gets them all."""
    sent = 20_000
    with port() as opened, stranger() as other:
        raw = classical(0x100, b"12345678")
        for _ in range(sent):
            other.send(raw)
        began = time.time_ns()
        count = 0
        while (found := opened.next(0)) is not None:
            assert isinstance(found, Sighting), found
            count += 1
        assert count == sent, count
    return f"read in {(time.time_ns() - began) / sent / 1000:.1f} us a frame"


def check_a_flood_is_recorded_as_it_came() -> str:
    """Frames of every shape by the hundred, our own, and what is no frame, all in their place."""
    frames = [
        Frame(0x7FF, b"12345678"),
        Frame(0x1FFFFFFF, b"123", extended=True),
        Frame(0x701, remote=True, dlc=1),
        Frame(0x123, bytes(8), dlc=12),
        Frame(0),
    ]
    count = 4000
    with port() as opened, stranger() as other:
        for number in range(count):
            if number % 7 == 0:
                opened.send(frames[number % 5])
            else:
                other.send(rawcan.pack(frames[number % 5]))
            if number == count // 2:
                other.send(classical(0x20000004, b"\0\1" + bytes(6)))
        found: list[Sighting | BusEvent] = []
        at_once = 0
        while (item := opened.next(0)) is not None:
            found.append(item)
            while (columns := opened.gather()) is not None:
                found.extend(columns.sightings())
                at_once += len(columns.heads)
    event = found.pop(count // 2 + 1)
    assert isinstance(event, BusEvent), event
    assert event.kind is EventKind.OVERFLOW, event
    seen = [item for item in found if isinstance(item, Sighting)]
    assert [(item.frame, item.own) for item in seen] == [
        (frames[number % 5], number % 7 == 0) for number in range(count)
    ]
    stamps = [item.at for item in seen]
    assert stamps == sorted(stamps)
    assert {item.doubt_ns for item in seen} == {opened.doubt_ns}
    assert at_once > count * 0.8, at_once
    return f"{at_once} of {count} by the hundred"


def check_losses_of_a_flood_are_told_in_their_places() -> str:
    """Numbered frames at a queue that holds few: each jump of the numbers is told, exactly."""
    with port() as opened, stranger() as other:
        opened._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 100_000)
        expected = lost = gaps = 0
        for first in range(0, 20_000, 1000):
            for number in range(first, first + 1000):
                other.send(classical(0x100, struct.pack("<I", number)))
            while (item := opened.next(0)) is not None:
                if isinstance(item, BusEvent):
                    assert item.kind is EventKind.GAP, item
                    lost, gaps = lost + item.lost, gaps + 1
                    expected += item.lost
                    continue
                assert item.frame.data == struct.pack("<I", expected), (item, expected)
                expected += 1
        assert gaps > 3, gaps
        assert 1000 < lost < 19_000, lost
    return f"{lost} of 20000 lost, told in {gaps} places"


def check_channel_is_locked() -> str:
    """The second tester is refused and told who is there."""
    with port():
        try:
            open_port("socketcan", CHANNEL)
        except BusUnavailable as error:
            assert f"pid {os.getpid()}" in str(error), error
        else:
            raise AssertionError("not refused")
    with port():
        return "ok"


def check_interface_that_is_missing_or_down() -> str:
    """The remedy is named; an interface that goes down is an event, then an error."""
    for channel, text in (("vcan7", "ip link add dev vcan7 type vcan"), ("lo", "lo")):
        try:
            open_port("socketcan", channel)
        except BusUnavailable as error:
            assert text in str(error), error
        else:
            raise AssertionError(channel)
    with port() as opened, stranger() as other:
        other.send(classical(0x55, b""))
        run_ip("link", "set", CHANNEL, "down")
        try:
            assert next_frame(opened).frame.can_id == 0x55
            event = opened.next(opened.now() + S)
            assert isinstance(event, BusEvent), event
            assert event.kind is EventKind.DOWN
            verbs: list[Callable[[], object]] = [
                lambda: opened.next(0),
                lambda: opened.send(Frame(1)),
            ]
            for verb in verbs:
                try:
                    verb()
                except BusUnavailable as error:
                    assert f"ip link set {CHANNEL} up" in str(error), error
                else:
                    raise AssertionError("not told")
            opened.close()
            try:
                open_port("socketcan", CHANNEL)
            except BusUnavailable as error:
                assert "is down" in str(error), error
            else:
                raise AssertionError("opened")
        finally:
            run_ip("link", "set", CHANNEL, "up")
    return "ok"


def check_setting_the_bit_rate_leaves_no_error_behind() -> str:
    """Our own taking down of the interface is not taken for a fault."""

    class Flap(link.BitRate):
        """Takes the interface down and up, as a change of bit rate does."""

        def ensure(self, bit_rate: int) -> None:  # noqa: ARG002 - vcan has none
            run_ip("link", "set", CHANNEL, "down")
            run_ip("link", "set", CHANNEL, "up")

    with port() as opened, stranger() as other:
        opened._rate = Flap(CHANNEL)
        opened.set_bit_rate(250_000)
        with contextlib.suppress(OSError):
            other.getsockopt(socket.SOL_SOCKET, socket.SO_ERROR)
        opened.send(Frame(5))
        assert next_frame(opened).own
        other.send(classical(6, b""))
        assert next_frame(opened).frame == Frame(6)
    return "ok"
