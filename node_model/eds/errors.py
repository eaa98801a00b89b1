"""What is said about a file: errors that refuse it, remarks that do not."""

from __future__ import annotations

from dataclasses import dataclass


class EdsError(ValueError):
    """A file that no device can be made of.

    Args:
        file: its path.
        line: 1 for the first; 0 = the file as a whole.
        what: what is there, with its value.
        remedy: what to do about it.
    """

    def __init__(self, file: str, line: int, what: str, remedy: str) -> None:
        super().__init__(f"{file}:{line}: {what}; {remedy}")
        self.file = file
        self.line = line


@dataclass(frozen=True, slots=True)
class Remark:
    """Something that was read although it is not as it should be."""

    line: int
    text: str


def excerpt(text: str) -> str:
    """A value for a message: quoted, and not too long."""
    return repr(text if len(text) <= 40 else text[:37] + "...")
