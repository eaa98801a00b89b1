"""pytest's capture, in the words that an operator prompt needs."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import nullcontext
from typing import Any

import pytest


class PytestCapture:
    """Gives standard input and output back to the terminal while somebody is asked."""

    def __init__(self, config: pytest.Config) -> None:
        self._manager: Any = config.pluginmanager.getplugin("capturemanager")

    def suspend(self) -> None:
        """The terminal is the operator's; `in_` or standard input stays on the null device."""
        if self._manager is not None:
            self._manager.suspend_global_capture(in_=True)

    def resume(self) -> None:
        """Capture again."""
        if self._manager is not None:
            self._manager.resume_global_capture()


def say_past_capture(config: pytest.Config) -> Callable[[str], None] | None:
    """Writes a line to the terminal in the middle of a test; None = there is no terminal."""
    reporter: Any = config.pluginmanager.getplugin("terminalreporter")
    manager: Any = config.pluginmanager.getplugin("capturemanager")
    if reporter is None:
        return None

    def say(line: str) -> None:
        with manager.global_and_fixture_disabled() if manager else nullcontext():
            reporter.write_line(line)
            reporter.flush()

    return say
