"""pytest's capture, in the words that an operator prompt needs."""

from __future__ import annotations

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
