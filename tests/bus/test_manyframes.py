"""Frames by the hundred, over a socket that carries the kernel's struct can_frame as datagrams."""

from __future__ import annotations

import socket
import struct
import time

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from hil_tests.bus import rawcan
from hil_tests.bus.manyframes import ManyFrames, Packed
from node_model.frame import Frame
from tests.bus.conftest import Pair

ERROR = struct.pack("=IB3x8s", rawcan.ERR_FLAG | 4, 8, bytes(8))
FD = struct.pack("=IB3x64s", 0x123, 12, bytes(64))
GARBAGE_BEHIND = struct.pack("=IB3x8s", 0x123, 2, b"12345678")


def received(pair: Pair, *raw: bytes) -> tuple[ManyFrames, Packed | None]:
    """What comes of these datagrams."""
    sender, receiver = pair
    for each in raw:
        sender.send(each)
    many = ManyFrames()
    assert many.receive(receiver.fileno()) == len(raw)
    return many, many.packed()


@st.composite
def frames(draw: st.DrawFn) -> Frame:
    """Any frame."""
    extended, remote = draw(st.booleans()), draw(st.booleans())
    can_id = draw(st.integers(0, 0x1FFF_FFFF if extended else 0x7FF))
    if remote:
        return Frame(can_id, remote=True, extended=extended, dlc=draw(st.integers(0, 15)))
    data = draw(st.binary(max_size=8))
    dlc = draw(st.integers(8, 15)) if len(data) == 8 else -1
    return Frame(can_id, data, extended=extended, dlc=dlc)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(sent=st.lists(frames(), min_size=1, max_size=20))
def test_heads_and_bodies_are_those_of_the_frames(pair: Pair, sent: list[Frame]) -> None:
    """Of every kind and length, each with its stamp; nothing was dropped."""
    began = time.time_ns()
    _, found = received(pair, *map(rawcan.pack, sent))
    assert found is not None
    assert list(found.heads) == [frame.head for frame in sent]
    assert list(found.bodies) == [frame.body for frame in sent]
    assert found.soft == sorted(found.soft)
    assert began <= found.soft[0] <= found.soft[-1] <= time.time_ns()
    assert (found.hard, found.drops) == ([], [])


def test_what_stands_behind_the_data_is_nobodys(pair: Pair) -> None:
    """A frame of two bytes has two, whatever its sender left in its memory."""
    _, found = received(pair, GARBAGE_BEHIND)
    assert found is not None
    assert list(found.bodies) == [int.from_bytes(b"12", "big")]


@pytest.mark.parametrize("odd", [ERROR, FD, b"", b"x" * 15, b"x" * 17])
@pytest.mark.parametrize("place", [0, 1, 2])
def test_what_is_no_frame_is_left_to_a_closer_look(pair: Pair, odd: bytes, place: int) -> None:
    """All that came with it is given one by one, in order, the odd one as it is."""
    sent = [rawcan.pack(Frame(1)), rawcan.pack(Frame(2, b"x"))]
    sent.insert(place, odd)
    many, found = received(pair, *sent)
    assert found is None
    assert [raw for raw, _, _ in many.datagrams()] == sent


def test_frames_without_a_stamp_are_left_to_a_closer_look(pair: Pair) -> None:
    """They do not get those of the frames that were read before them."""
    sender, receiver = pair
    many = ManyFrames()
    for stamped in (1, 0, 1):
        receiver.setsockopt(socket.SOL_SOCKET, rawcan.SO_TIMESTAMPNS, stamped)
        sender.send(rawcan.pack(Frame(1)))
        assert many.receive(receiver.fileno()) == 1
        assert (many.packed() is not None) == bool(stamped)


def test_more_kinds_of_frames_than_are_remembered_are_never_mixed_up(pair: Pair) -> None:
    """Ten thousand extended identifiers through one reader."""
    sender, receiver = pair
    many = ManyFrames()
    for first in range(0, 10_000, 100):
        sent = [Frame(each * 7919, b"x", extended=True) for each in range(first, first + 100)]
        for frame in sent:
            sender.send(rawcan.pack(frame))
        assert many.receive(receiver.fileno()) == 100
        found = many.packed()
        assert found is not None
        assert list(found.heads) == [frame.head for frame in sent]
