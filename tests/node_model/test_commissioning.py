"""Commissioning: wait for one 4F8h, store it, echo it for ever."""

from __future__ import annotations

import pytest

from node_model.frame import Frame
from node_model.keypad import Parameters
from node_model.keypad.commissioning import Commissioning
from node_model.node import MS
from node_model.storage import RecordStore

DATA = b"\x0f\x01\x03\xe8\x14\x02"
REQUEST = Frame(0x4F8, DATA)
ECHO = Frame(0x3F8, DATA)


def waiting() -> tuple[Commissioning, RecordStore]:
    """A blank keypad in commissioning-wait since 0."""
    store = RecordStore(6)
    return Commissioning(store, 0), store


def test_it_waits_in_silence_at_125_kbit() -> None:
    """Nothing is due, and keys mean nothing: the source's "125 Kbaud (TX, RX)"."""
    mode, _ = waiting()
    assert mode.bit_rate == 125_000
    assert mode.deadline() is None
    assert mode.advance(10**12) == ()
    assert mode.hold(0xFF, 10**12) == ()


def test_4f8_is_echoed_as_3f8_every_100_ms_from_reception() -> None:
    """The same six bytes; the first echo at once, the others on a grid."""
    mode, _ = waiting()
    assert mode.receive(REQUEST, 7 * MS) == [ECHO]
    sent: list[tuple[int, Frame]] = []
    while len(sent) < 5:
        due = mode.deadline()
        assert due is not None
        sent += [(due, frame) for frame in mode.advance(due)]
    assert sent == [((7 + 100 * n) * MS, ECHO) for n in range(1, 6)]


def test_a_late_call_finds_every_echo_that_was_due() -> None:
    """Three periods late there are three echoes."""
    mode, _ = waiting()
    mode.receive(REQUEST, 0)
    assert mode.advance(300 * MS) == [ECHO] * 3


def test_the_parameters_are_safe_60_ms_after_reception() -> None:
    """Twelve bytes at 5 ms each."""
    mode, store = waiting()
    mode.receive(REQUEST, 0)
    mode.advance(60 * MS - 1)
    assert store.load() is None
    mode.advance(60 * MS)
    assert store.load() == DATA


def test_a_second_message_changes_nothing() -> None:
    """The source's "unico messaggio"."""
    mode, store = waiting()
    mode.receive(REQUEST, 0)
    assert mode.receive(Frame(0x4F8, b"\x05\x02\x00\x64\x00\x01"), 50 * MS) == ()
    assert mode.advance(100 * MS) == [ECHO]
    assert store.load() == DATA


@pytest.mark.parametrize(
    "frame",
    [
        Frame(0x4F8, DATA[:5]),
        Frame(0x4F8, remote=True, dlc=6),
        Frame(0x4F8, DATA, extended=True),
        Frame(0x4F8, b"\x00" + DATA[1:]),
        Frame(0x4F8, b"\x10" + DATA[1:]),
        Frame(0x4F9, DATA),
        Frame(0x3F8, DATA),
        Frame(0, b"\x81\x00"),
        Frame(0x60F, bytes(8)),
    ],
    ids=str,
)
def test_everything_else_is_ignored(frame: Frame) -> None:
    """It goes on waiting, stores nothing, and still takes the right message."""
    mode, store = waiting()
    assert mode.receive(frame, 0) == ()
    assert mode.deadline() is None
    assert not any(store.memory)
    assert mode.receive(REQUEST, 1) == [ECHO]


def test_bytes_past_the_sixth_mean_nothing() -> None:
    """The echo has the six."""
    mode, _ = waiting()
    assert mode.receive(Frame(0x4F8, DATA + b"\xff\xff"), 0) == [ECHO]
    assert mode.decode(DATA + b"\xff\xff") == Parameters(15, 1, 1000, 20, 2)
