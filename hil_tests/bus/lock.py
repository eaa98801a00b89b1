"""One run at a time on a CAN channel: an advisory lock that dies with its holder.

Two testers on one bus would judge each other's frames. The lock is `flock` on a small
file in the temporary directory, so a killed run never leaves it behind; the file names
the holder for the message that the second run gets. It works for every interface type.

Groups of udp_multicast that share a UDP port hear each other: there the lock is the port's.
"""

from __future__ import annotations

import fcntl
import os
import re
import tempfile
from pathlib import Path

from hil_tests.bus.multicast import Group
from hil_tests.errors import BusUnavailable

_UNSAFE = re.compile(r"[^A-Za-z0-9_.-]+")
_LONGEST_NAME = 100
_HOLDER = re.compile(r"(?P<pid>[0-9]{1,20})(?: (?P<channel>[A-Za-z0-9_.:\[\]-]{1,100}))?")
_LONGEST_HOLDER = 130
_UNSAFE_CHANNEL = re.compile(r"[^A-Za-z0-9_.:\[\]-]")
_LAST_PORT = 65535


class ChannelLock:
    """Holds the channel, or the UDP port of a multicast group, from construction to `release`.

    Args:
        interface: python-can's name of the interface type, e.g. "socketcan".
        channel: the channel on it, e.g. "can0".
        folder: where lock files live; the temporary directory by default.

    Raises:
        BusUnavailable: another run holds the channel, or the file cannot be made.
    """

    def __init__(self, interface: str, channel: str, folder: Path | None = None) -> None:
        name = _UNSAFE.sub("_", f"{interface}-{_wire(interface, channel)}")[:_LONGEST_NAME]
        self.path = (folder or Path(tempfile.gettempdir())) / f"nodeproof-{name}.lock"
        self._file = _open(self.path)
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            holder = _holder(self._file)
            self.release()
            taken = f"channel {channel!r} ({interface}) is in use by another run, {holder}; "
            remedy = f"wait for it to end, or end it (lock file {self.path})"
            raise BusUnavailable(taken + _way_out(interface, channel) + remedy) from None
        os.ftruncate(self._file, 0)
        os.pwrite(self._file, f"{os.getpid()} {_shown(channel)}\n".encode(), 0)

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


def _wire(interface: str, channel: str) -> str:
    """What of a channel no two runs may share."""
    if interface == "udp_multicast":
        return f"port-{Group.of(channel).port}"
    return channel


def _shown(channel: str) -> str:
    """A channel as it may stand in a lock file."""
    return _UNSAFE_CHANNEL.sub("_", channel)[:_LONGEST_NAME]


def _way_out(interface: str, channel: str) -> str:
    """What else can be done where the other run need not be on the same channel."""
    if interface != "udp_multicast":
        return ""
    group = Group.of(channel)
    other = group.at(group.port + 1 if group.port < _LAST_PORT else group.port - 1)
    return (
        f"groups on one UDP port ({group.port}) hear each other, so give this run a port of its "
        f"own, e.g. --can-iface {other}; or "
    )


def _holder(file: int) -> str:
    text = os.pread(file, _LONGEST_HOLDER, 0).decode("ascii", "replace").strip()
    found = _HOLDER.fullmatch(text)
    if found is None:
        return "pid unknown"
    where = f" on {found['channel']}" if found["channel"] else ""
    return f"pid {found['pid']}{where}"
