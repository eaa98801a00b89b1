"""Many datagrams with one call, beside `socket.recvmsg` on the same kernel."""

from __future__ import annotations

import errno
import socket
import time

import pytest

from hil_tests.bus.datagrams import Datagrams
from tests.bus.conftest import Pair

ROOM, NOTES_ROOM = 24, 88


def test_nothing_waits(pair: Pair) -> None:
    """Then there are none, and no error."""
    many = Datagrams(ROOM, NOTES_ROOM)
    assert many.receive(pair[1].fileno()) == 0
    assert (many.sizes, many.flags, many.notes_sizes) == ([], [], [])


def test_all_that_waits_comes_in_order_call_by_call(pair: Pair) -> None:
    """As many as there is room for; the rest with the next call, and nothing of the one before."""
    sender, receiver = pair
    many = Datagrams(ROOM, NOTES_ROOM, most=3)
    for number in range(5):
        sender.send(bytes([number]) * (number + 1))
    assert many.receive(receiver.fileno()) == 3
    assert many.sizes == [1, 2, 3]
    assert [many.datagram(place)[0] for place in range(3)] == [b"\0", b"\1\1", b"\2\2\2"]
    assert many.receive(receiver.fileno()) == 2
    assert many.sizes == [4, 5]
    assert many.in_data("B", 3).tolist() == [3, 4]
    assert many.receive(receiver.fileno()) == 0


def test_one_is_as_recvmsg_gives_it(pair: Pair) -> None:
    """Content, notes with level and type, flags; a stamp between sending and reading."""
    sender, receiver = pair
    many = Datagrams(ROOM, NOTES_ROOM)
    began = time.time_ns()
    sender.send(b"first")
    sender.send(b"second")
    raw, notes, flags, _ = receiver.recvmsg(ROOM, NOTES_ROOM)
    assert many.receive(receiver.fileno()) == 1
    other_raw, other_notes, other_flags = many.datagram(0)
    assert (raw, other_raw) == (b"first", b"second")
    assert flags == other_flags == many.flags[0]
    assert [note[:2] for note in notes] == [note[:2] for note in other_notes]
    assert [len(note[2]) for note in notes] == [len(note[2]) for note in other_notes]
    assert many.notes_sizes == [socket.CMSG_SPACE(16)]
    head = socket.CMSG_LEN(0)
    (seconds,), (ns,) = many.in_notes("l", head).tolist(), many.in_notes("l", head + 8).tolist()
    assert began <= seconds * 10**9 + ns <= time.time_ns()


def test_what_is_too_long_is_cut_and_says_so(pair: Pair) -> None:
    """The datagram and its notes each by their flag; the neighbours are whole."""
    sender, receiver = pair
    many = Datagrams(ROOM, NOTES_ROOM)
    for size in (1, ROOM, ROOM + 1, 2):
        sender.send(b"x" * size)
    many.receive(receiver.fileno())
    assert many.sizes == [1, ROOM, ROOM, 2]
    assert [bool(flags & socket.MSG_TRUNC) for flags in many.flags] == [False, False, True, False]
    few = Datagrams(ROOM, 8)
    sender.send(b"x")
    few.receive(receiver.fileno())
    assert few.flags[0] & socket.MSG_CTRUNC


def test_what_the_kernel_reports_is_an_error(pair: Pair) -> None:
    """Once, with its number; then the socket goes on."""
    sender, receiver = pair
    port = receiver.getsockname()
    receiver.close()
    sender.send(b"to nobody")
    many = Datagrams(ROOM, NOTES_ROOM)
    with pytest.raises(ConnectionRefusedError) as caught:
        many.receive(sender.fileno())
    assert caught.value.errno == errno.ECONNREFUSED
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as again:
        again.bind(port)
        sender.send(b"to somebody")
        assert many.receive(again.fileno()) == 1
