"""pytest's terminal in the middle of a test: lent to an operator, or told how long it takes."""

from __future__ import annotations

from contextlib import nullcontext
from typing import Any

import pytest

_LEAST = 24
"""Characters; in less room a text says nothing."""
_ERASE = "\x1b[K"
"""To the end of the line (ECMA-48, EL)."""


class Ticker:
    """A text behind pytest's dots that comes and goes: nothing of it stays on the screen.

    Args:
        writer: pytest's writer of the terminal.
        manager: pytest's capture, or None.
    """

    def __init__(self, writer: Any, manager: Any) -> None:
        self._writer = writer
        self._manager = manager
        self._shown = 0
        self.lent = False
        """Somebody else writes and reads there: nothing is shown."""

    def show(self, text: str) -> None:
        """Show a text in the place of the one before, as far as the line has room for it."""
        if self.lent:
            return
        writer = self._writer
        room = writer.fullwidth - writer.width_of_current_line - 2
        told = f" {text}"[:room] if room >= _LEAST else ""
        self._write(self._gone() + told)
        self._shown = len(told)

    def wipe(self) -> None:
        """Leave the line as pytest has written it."""
        if self._shown:
            self._write(self._gone())
            self._shown = 0

    def _gone(self) -> str:
        return "\b" * self._shown + _ERASE if self._shown else ""

    def _write(self, text: str) -> None:
        """Past pytest's capture, and past its count of what stands on the line."""
        manager = self._manager
        with manager.global_and_fixture_disabled() if manager else nullcontext():
            file = self._writer._file  # the writer would count what it writes itself
            file.write(text)
            file.flush()


class PytestCapture:
    """Gives standard input and output back to the terminal while somebody is asked.

    Args:
        config: of pytest.
        ticker: that shows how long a test takes, or None.
    """

    def __init__(self, config: pytest.Config, ticker: Ticker | None = None) -> None:
        self._manager: Any = config.pluginmanager.getplugin("capturemanager")
        self._ticker = ticker

    def suspend(self) -> None:
        """The terminal is the operator's; `in_` or standard input stays on the null device."""
        if self._ticker is not None:
            self._ticker.wipe()
            self._ticker.lent = True
        if self._manager is not None:
            self._manager.suspend_global_capture(in_=True)

    def resume(self) -> None:
        """Capture again."""
        if self._manager is not None:
            self._manager.resume_global_capture()
        if self._ticker is not None:
            self._ticker.lent = False


def ticker_of(config: pytest.Config) -> Ticker | None:
    """A ticker on the terminal; None = nobody looks: output goes to a file or to a program."""
    reporter: Any = config.pluginmanager.getplugin("terminalreporter")
    if reporter is None or not reporter.isatty:
        return None
    return Ticker(config.get_terminal_writer(), config.pluginmanager.getplugin("capturemanager"))
