"""How long a process on this machine was kept from running; a process of its own, which looks on.

    python -m hil_tests.bench.drivers.witness PID...

Whatever comes in is answered by a line: pairs of due and sent in JSON. It ends with its input.

Linux keeps the account: how long each thread was ready to run and had no processor, whether the
process is stopped. What a virtual machine's own host takes from its processors is in no
account that is fine enough; so the witness follows the process to its processor, and where it
comes to late itself for no reason, that may have been late, too. What was sent afterwards may
have been due as much earlier.
"""

from __future__ import annotations

import json
import os
import select
import sys
import time
from collections import deque
from collections.abc import Callable, Sequence
from contextlib import closing, suppress
from pathlib import Path
from typing import Protocol

from hil_tests.clock import MS, US, S

PROC = Path("/proc")

LOOK_NS = 2 * MS
"""How often the account is read; by so much more than it waited is a frame widened at most."""

SELDOM = 20
"""The witness takes one part in so many of a processor: dear looks are rare."""

_LONGEST_NS = 100 * MS
"""Between two looks."""

FULLY = 5
"""Of so many looks one asks for what seldom changes, and costs more."""

ENOUGH_NS = 200 * US
"""Who waited for less was not late: every process waits that long now and then."""

MISSED_NS = 500 * US
"""Who comes to later than that for no reason had no processor: no timer is so late."""

_MEMORY_NS = 250 * MS
"""A process that never sleeps is late by what it waited in this time, not by all it ever did."""

PATIENCE_NS = 1 * S
"""How long a process has to do its work before the bus is judged."""

_PROCESSOR = 36
"""Where in `stat`, behind the name, the processor stands on which a thread ran last."""

_COUNTED_ANEW = 50
"""The threads are counted again after so many looks."""


class Account(Protocol):
    """What is known of a process from outside."""

    def waited(self) -> int:
        """How many ns its threads waited for a processor since the last call, together."""

    def states(self) -> frozenset[str]:
        """What its threads do, in the letters of procfs: R, S, D, T, t and so on."""

    def spent(self) -> tuple[int, int]:
        """How many ns the witness itself ran, and waited for a processor, since the last call."""


def _run_on(cpus: set[int]) -> None:
    os.sched_setaffinity(0, cpus)


class ProcAccount:
    """The account that procfs gives of every thread of some processes (proc(5)).

    Args:
        pids: which.
        proc: where procfs is mounted.
        go_to: makes the witness run on some processors.

    Raises:
        OSError: there is no account of them, or it may not be read.
    """

    def __init__(
        self,
        pids: Sequence[int],
        proc: Path = PROC,
        go_to: Callable[[set[int]], object] = _run_on,
    ) -> None:
        self._go_to = go_to
        self._folders = [proc / str(pid) / "task" for pid in pids]
        self._open: dict[Path, tuple[int, int]] = {}
        """Of each thread: its account and its state, as open files."""
        self._waited: dict[Path, int] = {}
        self._count()
        if not self._open:
            raise OSError(f"the kernel keeps no account of {', '.join(map(str, pids))}")
        self._looks = 0
        self._cpus: set[int] = set()
        self._own = os.open(proc / "self" / "schedstat", os.O_RDONLY)
        self._spent = 0, 0
        self.spent()

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
        """See Account; the witness goes where they ran last."""
        found, cpus = set(), set()
        for _, file in self._open.values():
            with suppress(OSError, IndexError, ValueError):
                # The name of the program stands in brackets, and may hold anything.
                words = os.pread(file, 512, 0).rpartition(b")")[2].split()
                found.add(words[0].decode("ascii"))
                cpus.add(int(words[_PROCESSOR]))
        if cpus and cpus != self._cpus:
            self._cpus = cpus
            with suppress(OSError):  # it may be kept from there
                self._go_to(cpus)
        return frozenset(found)

    def spent(self) -> tuple[int, int]:
        """See Account."""
        before = self._spent
        run, waited = map(int, os.pread(self._own, 64, 0).split()[:2])
        self._spent = run, waited
        return run - before[0], waited - before[1]

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
        os.close(self._own)


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
        self.pause_ns = LOOK_NS
        """How long to wait until the next look."""
        self._looked_at = self._asked_at = clock()
        """The last look, and the last one at everything."""
        self._waits: deque[tuple[int, int]] = deque()
        """When it had waited since it was last asleep, and how long."""
        self._stopped_from: int | None = None
        self._pairs: list[tuple[int, int]] = []
        account.waited()
        account.spent()

    def look(self, *, fully: bool = False) -> bool:
        """Look once.

        Args:
            fully: at everything, whether it is its turn or not.

        Returns:
            Whether everything that was due is done, as far as was looked.
        """
        waited_ns, (run_ns, kept_ns) = self._account.waited(), self._account.spent()
        last, now = self._looked_at, self._clock()
        self._looked_at = now
        self._looks += 1
        if waited_ns:
            self._waits.append((now, waited_ns))
        late_ns = self._lately(now)
        if late_ns > ENOUGH_NS:
            self._pairs.append((last - late_ns, now))
        if now - last - self.pause_ns - run_ns - kept_ns > MISSED_NS:
            self._pairs.append((last, now))
        self.pause_ns = min(max(SELDOM * run_ns, LOOK_NS), _LONGEST_NS)
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
        pairs, self._pairs = self._pairs, []
        return pairs


def look_on(
    witness: Witness, wait: Callable[[int], bytes | None], tell: Callable[[str], object]
) -> None:
    """Look on, and answer the bench, until it hangs up.

    Args:
        witness: looks.
        wait: so many ns; what the bench said: None = nothing, b"" = it has hung up.
        tell: takes a line for the bench: as soon as the process has done what was due.
    """
    asked, left_ns = False, 0
    while (said := wait(witness.pause_ns)) != b"":
        left_ns = (PATIENCE_NS if said else left_ns) - witness.pause_ns
        asked = asked or bool(said)
        done = witness.look(fully=asked)
        if asked and (done or left_ns <= 0):
            tell(json.dumps(witness.take()))
            asked = False


def _next_word(pause_ns: int) -> bytes | None:
    """See `look_on`."""
    readable, _, _ = select.select([0], [], [], pause_ns / S)
    return os.read(0, 64) if readable else None


def _say(line: str) -> None:
    sys.stdout.write(f"{line}\n")
    sys.stdout.flush()


def main(pids: Sequence[str]) -> int:
    """Look on until the input ends; status 1 where there is nothing to look at."""
    try:
        account = ProcAccount([int(pid) for pid in pids])
    except OSError as error:
        sys.stderr.write(f"{error}\n")
        return 1
    with closing(account), suppress(BrokenPipeError):
        witness = Witness(account, time.time_ns)
        _say("ready")
        look_on(witness, _next_word, _say)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
