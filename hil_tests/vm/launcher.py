"""Runs a machine: passes its output on as it comes, stops it in time, and says how it ended.

The outputs are files that QEMU appends to and this side follows: what the guest printed stays
when the guest, QEMU or the launcher dies. A stop is asked for first (the command gets the signal
and may finish its reports), then enforced.
"""

from __future__ import annotations

import shutil
import signal
import subprocess
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from types import FrameType
from typing import IO, Protocol

from hil_tests.vm.errors import Unavailable
from hil_tests.vm.guest import COPY, PART
from hil_tests.vm.machine import Machine
from hil_tests.vm.tail import Tail

# As timeout(1) has it, and as shells report a signal.
TIMED_OUT = 124
_SIGNALLED = 128

_POLL_S = 0.05
# How long a guest that was asked to stop may take to finish its reports and write them out.
_GRACE_S = 30.0
_KILL_AFTER_S = 5.0
_COPY_EVERY_S = 5.0
_CONSOLE_LINES = 12
# What the kernel and QEMU call their troubles.
_TROUBLE = ("Kernel panic", "BUG:", "Out of memory", "qemu-system", "could not be")


class Process(Protocol):
    """What is used of `subprocess.Popen`."""

    @property
    def stdin(self) -> IO[bytes] | None:
        """Leads to the guest's control port."""
        ...

    def wait(self, timeout: float | None = None) -> int:
        """Waits for the end; raises `subprocess.TimeoutExpired`."""
        ...

    def terminate(self) -> None:
        """Asks QEMU to end."""
        ...

    def kill(self) -> None:
        """Ends QEMU."""
        ...


@dataclass(slots=True)
class Signals:
    """The stop signals that have come."""

    seen: list[signal.Signals] = field(default_factory=list)

    def note(self, number: int, _frame: FrameType | None) -> None:
        """Remembers one; the loop acts on it."""
        self.seen.append(signal.Signals(number))

    @contextmanager
    def caught(self) -> Iterator[None]:
        """Catches Ctrl-C and SIGTERM while inside."""
        caught = (signal.SIGINT, signal.SIGTERM)
        before = {number: signal.signal(number, self.note) for number in caught}
        try:
            yield
        finally:
            for number, handler in before.items():
                signal.signal(number, handler)


