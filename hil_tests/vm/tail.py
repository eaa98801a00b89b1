"""Follows a file that another process appends to."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO


@dataclass(slots=True)
class Tail:
    """Follows a file that grows, and copies what is new.

    Attributes:
        source: The file; it may not exist yet.
        sink: Where its contents go.
        position: How much of it has been copied, in bytes.
    """

    source: Path
    sink: BinaryIO
    position: int = 0

    def copy(self) -> None:
        """Copies what has come since the last time."""
        if not self.source.exists():
            return
        with self.source.open("rb") as file:
            file.seek(self.position)
            fresh = file.read()
        if fresh:
            self.position += len(fresh)
            self.sink.write(fresh)
            self.sink.flush()
