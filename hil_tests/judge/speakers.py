"""Whose frame is it? The device's, as far as its identifier tells."""

from __future__ import annotations

from collections.abc import Callable, Mapping

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

    def give(self, can_id: int) -> None:
        """The device was given one more identifier."""
        self._ids |= {can_id}

    def admit(self, neighbours: frozenset[int]) -> None:
        """The bench puts a station on the bus that sends with these identifiers."""
        self._neighbours |= neighbours
