"""`nodeproof eds FILE...`: what is wrong with EDS files."""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence

from hil_tests.eds.findings import Finding, Severity
from hil_tests.eds.lint import lint
from hil_tests.eds.sheet import read_sheet

TEXT = (
    "Check EDS and DCF files (CiA 306) without a device. Prints one line for each finding; "
    "the exit status is 1 where one of them is an error, 0 where there are warnings only."
)


def examine(files: Sequence[str]) -> Iterator[Finding]:
    """The findings of all files, in order.

    Raises:
        ConfigError: a file cannot be opened.
    """
    for file in files:
        yield from lint(read_sheet(file))


def check(parser: argparse.ArgumentParser, words: Sequence[str]) -> int:
    """Run the command; returns its exit status."""
    parser.description = TEXT
    parser.add_argument("files", nargs="+", metavar="FILE", help="an EDS or DCF file")
    worst = 0
    for finding in examine(parser.parse_args(words).files):
        print(finding)
        worst |= finding.severity is Severity.ERROR
    return worst
