"""The host's programs, behind a contract small enough to fake."""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Mapping
from pathlib import Path
from typing import Protocol

from hil_tests.vm.errors import Unavailable

# Where administrators' programs live; an ordinary user's PATH often leaves these folders out.
_SYSTEM_FOLDERS = ("/usr/sbin", "/sbin", "/usr/local/sbin")


class Shell(Protocol):
    """Finds and runs programs."""

    def find(self, program: str) -> str | None:
        """Returns the program's path, None where there is none."""
        ...

    def run(self, *command: str, cwd: Path | None = None) -> str:
        """Returns what the command printed.

        Raises:
            Unavailable: It could not be run or failed; the message quotes its last words.
        """
        ...

    def is_root(self) -> bool:
        """Whether programs run as root."""
        ...


class HostShell:
    """The programs of this machine."""

    def find(self, program: str) -> str | None:
        """See `Shell.find`."""
        folders = (os.environ.get("PATH", os.defpath), *_SYSTEM_FOLDERS)
        return shutil.which(program, path=os.pathsep.join(folders))

    def run(self, *command: str, cwd: Path | None = None) -> str:
        """See `Shell.run`."""
        program = self.find(command[0])
        if program is None:
            raise Unavailable(f"This machine has no program `{command[0]}`: install it.")
        done = subprocess.run(
            [program, *command[1:]], cwd=cwd, capture_output=True, text=True, check=False
        )
        if done.returncode:
            last = (done.stderr.strip() or done.stdout.strip() or "no message").splitlines()[-1]
            raise Unavailable(f"`{' '.join(command)}` failed ({last}); mend that and try again.")
        return done.stdout

    def is_root(self) -> bool:
        """See `Shell.is_root`."""
        return os.geteuid() == 0


def cache_folder(environment: Mapping[str, str]) -> Path:
    """Returns where fetched kernels are kept, as the XDG base directory specification has it."""
    base = environment.get("XDG_CACHE_HOME")
    return (
        Path(base) if base else Path(environment.get("HOME") or "/root") / ".cache"
    ) / "nodeproof"
