"""The bundled model in a process of its own, as a device under test on a real bus."""

from __future__ import annotations

import contextlib
import select
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from hil_tests.errors import BenchError

READY_S = 120
"""How long the model may take to start: importing is slow in an emulated machine."""

_STOP_S = 5
_DYING_S = 0.5
"""From the end of a process's sockets to its status, at most."""
_LAST_WORDS = 1000


class HostedModel:
    """A `python -m node_model` process that serves the control protocol on a unix socket.

    Args:
        interface, channel: the bus, in python-can's words.
        profile: bundled name or path of a TOML file.
        mutant: name of a faulty or different model, or None.
        node_id: overrides the profile's factory setting, or None.
        eds: electronic data sheet in place of the profile's, or None.

    Raises:
        BenchError: it did not start; with what it said.
    """

    def __init__(
        self,
        interface: str,
        channel: str,
        profile: str,
        mutant: str | None = None,
        node_id: int | None = None,
        eds: str | None = None,
    ) -> None:
        self._folder = tempfile.TemporaryDirectory(prefix="nodeproof-")
        self.address = f"unix:{Path(self._folder.name) / 'control'}"
        self._errors = tempfile.TemporaryFile()  # noqa: SIM115  lives as long as the process
        command = [sys.executable, "-m", "node_model", "--control", self.address]
        # On a leash it never outlives us, however we end.
        command += ["--leash", "--interface", interface, "--channel", channel]
        command += ["--profile", profile]
        command += ["--mutant", mutant] if mutant else []
        command += ["--node-id", str(node_id)] if node_id is not None else []
        command += ["--eds", eds] if eds else []
        self.process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self._errors
        )
        try:
            self._await_ready(command)
        except BaseException:
            self.close()
            raise

    def _await_ready(self, command: Sequence[str]) -> None:
        """Wait for the line that says it listens."""
        out = self.process.stdout
        if out is None:  # pragma: no cover - a pipe was asked for
            raise BenchError("the model has no output")
        readable, _, _ = select.select([out], [], [], READY_S)
        line = out.readline().decode(errors="replace").strip() if readable else ""
        if line.startswith("ready"):
            return
        self.process.kill()
        self.process.wait(_STOP_S)
        self._errors.seek(0)
        said = self._errors.read()[-_LAST_WORDS:].decode(errors="replace").strip()
        why = said or line or f"it said nothing in {READY_S} s"
        raise BenchError(f"the model did not start ({' '.join(command[1:])}): {why}")

    def check(self) -> None:
        """Raise BenchError where the process has ended by itself.

        Asked when something broke; a process that is just dying hangs up before it has a
        status, so it gets a moment.
        """
        with contextlib.suppress(subprocess.TimeoutExpired):
            status = self.process.wait(_DYING_S)
            self._errors.seek(0)
            said = self._errors.read()[-_LAST_WORDS:].decode(errors="replace").strip()
            raise BenchError(f"the model's process ended with status {status}: {said}")

    def close(self) -> None:
        """End it; calling this twice is allowed."""
        if self.process.poll() is None:
            self.process.terminate()
            with contextlib.suppress(subprocess.TimeoutExpired):
                self.process.wait(_STOP_S)
            if self.process.poll() is None:
                self.process.kill()
                self.process.wait(_STOP_S)
        for pipe in (self.process.stdin, self.process.stdout):
            if pipe is not None:
                pipe.close()
        self._errors.close()
        self._folder.cleanup()
