"""One run at a time on a CAN channel: an advisory lock that dies with its holder.

Two testers on one bus would judge each other's frames. The lock is `flock` on a small
file in the temporary directory, so a killed run never leaves it behind; the file names
the holder for the message that the second run gets. It works for every interface type.
"""

from __future__ import annotations

import fcntl
import os
import re
import tempfile
from pathlib import Path

from hil_tests.errors import BusUnavailable

_UNSAFE = re.compile(r"[^A-Za-z0-9_.-]+")
_LONGEST_NAME = 100
_LONGEST_PID = 20


class ChannelLock:
    """Holds the channel from construction to `release`.

    Args:
        interface: python-can's name of the interface type, e.g. "socketcan".
        channel: the channel on it, e.g. "can0".
        folder: where lock files live; the temporary directory by default.

    Raises:
        BusUnavailable: another run holds the channel, or the file cannot be made.
    """

    def __init__(self, interface: str, channel: str, folder: Path | None = None) -> None:
        name = _UNSAFE.sub("_", f"{interface}-{channel}")[:_LONGEST_NAME]
        self.path = (folder or Path(tempfile.gettempdir())) / f"nodeproof-{name}.lock"
        self._file = _open(self.path)
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            holder = _holder(self._file)
            self.release()
            raise BusUnavailable(
                f"channel {channel!r} ({interface}) is in use by another run, {holder}; "
                f"wait for it to end, or end it (lock file {self.path})"
            ) from None
        os.ftruncate(self._file, 0)
        os.pwrite(self._file, f"{os.getpid()}\n".encode(), 0)

    def release(self) -> None:
        """Give the channel back; calling it twice is allowed."""
        if self._file >= 0:
            os.close(self._file)
            self._file = -1


def _open(path: Path) -> int:
    """The lock file; made if need be.

    In a sticky directory Linux refuses O_CREAT on a file that another user owns
    (fs.protected_regular), so an existing file is opened without it.
    """
    flags = os.O_RDWR | os.O_NOFOLLOW | os.O_CLOEXEC
    try:
        try:
            return os.open(path, flags)
        except FileNotFoundError:
            file = os.open(path, flags | os.O_CREAT, 0o666)
            # Other users of the bench must be able to lock it too, whatever our umask.
            os.fchmod(file, 0o666)
            return file
    except OSError as error:
        raise BusUnavailable(
            f"lock file {path} cannot be opened ({error.strerror}); remove it or set TMPDIR"
        ) from None


def _holder(file: int) -> str:
    text = os.pread(file, _LONGEST_PID, 0).decode("ascii", "replace").strip()
    return f"pid {text}" if text.isdecimal() else "pid unknown"
