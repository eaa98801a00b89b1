"""Values that the seed of the run draws: no single value is safe for ever."""

from __future__ import annotations

from random import Random

BORDERS = (0x00, 0x01, 0x7F, 0x80, 0x81, 0xFE, 0xFF)
"""Bytes at which a sign, a carry or a blank memory shows."""


Row = Random
"""A row of choices, for annotations."""


class Chance:
    """Rows of choices, each by its name: the same seed draws the same row.

    Args:
        seed: of the run.
    """

    def __init__(self, seed: int) -> None:
        self.seed = seed

    def row(self, name: str) -> Row:
        """The beginning of a row; what other rows drew before does not matter."""
        return Random(f"{self.seed} {name}")

    @staticmethod
    def byte(row: Row) -> int:
        """A byte, every other time one at a border."""
        return row.choice(BORDERS) if row.random() < 1 / 2 else row.randrange(256)
