"""Runs the checks of the SocketCAN port and of the host on a real vcan0, for test_guest.py.

    python -m tests.bus.guest_checks [WORD...]

A plain script, because importing pytest is dear in the virtual machine: each function
whose name begins with check_ is called; one line a check goes to standard output.
"""

from __future__ import annotations

import sys
import traceback
from collections.abc import Callable

from tests.bus import guest_host_checks, guest_port_checks


def say(text: str) -> None:
    """One line, at once: the machine may die later."""
    sys.stdout.write(text + "\n")
    sys.stdout.flush()


def main() -> int:
    """Run all checks; 0 if none failed."""
    checks: list[Callable[[], str]] = [
        value
        for room in (guest_port_checks, guest_host_checks)
        for name, value in vars(room).items()
        if name.startswith("check_")
    ]
    wanted = sys.argv[1:]
    failed = 0
    for check in checks:
        if wanted and not any(word in check.__name__ for word in wanted):
            continue
        try:
            say(f"ok   {check.__name__}: {check()}")
        except Exception:  # noqa: BLE001 - a check may fail in any way
            failed += 1
            say(f"FAIL {check.__name__}\n{traceback.format_exc()}")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
