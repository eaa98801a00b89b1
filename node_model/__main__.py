"""Hosts a node model: `python -m node_model --profile keypad --channel vcan0`."""

from __future__ import annotations

import sys

from node_model.host.command import main

if __name__ == "__main__":
    sys.exit(main())
