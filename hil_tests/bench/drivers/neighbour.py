"""A simulated device on this machine: how long its process was kept from running.

Few simulators vouch for their host, as our hosted model does (`health` of the control protocol).
Where the process runs here, Linux keeps the account: how long each thread was ready to run and
had no processor, whether the process is stopped, and how much of a virtual machine's time its
own host took. What was sent afterwards may have been due as much earlier; that time is the
host's, never the device's.
"""

from __future__ import annotations

import os
import socket
import struct
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from ipaddress import IPv6Address, ip_address
from pathlib import Path
from threading import Event, Lock, Thread
from typing import Protocol

from hil_tests.clock import MS, US, S

PROC = Path("/proc")

LOOK_NS = 2 * MS
"""How often the account is read; by so much more than it waited is a frame widened at most."""

FULLY = 5
"""Of so many looks one asks for what seldom changes, and costs more."""

ENOUGH_NS = 200 * US
"""Who waited for less was not late: every process waits that long now and then."""

_MEMORY_NS = 250 * MS
"""A process that never sleeps is late by what it waited in this time, not by all it ever did."""

_PATIENCE_NS = 1 * S
"""How long to wait for a process to get its processor before the bus is judged."""

_COUNTED_ANEW = 50
"""The threads are counted again after so many looks."""


class Account(Protocol):
    """What is known of a process from outside."""

    def waited(self) -> int:
        """How many ns its threads waited for a processor since the last call, together."""

    def states(self) -> frozenset[str]:
        """What its threads do, in the letters of procfs: R, S, D, T, t and so on."""

    def stolen(self) -> int:
        """How many ns this machine's own host took from it since the last call."""


class ProcAccount:
    """The account that procfs gives of every thread of some processes (proc(5)).

    Args:
        pids: which.
        proc: where procfs is mounted.

    Raises:
        OSError: there is no account of them, or it may not be read.
    """

    def __init__(self, pids: Sequence[int], proc: Path = PROC) -> None:
        self._folders = [proc / str(pid) / "task" for pid in pids]
        self._open: dict[Path, tuple[int, int]] = {}
        """Of each thread: its account and its state, as open files."""
        self._waited: dict[Path, int] = {}
        self._count()
        if not self._open:
            raise OSError(f"the kernel keeps no account of {', '.join(map(str, pids))}")
        self._looks = 0
        self._machine = os.open(proc / "stat", os.O_RDONLY)
        self._tick_ns = S // os.sysconf("SC_CLK_TCK")
        self._stolen = self._ticks_stolen()

    def waited(self) -> int:
        """See Account."""
        self._looks += 1
        if self._looks % _COUNTED_ANEW == 0:
            self._count()
        waited_ns = 0
        for thread, (account, _) in list(self._open.items()):
            try:
                total = int(os.pread(account, 64, 0).split()[1])
            except (OSError, IndexError, ValueError):
                self._forget(thread)  # it has ended
                continue
            waited_ns += total - self._waited.get(thread, total)
            self._waited[thread] = total
        return waited_ns

    def states(self) -> frozenset[str]:
        """See Account."""
        found = set()
        for _, file in self._open.values():
            with suppress(OSError, IndexError):
                # The name of the program stands in brackets, and may hold anything.
                found.add(os.pread(file, 512, 0).rpartition(b")")[2].split()[0].decode("ascii"))
        return frozenset(found)

    def stolen(self) -> int:
        """See Account; in whole ticks."""
        before, self._stolen = self._stolen, self._ticks_stolen()
        return (self._stolen - before) * self._tick_ns

    def _ticks_stolen(self) -> int:
        words = os.pread(self._machine, 256, 0).split()
        return int(words[8]) if len(words) > 8 and words[8].isdigit() else 0

    def _count(self) -> None:
        for folder in self._folders:
            with suppress(OSError):
                for thread in folder.iterdir():
                    if thread not in self._open:
                        self._watch(thread)

    def _watch(self, thread: Path) -> None:
        with suppress(OSError):
            account = os.open(thread / "schedstat", os.O_RDONLY)
            try:
                self._open[thread] = account, os.open(thread / "stat", os.O_RDONLY)
            except OSError:
                os.close(account)

    def _forget(self, thread: Path) -> None:
        for file in self._open.pop(thread):
            os.close(file)
        self._waited.pop(thread, None)

    def __len__(self) -> int:
        return len(self._open)

    def close(self) -> None:
        """Close every file."""
        for thread in list(self._open):
            self._forget(thread)
        os.close(self._machine)


