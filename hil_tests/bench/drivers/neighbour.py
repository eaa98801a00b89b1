"""A simulated device on this machine: how long its process was kept from running.

Few simulators vouch for their host, as our hosted model does (`health` of the control protocol).
Where the process runs here, the kernel does: see `witness`. That time is the host's, never the
device's.
"""

from __future__ import annotations

import json
import os
import select
import socket
import struct
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import suppress
from ipaddress import IPv6Address, ip_address
from pathlib import Path

from hil_tests.bench.drivers.witness import PROC
from hil_tests.clock import S, show_span
from hil_tests.errors import ControlError

READY_S = 60
"""How long the witness may take to start: Python is slow in an emulated machine."""

EXACT_TIME = "NODEPROOF_EXACT_TIME"
"""Set in a machine whose clock counts its own instructions (`nodeproof vcan`): no host makes it
late, and there a look takes as long as a test."""

_ANSWER_NS = 5 * S
_CHUNK = 65_536


class _Asking:
    """A question to the witness; it answers when the process has done what was due.

    Args:
        witness: its process.
        of: whose witness it is, for people.
    """

    def __init__(self, witness: subprocess.Popen[bytes], of: str) -> None:
        assert witness.stdin is not None
        assert witness.stdout is not None
        self._ask, self._told = witness.stdin, witness.stdout
        self._of = of
        self._said = bytearray()
        self.descriptors = (self._told.fileno(),)
        self.wake_at = 0

    def start(self, now: int) -> None:
        """Ask."""
        self.wake_at = now + _ANSWER_NS
        with suppress(BrokenPipeError):  # it has ended, as its output says
            os.write(self._ask.fileno(), b"?")

    def poll(self, now: int) -> bool:
        """Whether the answer is there.

        Raises:
            ControlError: it will not come.
        """
        while select.select(self.descriptors, [], [], 0)[0]:
            part = os.read(self._told.fileno(), _CHUNK)
            self._said += part
            if part.endswith(b"\n"):
                return True
            if not part:
                raise self._lost("has ended")
        if now >= self.wake_at:
            raise self._lost(f"has not answered for {show_span(_ANSWER_NS)}")
        return False

    def _lost(self, why: str) -> ControlError:
        return ControlError(
            f"the witness of {self._of}, the simulated device, {why}; start the run again, or let "
            "the control server tell its lateness itself (`health`, docs/control-protocol.md)"
        )

    def result(self) -> Sequence[tuple[int, int]]:
        """Pairs (due, sent)."""
        return [(due, sent) for due, sent in json.loads(self._said)]


class NeighbourHealth:
    """See HealthDriver.

    Args:
        pids: the processes of the device, on this machine.

    Raises:
        OSError: there is no account of them, or it may not be read.
    """

    def __init__(self, pids: Sequence[int]) -> None:
        processes = ", ".join(map(str, pids))
        self._of = f"process {processes} of this computer"
        self.about = f"seen by a witness of {self._of}"
        command = [sys.executable, "-m", "hil_tests.bench.drivers.witness", *map(str, pids)]
        pipe = subprocess.PIPE
        # Its input is its leash: it never outlives us, however we end.
        self._witness = subprocess.Popen(
            command, stdin=pipe, stdout=pipe, stderr=subprocess.DEVNULL, bufsize=0
        )
        assert self._witness.stdout is not None
        ready, _, _ = select.select([self._witness.stdout], [], [], READY_S)
        if not ready or not self._witness.stdout.readline():
            self.close()
            raise OSError(f"the kernel keeps no account of {processes}")

    def late(self) -> _Asking:
        """Pairs (due, sent) in ns since the last call."""
        return _Asking(self._witness, self._of)

    def close(self) -> None:
        """Look no more."""
        with self._witness:
            self._witness.kill()


# Who is at the other end?


def processes_behind(connection: socket.socket, proc: Path = PROC) -> list[int]:
    """The processes at the other end of a connection, where that is on this machine.

    Args:
        connection: a stream, connected.
        proc: where procfs is mounted; without one nobody is known.
    """
    if not proc.is_dir():
        return []
    if connection.family == socket.AF_UNIX:
        answer = connection.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, 12)
        return [pid for pid in struct.unpack("=3i", answer)[:1] if pid > 0]
    ends = tuple(map(_end, (connection.getpeername(), connection.getsockname())))
    with suppress(OSError):
        for inode in _inodes(ends, proc):
            return sorted(_owners(f"socket:[{inode}]", proc))
    return []


_End = tuple[str, int]


def _end(name: tuple[object, ...]) -> _End:
    return _plain(ip_address(str(name[0]))), int(str(name[1]))


def _plain(address: object) -> str:
    """An IPv4 address that is written as one of IPv6 is the same address."""
    mapped = address.ipv4_mapped if isinstance(address, IPv6Address) else None
    return str(mapped or address)


def _inodes(ends: tuple[_End, ...], proc: Path) -> Iterator[str]:
    """The socket with these two ends, its own first."""
    for table in ("tcp", "tcp6"):
        for row in (proc / "net" / table).read_text().splitlines()[1:]:
            words = row.split()
            if tuple(map(_written, words[1:3])) == ends:
                yield words[9]


def _written(text: str) -> _End:
    """An end as procfs writes it: words of the machine, in hex."""
    host, _, port = text.partition(":")
    words = [int(host[at : at + 8], 16) for at in range(0, len(host), 8)]
    return _plain(ip_address(struct.pack(f"={len(words)}I", *words))), int(port, 16)


def _owners(link: str, proc: Path) -> Iterator[int]:
    """The processes that have this file open, of those that we may look at."""
    for process in proc.iterdir():
        if process.name.isdigit():
            with suppress(OSError):
                if any(str(file.readlink()) == link for file in (process / "fd").iterdir()):
                    yield int(process.name)
