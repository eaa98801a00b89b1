"""Matchers: what each one takes and what it leaves."""

from __future__ import annotations

import pytest

from hil_tests.judge import matchers
from hil_tests.judge.cobs import State
from hil_tests.judge.matchers import Matcher
from node_model.frame import Frame

BOOT = Frame(0x705, b"\x00")
BEAT = Frame(0x705, b"\x7f")
EMCY = Frame(0x085, bytes.fromhex("00 50 01 00 00 00 00 00"))
ECHO = Frame(0x3F8, bytes.fromhex("05 03 00 64 00 01 00 00"))

TAKES = [
    (matchers.cob(0x185), Frame(0x185, b"\x01")),
    (matchers.cob(0x185), Frame(0x185)),
    (matchers.anything(), Frame(0x123, extended=True)),
    (matchers.any_of(frozenset((1, 2)), "x"), Frame(2, remote=True, dlc=1)),
    (matchers.exactly(0x185, b"\x01"), Frame(0x185, b"\x01")),
    (matchers.boot_up(5), BOOT),
    (matchers.heartbeat(5), BEAT),
    (matchers.heartbeat(5), Frame(0x705, b"\x05\x00")),
    (matchers.heartbeat(5), Frame(0x705)),
    (matchers.heartbeat(5, State.STOPPED), Frame(0x705, b"\x04")),
    (matchers.emcy(5), EMCY),
    (matchers.emcy(5, code_class=0x50), EMCY),
    (matchers.emcy(5, code=0x5000), EMCY),
    (matchers.key_frame(5), Frame(0x185, b"\x01\x02")),
    (matchers.key_frame(5, 0x0102, 2), Frame(0x185, b"\x02\x01")),
    (matchers.echo(), ECHO),
    (matchers.echo(ECHO.data[:6]), ECHO),
]

LEAVES = [
    (matchers.cob(0x185), Frame(0x186)),
    (matchers.cob(0x185), Frame(0x185, extended=True)),
    (matchers.cob(0x185), Frame(0x185, remote=True)),
    (matchers.any_of(frozenset((1, 2)), "x"), Frame(3)),
    (matchers.any_of(frozenset((1, 2)), "x"), Frame(2, extended=True)),
    (matchers.exactly(0x185, b"\x01"), Frame(0x185, b"\x01\x00")),
    (matchers.exactly(0x185, b"\x01"), Frame(0x186, b"\x01")),
    (matchers.boot_up(5), BEAT),
    (matchers.boot_up(5), Frame(0x706, b"\x00")),
    (matchers.boot_up(5), Frame(0x705, b"\x00\x00")),
    (matchers.heartbeat(5), BOOT),
    (matchers.heartbeat(5), Frame(0x706, b"\x7f")),
    (matchers.heartbeat(5, State.STOPPED), BEAT),
    (matchers.emcy(5), Frame(0x085, EMCY.data[:7])),
    (matchers.emcy(5), Frame(0x085)),
    (matchers.emcy(5), Frame(0x086, EMCY.data)),
    (matchers.emcy(5, code_class=0x00), EMCY),
    (matchers.emcy(5, code=0x0050), EMCY),
    (matchers.emcy(5, code=0x5001), EMCY),
    (matchers.key_frame(5, 1), Frame(0x185, b"\x02")),
    (matchers.echo(), Frame(0x3F9, ECHO.data)),
    (matchers.echo(ECHO.data[:6]), Frame(0x3F9, ECHO.data)),
    (matchers.echo(ECHO.data[:6]), Frame(0x3F8, ECHO.data[:5])),
]


def _name(value: object) -> str:
    return str(value)


@pytest.mark.parametrize(("matcher", "frame"), TAKES, ids=_name)
def test_takes(matcher: Matcher, frame: Frame) -> None:
    """What is looked for."""
    assert matcher.accepts(frame)


@pytest.mark.parametrize(("matcher", "frame"), LEAVES, ids=_name)
def test_leaves(matcher: Matcher, frame: Frame) -> None:
    """What only resembles it."""
    assert not matcher.accepts(frame)


@pytest.mark.parametrize(
    ("matcher", "text"),
    [
        (matchers.cob(0x185), "a frame 185h"),
        (matchers.cob(0x185, "keys"), "keys"),
        (matchers.exactly(0x185, b"\x01\xff"), "185h with 01 FF"),
        (matchers.heartbeat(5, State.STOPPED), "heartbeat of node 5 showing stopped"),
        (matchers.emcy(5), "EMCY of node 5"),
        (matchers.emcy(5, code_class=0x50), "EMCY 50xxh of node 5"),
        (matchers.emcy(5, code=0x5000), "EMCY 5000h of node 5"),
        (matchers.key_frame(5, 1), "key frame of node 5 with 01h"),
        (matchers.echo(b"\x01\x02"), "echo 3F8h with 01 02"),
    ],
)
def test_says_what_it_looks_for(matcher: Matcher, text: str) -> None:
    """The words of a failure message."""
    assert str(matcher) == text


@pytest.mark.parametrize(
    ("data", "state"),
    [
        (b"\x05", State.OPERATIONAL),
        (b"\x85", None),
        (b"\x00", None),
        (b"", None),
        (b"\x05\x00", None),
    ],
)
def test_shown_state(data: bytes, state: State | None) -> None:
    """A heartbeat is one byte that is a state."""
    assert matchers.shown_state(Frame(0x705, data)) is state
