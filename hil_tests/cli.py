"""The `nodeproof` command: everything beside testing, which is pytest's.

Each subcommand has a parser of its own and imports what it needs when it is used. Exit
status: 0, or 1 where a file has errors, or 11 where bench or bus is unavailable, or 4
(pytest's word) for wrong use; the subcommands `node` and `vcan` end as what they run ends.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NoReturn

if TYPE_CHECKING:
    from hil_tests.requirements import Requirement

USAGE = 4
"""Wrong use, as pytest has it."""
UNAVAILABLE = 11
"""Bench or bus unavailable."""

_LONGEST_CELL = 76


class Parser(argparse.ArgumentParser):
    """Ends with pytest's exit status for wrong use."""

    def error(self, message: str) -> NoReturn:
        """Say what is wrong, and end."""
        self.print_usage(sys.stderr)
        self.exit(USAGE, f"{self.prog}: error: {message}\n")


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command; returns its exit status."""
    words = list(sys.argv[1:] if argv is None else argv)
    try:
        status = _main(words)
        sys.stdout.flush()
    except BrokenPipeError:  # `nodeproof mutants | head`: nobody reads on
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
        return 0
    return status


def _main(words: Sequence[str]) -> int:
    from hil_tests.errors import ConfigError  # noqa: PLC0415 - the command starts at once

    parser = _overview()
    # Only the name is parsed here: the rest belongs to the subcommand, dashes and all.
    options = parser.parse_args(words[:1])
    if options.command is None:
        parser.print_help()
        return USAGE
    try:
        return COMMANDS[options.command][1](words[1:])
    except ConfigError as error:
        print(error, file=sys.stderr)
        return USAGE


def _overview() -> Parser:
    lines = [f"  {name:14s}{text}" for name, (text, _) in COMMANDS.items()]
    parser = Parser(
        "nodeproof",
        usage="nodeproof COMMAND [OPTION]...",
        description="Acceptance bench for CANopen nodes. Tests are run by pytest, e.g.\n\n"
        "  pytest                     the bundled keypad, in virtual time\n"
        "  pytest --can-iface vcan0   over SocketCAN",
        epilog="commands:\n" + "\n".join(lines) + "\n\nnodeproof COMMAND --help says more.",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="version", version=f"nodeproof {_version()}")
    # The commands stand below, with their texts.
    parser.add_argument("command", nargs="?", choices=COMMANDS, help=argparse.SUPPRESS)
    return parser


def _version() -> str:
    from importlib.metadata import PackageNotFoundError, version  # noqa: PLC0415

    try:
        return version("nodeproof")
    except PackageNotFoundError:
        return "(not installed)"


# The subcommands.


def _node(words: Sequence[str]) -> int:
    from node_model.host.command import main as host  # noqa: PLC0415

    return host(words)


def _vcan(words: Sequence[str]) -> int:
    from hil_tests.vm import command  # noqa: PLC0415

    parser = Parser("nodeproof vcan")
    command.add_arguments(parser)
    return command.run(parser.parse_args(words))


def _doctor(words: Sequence[str]) -> int:
    from hil_tests import doctor  # noqa: PLC0415

    parser = Parser("nodeproof doctor", description=doctor.__doc__)
    parser.add_argument("--can-bench", metavar="FILE", help="bench file to check, and its bench")
    findings = list(doctor.examine(parser.parse_args(words).can_bench))
    for finding in findings:
        print(finding)
    return UNAVAILABLE if any(finding.is_needed for finding in findings) else 0


def _explore(words: Sequence[str]) -> int:
    from hil_tests.explore import command  # noqa: PLC0415

    return command.explore(Parser("nodeproof explore"), words)


def _play(words: Sequence[str]) -> int:
    from hil_tests.explore import command  # noqa: PLC0415

    return command.play(Parser("nodeproof play"), words)


def _distil(words: Sequence[str]) -> int:
    from hil_tests.explore import command  # noqa: PLC0415

    return command.distil(Parser("nodeproof distil"), words)


def _check(words: Sequence[str]) -> int:
    from hil_tests.reporting import commands  # noqa: PLC0415

    return commands.check(Parser("nodeproof check"), words)


def _export(words: Sequence[str]) -> int:
    from hil_tests.reporting import export  # noqa: PLC0415

    return export.run(Parser("nodeproof export"), words)


def _eds(words: Sequence[str]) -> int:
    from hil_tests.eds import command  # noqa: PLC0415

    return command.check(Parser("nodeproof eds"), words)


def _replay(words: Sequence[str]) -> int:
    from hil_tests.replay import command  # noqa: PLC0415

    return command.run(Parser("nodeproof replay"), words)


def _compare(words: Sequence[str]) -> int:
    from hil_tests.reporting import commands  # noqa: PLC0415

    return commands.compare(Parser("nodeproof compare"), words)


def _history(words: Sequence[str]) -> int:
    from hil_tests.reporting import commands  # noqa: PLC0415

    return commands.history(Parser("nodeproof history"), words)


def _show(words: Sequence[str]) -> int:
    from hil_tests.run import showing  # noqa: PLC0415

    text = "Open the report of a run in a browser; where there is none, print where it lies."
    parser = Parser("nodeproof show", description=text)
    parser.add_argument("run", metavar="RUN", nargs="?", default="latest", type=Path,
                        help="folder of the run (default: the latest)")  # fmt: skip
    print(showing.show(parser.parse_args(words).run))
    return 0


def _mutants(words: Sequence[str]) -> int:
    from hil_tests.run.catalogue import mutant_table  # noqa: PLC0415

    text = "List the faulty models, and the conforming ones that are different."
    Parser("nodeproof mutants", description=text).parse_args(words)
    print(mutant_table())
    return 0


def _report(words: Sequence[str]) -> int:
    from hil_tests.run import papers  # noqa: PLC0415

    text = "Make report.html of a run again, also of one that was killed."
    parser = Parser("nodeproof report", description=text)
    parser.add_argument("run", metavar="RUN", help="folder of the run, e.g. reports/latest")
    parser.add_argument("--pdf", action="store_true", help="certificate.pdf as well (extra: pdf)")
    parser.add_argument(
        "--matrix", type=Path, metavar="FILE", help="matrix.json of `tox -e mutants`, to show, too"
    )
    options = parser.parse_args(words)
    print(papers.make_again(Path(options.run), pdf=options.pdf, matrix=options.matrix))
    return 0


def _requirements(words: Sequence[str]) -> int:
    from hil_tests.requirements import load  # noqa: PLC0415

    text = "List the requirements that a device is judged by."
    parser = Parser("nodeproof requirements", description=text)
    parser.add_argument("--kind", default="keypad", help="kind of device (default keypad)")
    parser.add_argument("--md", action="store_true", help="as a markdown table, with the clauses")
    parser.add_argument(
        "clause", nargs="*", metavar="ID", help="only ids that begin so, e.g. HB or KEY-04"
    )
    options = parser.parse_args(words)
    known = load(options.kind)
    chosen = _chosen(known, options.clause)
    print("\n".join(markdown_rows(chosen) if options.md else plain_rows(chosen)))
    return 0


def _chosen(known: Mapping[str, Requirement], prefixes: Sequence[str]) -> list[Requirement]:
    """The requirements whose ids begin with one of the prefixes; all, where there is none.

    Raises:
        ConfigError: a prefix that no id begins with; the near misses are named.
    """
    from hil_tests.errors import ConfigError  # noqa: PLC0415
    from hil_tests.requirements import near  # noqa: PLC0415

    wrong = []
    for prefix in prefixes:
        if not any(name.startswith(prefix.upper()) for name in known):
            groups = sorted({name.partition("-")[0] for name in known})
            hint = ", ".join(near(known, prefix) or groups)
            wrong.append(f"{prefix}: no requirement begins so; there are {hint}")
    if wrong:
        raise ConfigError("\n".join(wrong))
    wanted = tuple(prefix.upper() for prefix in prefixes) or ("",)
    return [each for each in known.values() if each.id.startswith(wanted)]


def plain_rows(requirements: Sequence[Requirement]) -> list[str]:
    """Id, class and text, the text folded below itself."""
    from textwrap import wrap  # noqa: PLC0415

    rows = []
    for each in requirements:
        first, *rest = wrap(_told(each), _LONGEST_CELL)
        rows.append(f"{each.id:8s}{each.kind.value:9s}{first}")
        rows += [f"{'':17s}{line}" for line in rest]
    return rows


def _told(requirement: Requirement) -> str:
    """Its text, and why no test shows it, where none does."""
    reason = requirement.untested
    return f"{requirement.text} Not tested: {reason}" if reason else requirement.text


def markdown_rows(requirements: Sequence[Requirement]) -> list[str]:
    """A markdown table: id, class, text, source and clause, facilities, limits."""
    rows = [
        "| id | class | text | from | needs | limits |",
        "| --- | --- | --- | --- | --- | --- |",
    ]
    for each in requirements:
        cells = (
            each.id,
            each.kind.value,
            _told(each),
            f"{each.source}, {each.clause}",
            ", ".join(each.needs),
            ", ".join(f"{limit.name} {limit.default}" for limit in each.limits),
        )
        rows.append("| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |")
    return rows


COMMANDS: Mapping[str, tuple[str, Callable[[Sequence[str]], int]]] = {
    "node": ("host a model of the device by itself, like python -m node_model", _node),
    "vcan": ("run a command where SocketCAN exists: here, or in a virtual machine", _vcan),
    "doctor": ("say what this machine, and the bench of a bench file, can do", _doctor),
    "check": ("hold a run's folder against its schema, its sums and its recordings", _check),
    "compare": ("show where runs differ, in verdicts and in margins", _compare),
    "history": ("show the runs of a device, and how its margins went", _history),
    "show": ("open the report of a run in a browser", _show),
    "mutants": ("list the faulty models that can be put under test", _mutants),
    "eds": ("say what is wrong with EDS and DCF files, line by line", _eds),
    "explore": ("play made-up scenarios on the model, on every core, for a time", _explore),
    "play": ("play one scenario on the model, and show every frame", _play),
    "distil": ("find a small set of scenarios that shows every faulty model", _distil),
    "report": ("make the report of a run again", _report),
    "export": ("write recordings as candump log, BLF, ASC or pcapng", _export),
    "replay": ("judge a recorded run again, or somebody else's recording", _replay),
    "requirements": ("list the requirements that a device is judged by", _requirements),
}
"""Name -> text for people, what to do."""


if __name__ == "__main__":
    sys.exit(main())
