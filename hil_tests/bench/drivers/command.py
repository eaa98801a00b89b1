"""Power by commands of the user's: one to switch on, one to switch off.

The commands are argument lists, run without a shell; success is exit status 0. Supply
changed somewhere between start and end of the command.
"""

from __future__ import annotations

import contextlib
import os
import subprocess
import tempfile
from collections.abc import Callable, Sequence

from hil_tests.bench.action import Action
from hil_tests.clock import MS, Interval, S, show_span
from hil_tests.errors import BenchError

TIMEOUT_NS = 30 * S
_LOOK_NS = 20 * MS
"""How often to look where the system has no pidfd."""
_LONGEST_TEXT = 300


class CommandPower:
    """Supply through a command.

    Args:
        on: program and arguments that switch on.
        off: program and arguments that switch off.
        clock: the clock of the bench's port, in ns.
        timeout_ns: how long a command may run.
    """

    def __init__(
        self,
        on: Sequence[str],
        off: Sequence[str],
        clock: Callable[[], int],
        timeout_ns: int = TIMEOUT_NS,
    ) -> None:
        self._commands = {True: tuple(on), False: tuple(off)}
        self._clock = clock
        self._timeout_ns = timeout_ns

    def switch(self, on: bool) -> Action[Interval]:
        """Run the command."""
        return _Run(self._commands[on], self._clock, self._timeout_ns)


class _Run:
    """A running command (an `Action`)."""

    def __init__(
        self, command: tuple[str, ...], clock: Callable[[], int], timeout_ns: int
    ) -> None:
        self._command = command
        self._clock = clock
        self._timeout_ns = timeout_ns
        self._process: subprocess.Popen[bytes] | None = None
        self._output = tempfile.TemporaryFile()  # noqa: SIM115 - read once the command ended
        self._pidfd = -1
        self._began_at = 0
        self._limit_at = 0
        self._now = 0
        self._result: Interval | None = None

    @property
    def descriptors(self) -> Sequence[int]:
        """Readable when the command has ended."""
        return (self._pidfd,) if self._pidfd >= 0 else ()

    @property
    def wake_at(self) -> int:
        """The time-out, or the next look."""
        return self._limit_at if self._pidfd >= 0 else min(self._limit_at, self._now + _LOOK_NS)

    def start(self, now: int) -> None:
        """Start the command."""
        self._now = now
        self._began_at = self._clock()
        self._limit_at = self._began_at + self._timeout_ns
        try:
            self._process = subprocess.Popen(
                self._command,
                stdin=subprocess.DEVNULL,
                stdout=self._output,
                stderr=subprocess.STDOUT,
            )
        except (OSError, ValueError, IndexError) as error:
            self._output.close()
            raise BenchError(
                f"power command {list(self._command)!r} cannot be started ({error}); correct "
                "[power] in the bench file"
            ) from None
        with contextlib.suppress(OSError, AttributeError):  # old kernels, other systems
            self._pidfd = os.pidfd_open(self._process.pid)

    def poll(self, now: int) -> bool:
        """Look whether it has ended.

        Raises:
            BenchError: it failed or takes too long.
        """
        self._now = now
        assert self._process is not None
        status = self._process.poll()
        if status is None:
            if now < self._limit_at:
                return False
            self._process.kill()
            self._process.wait()
        said = self._end()
        if status is None:
            took = show_span(self._timeout_ns)
            raise BenchError(f"power command {list(self._command)!r} did not end within {took}")
        if status:
            raise BenchError(
                f"power command {list(self._command)!r} failed with status {status}: {said!r}"
            )
        self._result = Interval(self._began_at, self._clock())
        return True

    def _end(self) -> str:
        """Release what the run held; returns the end of what the command said."""
        if self._pidfd >= 0:
            os.close(self._pidfd)
            self._pidfd = -1
        self._output.seek(0)
        said = self._output.read().decode("utf-8", "replace").strip()
        self._output.close()
        return said[-_LONGEST_TEXT:]

    def result(self) -> Interval:
        """From start to end of the command."""
        assert self._result is not None
        return self._result
