"""A file that grows and is whole at every instant, even if its writer is killed in mid-write.

Two copies lie behind it under hidden names. What is new goes into the copy that nobody sees;
then the file's name is pointed at that copy, in one step of the file system, and the copies
change places. So an addition costs the same for the first item and the ten-thousandth, and
whoever opens the file finds a whole one. (One write is not enough: a kill can end it at any
page of memory.) Where a file cannot have two names, a whole copy takes its place each time.
"""

from __future__ import annotations

import os
import shutil
from dataclasses import dataclass
from pathlib import Path


@dataclass(slots=True)
class _Copy:
    """One of the two.

    Args:
        path: its hidden name.
        descriptor: open for writing.
        behind: what the file has and this copy not yet.
        end: where the next item begins; the tail stands behind it.
    """

    path: Path
    descriptor: int
    behind: bytes
    end: int = 0

    def lay(self, tail: bytes) -> None:
        """Write what it lacks, and the new tail, over the old tail."""
        content, place = self.behind + tail, self.end
        while content:
            written = os.pwrite(self.descriptor, content, place)
            content, place = content[written:], place + written
        os.ftruncate(self.descriptor, place)

    def show_as(self, path: Path) -> None:
        """Let the name of the file stand for this copy."""
        draft = path.with_name(f".{path.name}.new")
        draft.unlink(missing_ok=True)
        try:
            draft.hardlink_to(self.path)
        except (OSError, NotImplementedError):
            shutil.copyfile(self.path, draft)
        draft.replace(path)


class GrowingFile:
    """A head, items one after the other, and a tail that is written anew each time.

    Args:
        path: the file; it must not exist yet.
        head: what it begins with.
        tail: what it ends with at first.

    Raises:
        OSError: it exists, or cannot be written.
    """

    def __init__(self, path: Path, head: bytes, tail: bytes) -> None:
        if path.exists():
            raise FileExistsError(17, "File exists")
        self._path = path
        self._copies = [_copy(path, 1, head)]
        """The hidden one first."""
        try:
            self._copies.insert(0, _copy(path, 2, head))
            self.append(b"", tail)
        except BaseException:
            self.close()
            raise

    def append(self, item: bytes, tail: bytes) -> None:
        """Add an item (b"" = none), and lay a new tail behind it.

        Raises:
            OSError: the disk is full, or gone; the file is as it was, and the item comes with
                the next one that can be written.
        """
        for copy in self._copies:
            copy.behind += item
        hidden = self._copies[0]
        hidden.lay(tail)
        hidden.show_as(self._path)
        hidden.end += len(hidden.behind)
        hidden.behind = b""
        self._copies.reverse()

    def close(self) -> None:
        """Let go of the file, which stays as it is; a second call does nothing."""
        while self._copies:
            copy = self._copies.pop()
            os.close(copy.descriptor)
            copy.path.unlink(missing_ok=True)


def _copy(path: Path, number: int, head: bytes) -> _Copy:
    hidden = path.with_name(f".{path.name}.{number}")
    return _Copy(hidden, os.open(hidden, os.O_RDWR | os.O_CREAT | os.O_TRUNC, 0o666), head)
