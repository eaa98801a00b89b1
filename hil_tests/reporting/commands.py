"""The subcommands of `nodeproof` that work on runs as they lie on the disk."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

from hil_tests.reporting import compare as comparing
from hil_tests.reporting import history as past
from hil_tests.reporting.check import REPORTS, check_run, results_path
from hil_tests.reporting.files import RecordUnreadable
from hil_tests.reporting.results_reader import load_results
from hil_tests.reporting.summary import summary_of

WRONG = 1
"""Something is wrong with a run, or worse than in another."""
UNREADABLE = 4
"""pytest's word for wrong use: there is no such run."""


def guarded(command: Callable[[], int]) -> int:
    """Carry a command out; a file that is no good ends it with the reason."""
    try:
        return command()
    except (RecordUnreadable, OSError) as error:
        print(error, file=sys.stderr)
        return UNREADABLE


def check(parser: argparse.ArgumentParser, words: Sequence[str]) -> int:
    """`nodeproof check`: 0 = every run is what it says, 1 = something is wrong with one."""
    parser.description = (
        "Hold runs against the schema of results.json, their sums and their recordings."
    )
    parser.add_argument("run", nargs="+", type=Path, help="folder of a run, or its results.json")
    runs = parser.parse_args(words).run
    return guarded(lambda: max(map(_checked, runs)))


def _checked(run: Path) -> int:
    wrong = check_run(run)
    state = load_results(results_path(run)).state
    print(f"{run}: {state}, {'valid' if not wrong else f'{len(wrong)} things are wrong'}")
    print("".join(f"  {line}\n" for line in wrong), end="")
    return WRONG if wrong else 0


def _add_outputs(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--json", metavar="FILE", help="as JSON too; - = on standard output alone")
    parser.add_argument("--svg", metavar="FILE", type=Path, help="as a plot, too")


def _put_out(options: argparse.Namespace, lines: Sequence[str], data: object, svg: str) -> None:
    """The table on standard output, and what else was asked for."""
    if options.json == "-":
        print(json.dumps(data, indent=1))
    else:
        print("\n".join(lines))
        if options.json:
            Path(options.json).write_text(json.dumps(data, indent=1) + "\n", "utf-8")
    if options.svg:
        options.svg.write_text(svg, "utf-8")


def compare(parser: argparse.ArgumentParser, words: Sequence[str]) -> int:
    """`nodeproof compare`: 1 = a requirement stands worse in the last run than in the first."""
    parser.description = (
        "Show where runs differ: the outcome of each requirement, and the room that its narrowest"
        " check left, as a share of what the limits allow. Exit status 1: something stands worse"
        " in the last run than in the first."
    )
    parser.add_argument("run", nargs="+", type=Path, help="folder of a run; two or more")
    parser.add_argument("--all", action="store_true", help="requirements that agree, too")
    _add_outputs(parser)
    options = parser.parse_args(words)
    if len(options.run) < 2:
        parser.error("name two runs, or more")

    def do() -> int:
        runs = [summary_of(results_path(run)) for run in options.run]
        names = comparing.differing(runs, everything=options.all)
        lines = comparing.table(runs, names)
        data = comparing.to_json(runs, names)
        _put_out(options, lines, data, comparing.plot(runs, names))
        return WRONG if data["worse"] else 0

    return guarded(do)


def history(parser: argparse.ArgumentParser, words: Sequence[str]) -> int:
    """`nodeproof history`: the devices that were tested, or the runs of one."""
    parser.description = (
        "Show the runs of a device, the oldest first, and the room that its narrowest checks left."
        " Without a serial number: which devices were tested. The index beside the runs is made"
        " from them, and brought up to date each time."
    )
    parser.add_argument("serial", nargs="?", help="of the device; all = every run")
    parser.add_argument("--reports", type=Path, default=REPORTS, help="folder of the runs")
    text = "margins of requirements whose id begins so; may be repeated"
    parser.add_argument("--clause", action="append", metavar="ID", default=[], help=text)
    parser.add_argument("--rebuild", action="store_true", help="make the index anew")
    _add_outputs(parser)
    options = parser.parse_args(words)
    return guarded(lambda: _history(options))


def _history(options: argparse.Namespace) -> int:
    known = past.History(options.reports, rebuild=options.rebuild)
    for line in known.unreadable:
        print(line, file=sys.stderr)
    if options.serial is None:
        lines = [f"{serial or '(none)':20s}{count:5d} runs, the last one {last[:19]}"
                 for serial, count, last in known.serials()]  # fmt: skip
        print("\n".join(lines or ["no runs"]))
        return 0
    runs = known.runs(None if options.serial == "all" else options.serial)
    if not runs:
        told = ", ".join(serial for serial, _, _ in known.serials() if serial) or "none"
        raise RecordUnreadable(f"{options.serial}: no runs of that device; there are: {told}")
    names = past.narrowest(runs, options.clause)
    title = f"Room left to the limits: {options.serial}"
    data = past.to_json(runs)
    _put_out(options, past.table(runs, names), data, past.plot(runs, names, title))
    return 0
