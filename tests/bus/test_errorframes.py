"""Error frames of SocketCAN in words."""

from __future__ import annotations

import pytest

from hil_tests.bus.errorframes import error_event
from hil_tests.trace import EventKind


@pytest.mark.parametrize(
    ("word", "detail", "kind", "words"),
    [
        (0x040, 0x00, EventKind.BUS_OFF, "bus off"),
        (0x044, 0x01, EventKind.BUS_OFF, "bus off"),
        (0x004, 0x01, EventKind.OVERFLOW, "receive buffer overflow"),
        (0x004, 0x20, EventKind.ERROR, "controller, transmit error passive"),
        (0x008, 0x01, EventKind.ERROR, "protocol violation"),
        (0x100, 0x00, EventKind.ERROR, "controller restarted"),
        (0x000, 0x00, EventKind.ERROR, "unknown"),
    ],
)
def test_error_frame_is_told(word: int, detail: int, kind: EventKind, words: str) -> None:
    """Class and controller state become the kind of event and its text."""
    event = error_event(word, bytes([0, detail, 0, 0, 0, 0, 0, 0]), 77)

    assert event.kind is kind
    assert words in event.text
    assert event.at == 77
