"""A file that is written as memory: quick, and whole even if the process is killed.

What stands in a shared mapping belongs to the operating system, which writes it out whether
the process lives or not. Until `close` the file is longer than what was written; the rest is
zeros. Room is taken before it is used, so that a full disk is an error and no signal.
"""

from __future__ import annotations

import mmap
import os
from pathlib import Path

_FIRST_BYTES = 1 << 16
_MOST_BYTES = 1 << 22
"""The file grows by its own length, by at most that much at a time."""


class MappedFile:
    """A new file; an old one of that name is overwritten.

    Raises:
        OSError: it cannot be made, or the disk is full.
    """

    def __init__(self, path: Path) -> None:
        self._descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_TRUNC, 0o666)
        self._size = 0
        self._end = 0
        self._map: mmap.mmap | None = None
        try:
            self._grow(_FIRST_BYTES)
        except BaseException:
            os.close(self._descriptor)
            raise

    def write(self, content: bytes) -> int:
        """Append; after this call the content survives the process.

        Returns:
            How many bytes: all.

        Raises:
            OSError: the disk is full.
            ValueError: the file is closed.
        """
        if self._map is None:
            raise ValueError(f"write to a closed file: {len(content)} bytes")
        end = self._end + len(content)
        if end > self._size:
            self._grow(max(end - self._size, min(self._size, _MOST_BYTES)))
        self._map[self._end : end] = content
        self._end = end
        return len(content)

    def rewind(self) -> None:
        """Begin again at the start; what was written is gone."""
        if self._map is not None:
            self._map[: self._end] = bytes(self._end)
        self._end = 0

    def close(self) -> None:
        """Cut the file to what was written; a second call does nothing."""
        if self._map is None:
            return
        self._map.close()
        self._map = None
        try:
            os.ftruncate(self._descriptor, self._end)
        finally:
            os.close(self._descriptor)

    def _grow(self, more: int) -> None:
        os.posix_fallocate(self._descriptor, self._size, more)
        self._size += more
        if self._map is not None:
            self._map.close()
        self._map = mmap.mmap(self._descriptor, self._size)
