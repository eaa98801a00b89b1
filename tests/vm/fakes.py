"""Stands in for the host's programs and for a running machine."""

from __future__ import annotations

import io
import subprocess
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from hil_tests.vm.errors import Unavailable


@dataclass(slots=True)
class FakeShell:
    """Programs that only exist in a table.

    Attributes:
        programs: The path of each program that is there.
        answers: What a command prints; a command that is missing here fails.
        root: Whether they run as root.
        act: Called with each command and its folder, for the files that it would make.
        ran: The commands so far.
    """

    programs: Mapping[str, str] = field(default_factory=dict)
    answers: Mapping[tuple[str, ...], str] = field(default_factory=dict)
    root: bool = False
    act: Callable[[tuple[str, ...], Path | None], None] | None = None
    ran: list[tuple[str, ...]] = field(default_factory=list)

    def find(self, program: str) -> str | None:
        """See `Shell.find`."""
        return self.programs.get(program)

    def run(self, *command: str, cwd: Path | None = None) -> str:
        """See `Shell.run`."""
        self.ran.append(command)
        if self.act is not None:
            self.act(command, cwd)
        if command not in self.answers and self.act is None:
            raise Unavailable(f"`{' '.join(command)}` failed (fake)")
        return self.answers.get(command, "")

    def is_root(self) -> bool:
        """See `Shell.is_root`."""
        return self.root


@dataclass(slots=True)
class FakeProcess:
    """A machine that does what a script says at each look, and then ends.

    Attributes:
        script: Called one after the other; when none is left, the process has ended.
        stdin: What the launcher told the guest.
        ended_by: "terminate" or "kill", if the launcher did.
    """

    script: list[Callable[[], None]]
    stdin: io.BytesIO = field(default_factory=io.BytesIO)
    ended_by: str | None = None

    def wait(self, timeout: float | None = None) -> int:
        """See `Process.wait`."""
        if not self.script:
            return 0
        self.script.pop(0)()
        raise subprocess.TimeoutExpired("qemu", timeout or 0)

    def terminate(self) -> None:
        """See `Process.terminate`."""
        self.ended_by = "terminate"

    def kill(self) -> None:
        """See `Process.kill`."""
        self.ended_by = "kill"


@dataclass(slots=True)
class FakeClock:
    """Seconds that pass when a test says so."""

    now: float = 100.0

    def __call__(self) -> float:
        """Returns the time."""
        return self.now

    def later(self, seconds: float) -> Callable[[], None]:
        """Returns an action for which time passes."""

        def act() -> None:
            self.now += seconds

        return act
