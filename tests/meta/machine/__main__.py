"""`python -m tests.meta.machine`."""

from __future__ import annotations

import sys

from tests.meta.machine.command import main

if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
