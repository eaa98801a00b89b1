"""`nodeproof replay`: what it takes; a recorded run goes to pytest, other files to the judge."""

from __future__ import annotations

import sys
from argparse import ArgumentParser, ArgumentTypeError, Namespace
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import NoReturn

from hil_tests.errors import ConfigError
from hil_tests.replay.record import load_record
from hil_tests.replay.runs import open_runs
from hil_tests.reporting.files import RecordUnreadable
from hil_tests.reporting.foreign import is_pcapng
from hil_tests.reporting.results_reader import RESULTS

USAGE = 4
"""Wrong use, as pytest has it."""
ACCEPTANCE = "hil_tests.acceptance"
_IMPORTED = "ignore:Module already imported:pytest.PytestAssertRewriteWarning"
"""This command is a part of the plugin that pytest loads: it cannot be new to it. A project that
makes warnings errors would not start."""


class _Parser(ArgumentParser):
    """Ends with pytest's exit status for wrong use."""

    def error(self, message: str) -> NoReturn:
        """Say what is wrong, and end."""
        self.print_usage(sys.stderr)
        self.exit(USAGE, f"{self.prog}: error: {message}\n")


def main(words: Sequence[str] | None = None) -> int:
    """Run as a program; returns its exit status."""
    try:
        return run(_Parser("python -m hil_tests.replay"), sys.argv[1:] if words is None else words)
    except ConfigError as error:
        print(error, file=sys.stderr)
        return USAGE


def run(parser: ArgumentParser, words: Sequence[str]) -> int:
    """The command; returns its exit status.

    Raises:
        ConfigError: nothing that can be replayed.
    """
    parser.description = (
        "Judge recordings. A run of ours goes through the same tests again; other recordings"
        " (candump, BLF, ASC, pcapng) are judged by what needs no stimuli."
    )
    _add_options(parser)
    options = parser.parse_args(words)
    paths: list[Path] = options.recording
    ours = [path for path in paths if _is_ours(path)]
    if ours and len(ours) < len(paths):
        other = next(path for path in paths if path not in ours)
        raise ConfigError(f"{other} is no trace of ours, and {ours[0]} is; replay them one by one")
    if ours:
        return _test(options)
    from hil_tests.run import onlooking  # noqa: PLC0415 - the command starts at once

    return onlooking.judge(options, ["nodeproof", "replay", *words])


def _add_options(parser: ArgumentParser) -> None:
    parser.add_argument(
        "recording",
        nargs="+",
        type=Path,
        metavar="RUN|FILE",
        help="folder of a run, or recordings",
    )
    parser.add_argument("--profile", metavar="NAME|FILE", help="limits to judge by now")
    parser.add_argument("--strict", action="store_true", help="observations fail, too")
    others = parser.add_argument_group("recordings of others")
    others.add_argument("--node-id", type=_node_id, metavar="N", help="whom to judge, 1 .. 127")
    others.add_argument(
        "--heartbeat", metavar="TIME", help='its heartbeat period, e.g. "500 ms"; "0 ms" = none'
    )
    others.add_argument(
        "--bitrate", type=_bit_rate, metavar="N", help="bit/s, where it was a wire with bit times"
    )
    others.add_argument(
        "--doubt", metavar="TIME", help="how late a stamp can be, at most (default 1 ms)"
    )
    others.add_argument(
        "--channel", default="", metavar="NAME", help="the one of several in the file"
    )
    parser.add_argument(
        "--reports", metavar="DIR", default="reports", help="where the replay is written"
    )


def _node_id(text: str) -> int:
    """A node id.

    Raises:
        ArgumentTypeError: none.
    """
    return _whole(text, 1, 127)


def _bit_rate(text: str) -> int:
    """A bit rate of CAN.

    Raises:
        ArgumentTypeError: none.
    """
    return _whole(text, 10_000, 1_000_000)


def _whole(text: str, least: int, most: int) -> int:
    number = int(text) if text.isascii() and text.isdigit() and len(text) < 9 else -1
    if not least <= number <= most:
        raise ArgumentTypeError(f"{text[:20]!r} is no whole number in {least} .. {most}")
    return number


def _is_ours(path: Path) -> bool:
    """Whether it is a run of ours, or a trace of one of its tests."""
    if path.is_dir() or path.name == RESULTS:
        return True
    try:
        if not is_pcapng(path):
            return False
        load_record(path)
    except RecordUnreadable:
        return False
    return True


def _test(options: Namespace) -> int:
    """A run goes through pytest."""
    import pytest  # noqa: PLC0415 - the command starts at once

    given = [f"--can-replay={path}" for path in options.recording]
    given.append(f"--can-reports={options.reports}")
    if options.profile:
        given.append(f"--can-profile={options.profile}")
    if options.strict:
        given.append("--can-strict")
    recorded = open_runs([str(path) for path in options.recording])
    found = places(recorded.tests)
    return int(pytest.main(["-W", _IMPORTED, "-p", "no:cacheprovider", *given, *found]))


def places(tests: Iterable[str]) -> list[str]:
    """Where pytest finds tests, from their node ids.

    Raises:
        ConfigError: they are not ours, and not where they were.
    """
    files = {name.partition("::")[0] for name in tests}
    own = sorted(file for file in files if not _is_acceptance(file))
    for file in own:
        if not Path(file).is_file():
            raise ConfigError(
                f"{file}: the recorded tests stood there; replay from the folder that they are in"
            )
    return own or ["--pyargs", ACCEPTANCE]


def _is_acceptance(file: str) -> bool:
    """Whether a file is one of the suite; pytest names it from there where it lies elsewhere."""
    folder = ACCEPTANCE.replace(".", "/")
    suite = Path(__file__).parents[1] / "acceptance"
    return folder in file or (not Path(file).is_file() and (suite / file).is_file())
