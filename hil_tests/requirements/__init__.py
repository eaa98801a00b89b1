"""The catalogue of requirements: texts, clauses and classes, one TOML file a kind of device."""

from __future__ import annotations

from hil_tests.requirements.catalogue import (
    FACILITIES,
    LENIENT,
    Kind,
    LimitDefault,
    Requirement,
    load,
    near,
    parse,
)

__all__ = ["FACILITIES", "LENIENT", "Kind", "LimitDefault", "Requirement", "load", "near", "parse"]