@dataclass(slots=True)
class Launcher:
    """Runs one machine once.

    Attributes:
        machine: What to run; its folder exists and holds the initial files.
        tails: The outputs to pass on.
        say: Tells the user how things go, a line at a time.
        timeout_s: How long the machine may run on the wall clock, None for ever.
        clock: Monotonic seconds; a test puts its own here.
        signals: The stop signals caught so far.
    """

    machine: Machine
    tails: tuple[Tail, ...]
    say: Callable[[str], None]
    timeout_s: float | None = None
    clock: Callable[[], float] = time.monotonic
    signals: Signals = field(default_factory=Signals)
    _ready: bool = False
    _timed_out: bool = False
    _asked_at: float | None = None
    _copied_at: float = 0.0

    def run(self) -> int:
        """Runs the machine to its end and returns the exit status for the user.

        Raises:
            Unavailable: The machine could not be started, or ended without saying how the command
            did.
        """
        with self.signals.caught(), self.machine.port("qemu").open("wb") as complaints:
            # A session of its own: Ctrl-C in the terminal reaches the launcher alone, which then
            # asks the guest. No buffer: a word that came too late must not wait for the close.
            process = subprocess.Popen(
                self.machine.command_line(), stdin=subprocess.PIPE, stdout=subprocess.DEVNULL,
                stderr=complaints, start_new_session=True, bufsize=0,
            )  # fmt: skip
            try:
                self.follow(process)
            finally:
                _end(process)
                self._tidy()
        return self.exit_status()

    def _tidy(self) -> None:
        """Removes what was not brought out as a whole."""
        for folder in self.machine.results:
            for part in folder.glob(f"{PART}*"):
                shutil.rmtree(part, ignore_errors=True)

    def follow(self, process: Process) -> None:
        """Passes the output on until the process ends or has to be stopped for good."""
        began_at = self.clock()
        running = True
        while running and not self._must_end():
            running = not _ended(process)
            for tail in self.tails:
                tail.copy()
            self._greet(self.clock() - began_at)
            self._stop(process, self.clock() - began_at)
            self._copy(process)

    def _greet(self, elapsed_s: float) -> None:
        if not self._ready and self._status("ready") is not None:
            self._ready = True
            self.say(f"the guest is ready after {elapsed_s:.1f} s")

    def _stop(self, process: Process, elapsed_s: float) -> None:
        """Asks the guest once to stop, for a signal or because its time is over."""
        if self._asked_at is not None:
            return
        if self.signals.seen:
            self._asked_at = self.clock()
            self._ask_for_results(process)
            self._tell(process, self.signals.seen[0].name.removeprefix("SIG"))
            self.say(f"stopping the guest, within {_GRACE_S:.0f} s (Ctrl-C again: at once)")
        elif self.timeout_s is not None and elapsed_s > self.timeout_s:
            self._timed_out = True
            self._asked_at = self.clock()
            self.say(f"time is over after {self.timeout_s:g} s; stopping the guest")
            self._ask_for_results(process)
            self._tell(process, "TERM")

    def _copy(self, process: Process) -> None:
        """Has the results brought out now and then, so that not much is lost when it dies."""
        if self.clock() - self._copied_at > _COPY_EVERY_S:
            self._ask_for_results(process)

    def _ask_for_results(self, process: Process) -> None:
        if self._ready and self.machine.results:
            self._copied_at = self.clock()
            self._tell(process, COPY)

    def _tell(self, process: Process, word: str) -> None:
        if process.stdin is not None:
            try:
                process.stdin.write(f"{word}\n".encode())
            except BrokenPipeError:
                # It ended by itself in this very moment.
                return

    def _must_end(self) -> bool:
        """Whether patience is over: nobody to ask yet, asked twice, or no answer in time."""
        if self._asked_at is None:
            return False
        impatient = len(self.signals.seen) > 1
        return not self._ready or impatient or self.clock() - self._asked_at > _GRACE_S

    def _status(self, word: str) -> str | None:
        """Returns what follows a word on the status port, None where the guest has not said it."""
        path = self.machine.port("status")
        lines = path.read_text(errors="replace").splitlines() if path.exists() else []
        said = (line.partition(" ") for line in lines)
        return next((rest for first, _, rest in said if first == word), None)

    def exit_status(self) -> int:
        """Returns the command's exit status, or what stands for it where it was stopped.

        Raises:
            Unavailable: The guest gave none.
        """
        said = self._status("exit")
        if self._timed_out:
            if said is None:
                self.say("the guest did not answer; results of its last seconds may be missing")
            return TIMED_OUT
        if said is not None:
            return int(said)
        if self.signals.seen:
            return _SIGNALLED + self.signals.seen[0]
        raise Unavailable(self._failure())

    def _failure(self) -> str:
        why = self._status("failed")
        console = _last_lines(self.machine.console()) + _last_lines(self.machine.port("qemu"))
        said = "\n".join(f"    {line}" for line in console) or "    (nothing)"
        if why is not None:
            return f"The guest could not be set up: {why}. Its last messages:\n{said}"
        when = "while the command ran" if self._ready else "before the command could start"
        return (
            f"The virtual machine ended {when}; what it printed until then is above. Its last"
            f" messages:\n{said}\nIf memory ran out, try --memory 2G; if the kernel did not start,"
            " try another with --kernel PATH."
        )


def _ended(process: Process) -> bool:
    try:
        process.wait(timeout=_POLL_S)
    except subprocess.TimeoutExpired:
        return False
    return True


def _end(process: Process) -> None:
    """Ends a machine that still runs; returns when it is gone."""
    process.terminate()
    try:
        process.wait(timeout=_KILL_AFTER_S)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()
    if process.stdin is not None:
        process.stdin.close()


def _last_lines(path: Path) -> list[str]:
    """Returns the lines that name the trouble, else simply the last ones."""
    lines = path.read_text(errors="replace").splitlines() if path.exists() else []
    telling = [line for line in lines if any(word in line for word in _TROUBLE)]
    return (telling or lines)[-_CONSOLE_LINES:]
