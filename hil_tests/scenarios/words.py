"""The verbs of scenarios: what each acts on, and what it takes of a bench.

One table, read by the text form, by the player and by what makes scenarios up.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from functools import lru_cache
from typing import NamedTuple

from hil_tests.api import Frame, Nmt, cobs
from hil_tests.clock import S, parse_span

COMMANDS = {
    "start": Nmt.START,
    "stop": Nmt.STOP,
    "pre-operational": Nmt.PRE_OPERATIONAL,
    "reset-node": Nmt.RESET_NODE,
    "reset-communication": Nmt.RESET_COMMUNICATION,
}
TO = ("own", "all", "other", "alike")
"""The device, everybody, its neighbour, and one whose id ends in the same four bits."""

MOST_NODE_ID = 127
"""CiA 301."""

OWN_RATE = 0
"""The bit rate at which the device runs."""

_FRAME = re.compile(
    r"(?P<id>[0-9A-Fa-f]{3}|[0-9A-Fa-f]{8})#(?:R(?P<remote>[0-9A-Fa-f]?)"
    r"|(?P<data>(?:[0-9A-Fa-f]{2}){0,8})(?:_(?P<dlc>[9A-Fa-f]))?)"
)
_READ = 1024
"""Texts that are remembered: explorers play the same ones thousands of times a second."""

LONGEST_WATCH_NS = 60 * S
"""Somebody watches LEDs for a minute at most."""

_HIGHEST = 0x080
_LOWEST = 0x7FF


class Command(NamedTuple):
    """An NMT command byte and to whom it goes."""

    command: int
    to: str


class Loading(NamedTuple):
    """A station that loads the bus.

    Args:
        share_ppm: of the bus time; 0 = it falls silent.
        frames: what it sends in turn.
    """

    share_ppm: int
    frames: tuple[Frame, ...]


@lru_cache(_READ)
def mask(text: str) -> int:
    """Keys as binary digits, the first key on the right."""
    if len(text) > 64:
        raise ValueError("a keypad has 64 keys at most")
    if set(text) - {"0", "1"}:
        raise ValueError  # a sign, or digits that int() reads, too
    return int(text, 2)


@lru_cache(_READ)
def command(text: str) -> Command:
    """The command of a step "nmt"."""
    name, to = (*text.split(), "own")[:2]
    if to not in TO or len(text.split()) > 2:
        raise ValueError
    return Command(COMMANDS[name] if name in COMMANDS else _byte(name), to)


def _byte(text: str) -> int:
    value = int(text, 16)
    if not 0 <= value <= 0xFF:
        raise ValueError
    return value


@lru_cache(_READ)
def payload(text: str) -> bytes:
    """The data bytes of a step."""
    data = b"" if text == "-" else bytes.fromhex(text)
    if len(data) > 8 or not text:
        raise ValueError
    return data


class Sent(NamedTuple):
    """A frame; `relative` = the node id is added to its identifier."""

    frame: Frame
    relative: bool


@lru_cache(_READ)
def sent(text: str) -> Sent:
    """The frame of a step "send"."""
    frame, relative = frame_of(text.removeprefix("+")), text.startswith("+")
    if relative:
        Frame(frame.can_id + MOST_NODE_ID, extended=frame.extended)  # refuses what does not fit
    return Sent(frame, relative)


@lru_cache(_READ)
def map_to(verb: str, text: str, node_id: int) -> Frame:
    """The frame of a step "led" or "blink", for a device of that node id."""
    return Frame(LED_MAPS[verb] + node_id, payload(text))


@lru_cache(_READ)
def sent_to(text: str, node_id: int) -> Frame:
    """The frame of a step "send", for a device of that node id."""
    frame, relative = sent(text)
    if not relative:
        return frame
    return Frame(frame.can_id + node_id, frame.data, frame.remote, frame.extended, frame.dlc)


def frame_of(text: str) -> Frame:
    """The frame in candump's notation: 123#1122, 00000123#, 123#R2, 123#1122334455667788_9.

    Raises:
        ValueError: it is none.
    """
    found = _FRAME.fullmatch(text)
    if found is None:
        raise ValueError
    can_id, extended = int(found["id"], 16), len(found["id"]) == 8
    if found["data"] is None:
        return Frame(
            can_id, b"", remote=True, extended=extended, dlc=int(found["remote"] or "0", 16)
        )
    dlc = int(found["dlc"], 16) if found["dlc"] else -1
    return Frame(can_id, bytes.fromhex(found["data"]), extended=extended, dlc=dlc)


def power(text: str) -> bool:
    """Whether a step "power" switches on."""
    return {"on": True, "off": False}[text]


def rate(text: str) -> int:
    """The bit rate of a step "rate"; `OWN_RATE` = that of the device."""
    bits = OWN_RATE if text == "own" else int(text)
    if bits and not 1000 <= bits <= 1_000_000:
        raise ValueError
    return bits


def loading(text: str) -> Loading:
    """The station of a step "load"."""
    if text == "off":
        return Loading(0, ())
    share, priority = text.split()
    percent = int(share.removesuffix("%"))
    if not 1 <= percent <= 100 or not share.endswith("%"):
        raise ValueError
    can_id = {"high": _HIGHEST, "low": _LOWEST}[priority]
    return Loading(percent * 10_000, (Frame(can_id, bytes(8)), Frame(can_id, b"\xff" * 8)))


@lru_cache(_READ)
def watched(text: str) -> int:
    """How long a step "watch" lasts, in ns."""
    span_ns = parse_span(text)
    if not 0 < span_ns <= LONGEST_WATCH_NS:
        raise ValueError("LEDs are watched for a minute at most")
    return span_ns


def _nothing(text: str) -> None:
    if text:
        raise ValueError


class Word(NamedTuple):
    """A verb.

    Args:
        form: how it is written, for people.
        read: what its text stands for; raises ValueError or KeyError.
        needs: facilities of the bench.
        writes: it may change what the device has stored.
        exclusive: it would disturb others on the bus.
    """

    form: str
    read: Callable[[str], object]
    needs: tuple[str, ...] = ()
    writes: bool = False
    exclusive: bool = False


WORDS: Mapping[str, Word] = {
    "keys": Word("keys BITS, the first key on the right: keys 101", mask, ("keys",)),
    "nmt": Word(
        f"nmt COMMAND [{'|'.join(TO)}], COMMAND of {', '.join(COMMANDS)} or a byte in hex",
        command,
    ),
    "led": Word("led HEX, the bytes of 200h + id, - for none", payload),
    "blink": Word("blink HEX, the bytes of 300h + id, - for none", payload),
    "send": Word(
        "send FRAME as candump writes it: send 123#1122; with a + its identifier is a base to"
        " which the node id is added: send +200#0F",
        sent,
        (),
        False,
        True,
    ),
    "request": Word(
        "request HEX, the bytes of 4F8h: request 050200640001", payload, ("power", "keys"), True
    ),
    "power": Word("power on or power off", power, ("power",)),
    "rate": Word("rate N in bit/s, or rate own", rate, ("bitrate",), False, True),
    "load": Word("load PERCENT% high|low, or load off", loading, (), False, True),
    "look": Word("look: what the LEDs show", _nothing, ("leds",)),
    "watch": Word(
        "watch SPAN: every change of an LED in that time: watch 2500ms", watched, ("leds",)
    ),
    "wait": Word("wait: nothing is done", _nothing),
}

LED_MAPS = {"led": cobs.LED_STEADY, "blink": cobs.LED_BLINK}
