"""What is wrong with an EDS file, and where."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum


class Severity(Enum):
    """How bad it is."""

    ERROR = "error"
    """The file says something wrong, or something that has no meaning."""
    WARNING = "warning"
    """It can be understood, and should be written otherwise."""


@dataclass(frozen=True, slots=True)
class Finding:
    """One thing that is wrong.

    Args:
        file: path as the user gave it.
        line: 1 for the first; 0 where something is missing from the whole file.
        rule: id of the requirement.
        text: what is there, with its value.
        remedy: what to write instead.
        severity: how bad it is.
    """

    file: str
    line: int
    rule: str
    text: str
    remedy: str
    severity: Severity = Severity.ERROR

    def __str__(self) -> str:
        mark = "" if self.severity is Severity.ERROR else "warning: "
        return f"{self.file}:{self.line}: {self.rule}: {mark}{self.text}; {self.remedy}"
