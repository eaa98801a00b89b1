"""`python -m hil_tests.replay`, the same as `nodeproof replay`."""

from __future__ import annotations

import sys

from hil_tests.replay.command import main

if __name__ == "__main__":
    sys.exit(main())