class Witness:
    """Turns looks at an account into pairs: what was sent by then can have been due since when.

    Args:
        account: of the device's process.
        clock: the bench's, in ns.
    """

    def __init__(self, account: Account, clock: Callable[[], int]) -> None:
        self._account = account
        self._clock = clock
        self._looks = 0
        self._looked_at = self._asked_at = clock()
        """The last look, and the last one at everything."""
        self._waits: deque[tuple[int, int]] = deque()
        """When it had waited since it was last asleep, and how long."""
        self._stopped_from: int | None = None
        self._pairs: list[tuple[int, int]] = []
        self._lock = Lock()
        account.waited()

    def look(self, *, fully: bool = False) -> bool:
        """Look once.

        Args:
            fully: at everything, whether it is its turn or not.

        Returns:
            Whether everything that was due is done, as far as was looked.
        """
        with self._lock:
            waited_ns = self._account.waited()
            last, now = self._looked_at, self._clock()
            self._looked_at = now
            self._looks += 1
            if waited_ns:
                self._waits.append((now, waited_ns))
            late_ns = self._lately(now)
            if late_ns > ENOUGH_NS:
                self._pairs.append((last - late_ns, now))
            if not fully and not self._waits and self._looks % FULLY:
                return self._stopped_from is None
            return self._ask(now)

    def _ask(self, now: int) -> bool:
        """What seldom changes."""
        last, self._asked_at = self._asked_at, now
        states = self._account.states()
        stopped = not states.isdisjoint("Tt")
        if stopped and self._stopped_from is None:
            self._stopped_from = last
        if self._stopped_from is not None:
            self._pairs.append((self._stopped_from, now))
        if stolen_ns := self._account.stolen():
            self._pairs.append((last - stolen_ns, now))
        done = not stopped and "R" not in states
        if done:
            self._stopped_from = None
            self._waits.clear()
        return done

    def _lately(self, now: int) -> int:
        """For how long it has waited in all since it was last asleep."""
        waits = self._waits
        while waits and waits[0][0] < now - _MEMORY_NS:
            waits.popleft()
        return sum(each for _, each in waits)

    def take(self) -> list[tuple[int, int]]:
        """The pairs since the last call."""
        with self._lock:
            pairs, self._pairs = self._pairs, []
        return pairs


class _Asking:
    """Waits until the process has done what was due, and tells how late it was."""

    descriptors: Sequence[int] = ()

    def __init__(self, witness: Witness) -> None:
        self._witness = witness
        self._until = 0
        self.wake_at = 0

    def start(self, now: int) -> None:
        """From now on."""
        self._until = now + _PATIENCE_NS

    def poll(self, now: int) -> bool:
        """Look; a process that never rests (or is stopped) is not waited for for ever."""
        self.wake_at = now + LOOK_NS
        return self._witness.look(fully=True) or now >= self._until

    def result(self) -> Sequence[tuple[int, int]]:
        """Pairs (due, sent)."""
        return self._witness.take()


class NeighbourHealth:
    """See HealthDriver.

    Args:
        account: of the device's process.
        clock: the bench's, in ns.
    """

    def __init__(self, account: Account, clock: Callable[[], int]) -> None:
        self._witness = Witness(account, clock)
        self._end = Event()
        self._looker = Thread(target=self._look_on, name="looks at the device", daemon=True)

    def look_on(self) -> None:
        """Look again and again, in a thread of its own, until it is closed."""
        self._looker.start()

    def _look_on(self) -> None:
        while not self._end.wait(LOOK_NS / S):
            self._witness.look()

    def late(self) -> _Asking:
        """Pairs (due, sent) in ns since the last call."""
        return _Asking(self._witness)

    def close(self) -> None:
        """Look no more."""
        self._end.set()
        self._looker.join()


# Who is at the other end?


def processes_behind(connection: socket.socket, proc: Path = PROC) -> list[int]:
    """The processes at the other end of a connection, where that is on this machine.

    Args:
        connection: a stream, connected.
        proc: where procfs is mounted.
    """
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
