"""Whose frame is it? The device's, as far as its identifier tells."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from hil_tests.judge.cobs import device_ids
from hil_tests.judge.expected import Expected, Family
from hil_tests.judge.frames import identifiers
from node_model.frame import Frame

_IDENTIFIERS: Mapping[Family, Callable[[int | None], frozenset[int]]] = {
    Family.KEYPAD: device_ids,
    Family.CIA301: lambda node_id: frozenset(identifiers(node_id) if node_id else ()),
}
"""Under which identifiers it may speak, where others are on the bus as well."""


class Speakers:
    """Who is on the bus besides the tester.

    Args:
        expected: the device as it should be, and whether it is alone.
    """

    __slots__ = ("_exclusive", "_ids", "_neighbours")

    def __init__(self, expected: Expected) -> None:
        self._exclusive = expected.exclusive
        self._neighbours = frozenset[int]()
        self._ids = _IDENTIFIERS[expected.family](expected.node_id)

    def are_device(self, frame: Frame) -> bool:
        """Whether a frame that is none of ours comes from the device."""
        if self._exclusive:
            return frame.can_id not in self._neighbours
        return frame.can_id in self._ids and not frame.extended

    def back_at(self, frames: Sequence[Frame], start: int, stop: int, beat: Frame | None) -> int:
        """The first place, of those from `start` on, whose frame is the device's, or `stop`.

        Args:
            frames: none of those up to `stop` is ours.
            start: from here on.
            stop: up to here.
            beat: a frame that is known to be the device's.
        """
        ids, neighbours, exclusive = self._ids, self._neighbours, self._exclusive
        for place in range(start, stop):
            frame = frames[place]
            if exclusive:
                found = frame.can_id not in neighbours
            else:
                found = frame.can_id in ids and not frame.extended
            if found or frame is beat:
                return place
        return stop

    def give(self, can_id: int) -> None:
        """The device was given one more identifier."""
        self._ids |= {can_id}

    def admit(self, neighbours: frozenset[int]) -> None:
        """The bench puts a station on the bus that sends with these identifiers."""
        self._neighbours |= neighbours
