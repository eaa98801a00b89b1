"""What several tests of this folder start from."""

from __future__ import annotations

import socket
from collections.abc import Iterator

import pytest

from hil_tests.bus import rawcan

Pair = tuple[socket.socket, socket.socket]


@pytest.fixture
def pair() -> Iterator[Pair]:
    """A sender, and a receiver whose datagrams the kernel stamps."""
    with (
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as receiver,
    ):
        receiver.bind(("127.0.0.1", 0))
        receiver.setsockopt(socket.SOL_SOCKET, rawcan.SO_TIMESTAMPNS, 1)
        sender.connect(receiver.getsockname())
        yield sender, receiver
