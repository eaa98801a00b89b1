"""A scenario of keys and NMT commands: timed steps as plain data, the same in every run."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

Step = tuple[int, int | str]
"""Milliseconds after the step before, and what is done: the mask of the keys that are held
from now on (bits 0 and 1: the first two keys of the profile, further bits: keys counted
from its end); or a word of `COMMANDS`."""

COMMANDS = ("start", "stop", "pre-operational", "reset")


@dataclass(frozen=True, slots=True)
class Scenario:
    """What is done to a node that has just become operational, no key held.

    Args:
        debounce: byte 5 of the commissioning frame, x 100 ms.
        steps: in order.
    """

    debounce: int
    steps: tuple[Step, ...]

    def pulses(self) -> Iterator[int]:
        """How long each key stayed pressed or released between two edges, in ms."""
        began: dict[int, int] = {}
        now = held = 0
        for span, what in self.steps:
            now += span
            if isinstance(what, str):
                continue
            moved, held = what ^ held, what
            for bit in range(moved.bit_length()):
                if moved >> bit & 1:
                    if bit in began:
                        yield now - began[bit]
                    began[bit] = now
