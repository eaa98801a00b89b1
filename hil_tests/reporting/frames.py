"""What every reader of somebody else's recording hands out."""

from __future__ import annotations

from typing import NamedTuple

from hil_tests.trace import BusEvent, Sighting


class Logged(NamedTuple):
    """One entry of a log file."""

    entry: Sighting | BusEvent
    channel: str
    place: str
    """Where it stands, for people: "line 7", "frame 7"."""
