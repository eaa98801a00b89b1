"""The lint: every rule about an EDS that can be checked without a device."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from hil_tests.eds.findings import Finding
from hil_tests.eds.rules_pdo import directions, mappings, pdo_counts
from hil_tests.eds.rules_structure import lists, mandatory, sub_numbers, unknown_keys
from hil_tests.eds.rules_values import defaults, device_facts
from hil_tests.eds.sheet import Sheet

Rule = Callable[[Sheet], Iterator[Finding]]

RULES: tuple[Rule, ...] = (
    lists,
    mandatory,
    defaults,
    sub_numbers,
    mappings,
    directions,
    unknown_keys,
    pdo_counts,
    device_facts,
)


def lint(sheet: Sheet) -> tuple[Finding, ...]:
    """All that is wrong with a file, what was noticed while reading included, by line."""
    found = [*sheet.findings, *(finding for rule in RULES for finding in rule(sheet))]
    return tuple(sorted(found, key=lambda finding: (finding.line, finding.rule)))
