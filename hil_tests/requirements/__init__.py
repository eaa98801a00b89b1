"""The catalogue of requirements: texts, clauses and classes, one TOML file a source."""

from __future__ import annotations

from hil_tests.requirements.catalogue import (
    FACILITIES,
    KINDS,
    LENIENT,
    Kind,
    LimitDefault,
    Requirement,
    load,
    load_all,
    load_with_sheet,
    near,
    parse,
)

__all__ = [
    "FACILITIES",
    "KINDS",
    "LENIENT",
    "Kind",
    "LimitDefault",
    "Requirement",
    "load",
    "load_all",
    "load_with_sheet",
    "near",
    "parse",
]
