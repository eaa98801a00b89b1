"""How a run ends when it is told to: SIGTERM, which CI systems send, is taken like Ctrl-C."""

from __future__ import annotations

import contextlib
import signal
from collections.abc import Callable


def take_sigterm_as_interrupt() -> Callable[[], None]:
    """From now on SIGTERM ends the run as Ctrl-C does: the bench is left as configured.

    Returns:
        Puts back what was there. Where somebody else handles SIGTERM, nothing is changed.
    """
    if signal.getsignal(signal.SIGTERM) is not signal.SIG_DFL:
        return lambda: None
    # Outside the main thread no handler can be set, and no signal comes.
    with contextlib.suppress(ValueError):
        signal.signal(signal.SIGTERM, signal.default_int_handler)
    return _put_back


def _put_back() -> None:
    with contextlib.suppress(ValueError):
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
