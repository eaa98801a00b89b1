"""The subcommands of `nodeproof` that work on runs as they lie on the disk."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from hil_tests.reporting.check import check_run, results_path
from hil_tests.reporting.files import RecordUnreadable
from hil_tests.reporting.results_reader import load_results

WRONG = 1
"""Something is wrong with a run."""
UNREADABLE = 4
"""pytest's word for wrong use: there is no such run."""


def check(parser: argparse.ArgumentParser, words: Sequence[str]) -> int:
    """`nodeproof check`: 0 = every run is what it says, 1 = something is wrong with one."""
    parser.description = (
        "Hold runs against the schema of results.json, their sums and their recordings."
    )
    parser.add_argument("run", nargs="+", type=Path, help="folder of a run, or its results.json")
    status = 0
    for run in parser.parse_args(words).run:
        try:
            wrong = check_run(run)
        except RecordUnreadable as error:
            print(error, file=sys.stderr)
            return UNREADABLE
        state = load_results(results_path(run)).state
        print(f"{run}: {state}, {'valid' if not wrong else f'{len(wrong)} things are wrong'}")
        print("".join(f"  {line}\n" for line in wrong), end="")
        status = WRONG if wrong else status
    return status
