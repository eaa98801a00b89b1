"""Writes an initial RAM file system: the first files that a Linux kernel sees.

The format is the "newc" cpio archive, as described in the kernel's
Documentation/driver-api/early-userspace/buffer-format.rst: a header of ASCII hexadecimal numbers,
the name, the data, each padded to four bytes. Writing it here spares the host the `cpio` program,
and lets an archive hold device nodes although no root made them.
"""

from __future__ import annotations

import stat
from collections.abc import Iterable
from dataclasses import dataclass

_MAGIC = b"070701"
_TRAILER = "TRAILER!!!"


@dataclass(frozen=True, slots=True)
class Entry:
    """One file of the archive.

    Attributes:
        name: Path from the root, without a leading slash.
        mode: File type and permissions, as in `os.stat`.
        data: Contents of a regular file.
        device: Major and minor number of a device node.
    """

    name: str
    mode: int
    data: bytes = b""
    device: tuple[int, int] = (0, 0)


def directory(name: str) -> Entry:
    """Returns a directory that everybody may read."""
    return Entry(name, stat.S_IFDIR | 0o755)


def regular(name: str, data: bytes, *, executable: bool = False) -> Entry:
    """Returns a file with contents."""
    return Entry(name, stat.S_IFREG | (0o755 if executable else 0o644), data)


def character_device(name: str, major: int, minor: int) -> Entry:
    """Returns a character device node; /dev/console is opened before anything is mounted."""
    return Entry(name, stat.S_IFCHR | 0o600, device=(major, minor))


def archive(entries: Iterable[Entry]) -> bytes:
    """Returns the entries as one uncompressed cpio archive (to unpack costs the guest more)."""
    written = bytearray()
    for inode, entry in enumerate((*entries, Entry(_TRAILER, 0)), start=1):
        written += _packed(entry, inode)
    return bytes(written)


def _packed(entry: Entry, inode: int) -> bytes:
    name = entry.name.encode() + b"\0"
    fields = (inode, entry.mode, 0, 0, 1, 0, len(entry.data), 0, 0, *entry.device, len(name), 0)
    header = _MAGIC + b"".join(b"%08X" % field for field in fields)
    return _padded(header + name) + _padded(entry.data)


def _padded(data: bytes) -> bytes:
    return data + bytes(-len(data) % 4)
