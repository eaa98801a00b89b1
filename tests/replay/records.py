"""Records of tests, made by hand."""

from __future__ import annotations

from pathlib import Path

from hil_tests.replay.record import TestRecord
from hil_tests.replay.source import Source
from hil_tests.trace import Entry, Moment, Sighting
from node_model.frame import Frame

FACTS: dict[str, object] = {
    "test": "t.py::test_it",
    "bench": "desk",
    "port": {"name": "can0", "timed": True, "clock": "a clock", "doubt_ns": 0},
    "virtual": True,
    "exclusive": True,
    "writes_allowed": True,
    "fades": False,
    "bit_rate": 250_000,
    "facilities": ["power", "keys", "leds", "bitrate"],
    "timed_sequences": False,
    "sees_edges": True,
    "health": False,
    "parameters": None,
    "home": None,
    "held": [],
    "active": [],
    "power": {"on": None, "off_since": None},
    "heard": False,
}
BEAT = Frame(0x701, b"\x05")
START = Frame(0x000, b"\x01\x01")


def record(*entries: Entry, end: int | None = 1000, **facts: object) -> TestRecord:
    """A record that begins at 0; `end` None = it breaks off."""
    opening = Moment("begin", 0, 0, {**FACTS, **facts})
    ends = None if end is None else Moment("end", end, end, {"outcome": "passed", "text": ""})
    return TestRecord(Path("t.pcapng"), opening, entries, ends, ())


def source(*entries: Entry, end: int | None = 1000, virtual: bool = True) -> Source:
    """The place at the beginning of such a record."""
    return Source(record(*entries, end=end), virtual=virtual)


def beat(at: int) -> Sighting:
    """A heartbeat of the device."""
    return Sighting(BEAT, at)


def own(at: int, frame: Frame = START) -> Sighting:
    """A frame of the tester."""
    return Sighting(frame, at, own=True)


def power(at: int, on: bool) -> Moment:
    """The supply was switched."""
    return Moment("power", at, at, {"on": on})
