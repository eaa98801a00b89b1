"""How everything that is wrong with a file becomes one readable `ConfigError`.

A reader collects `Problem`s and goes on, so that a user mends a file in one round. What
is shown comes from the file and may be hostile: it is cut, escaped and never evaluated.
"""

from __future__ import annotations

import difflib
import reprlib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from hil_tests.errors import ConfigError

SHOWN_PROBLEMS = 50
"""More lines than this help nobody; the rest is counted."""

_SHOWN_VALUE = 60
_COMPARED_NAME = 64
_LISTED_NAMES = 16
_BARE = frozenset("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-")
_SHORT = reprlib.Repr()
_SHORT.maxstring = _SHORT.maxother = _SHORT.maxlong = _SHOWN_VALUE
_SHORT.maxlevel = 2


class _Absent:
    """What stands for a value where the file has none."""


ABSENT = _Absent()


@dataclass(frozen=True, slots=True)
class Problem:
    """One thing that is wrong with a file."""

    path: tuple[str, ...]
    what: str
    """What is wrong and what to write instead."""
    value: object = ABSENT

    def line(self, file: str) -> str:
        """One line: file, path of the key, the value if there is one, what is wrong."""
        parts = [printable(file)]
        if self.path:
            parts.append(show_path(self.path))
        if not isinstance(self.value, _Absent):
            parts.append(show(self.value))
        return ": ".join([*parts, self.what])


class Wrong(Exception):
    """A value breaks its rule; the paths of its problems start at that value."""

    def __init__(self, problems: Sequence[Problem]) -> None:
        super().__init__("; ".join(problem.what for problem in problems))
        self.problems = tuple(problems)

    @classmethod
    def one(cls, value: object, what: str) -> Wrong:
        """The value as a whole is wrong."""
        return cls([Problem((), what, value)])


def refuse(file: str, problems: Sequence[Problem]) -> None:
    """Does nothing if there are no problems.

    Raises:
        ConfigError: with every problem, one a line.
    """
    if problems:
        raise refusal(file, problems)


def refusal(file: str, problems: Sequence[Problem]) -> ConfigError:
    """The error that ends the reading of a file: every problem on a line of its own."""
    lines = list(dict.fromkeys(problem.line(file) for problem in problems))
    hidden = len(lines) - SHOWN_PROBLEMS
    if hidden > 0:
        lines[SHOWN_PROBLEMS:] = [f"{printable(file)}: and {hidden} more problems"]
    return ConfigError("\n".join(lines))


def show(value: object) -> str:
    """A value of the file on one line, cut to a readable length, control codes escaped."""
    if isinstance(value, bool):
        return str(value).lower()
    try:
        text = _SHORT.repr(value)
    except (ValueError, RecursionError):  # a hexadecimal number of many thousand digits
        return f"a very long {type(value).__name__}"
    return text if len(text) <= _SHOWN_VALUE + 2 else f"{text[:_SHOWN_VALUE]}..."


def printable(text: str) -> str:
    """A file name as it is, or quoted where it would disturb a terminal or a line."""
    return text if text and text.isprintable() else ascii(text)


def show_path(path: Iterable[str]) -> str:
    """A TOML key path; parts that TOML would have to quote are quoted and cut."""
    return ".".join(
        key if key and len(key) <= 64 and set(key) <= _BARE else show(key) for key in path
    )


def near_miss(wrong: str, known: Iterable[str]) -> str:
    """Asks for the name that was probably meant, else lists the names that there are.

    The known names may come from a file too: they are shown with the same care.
    """
    names = sorted(known)
    if len(wrong) <= _COMPARED_NAME:
        lower = {name.lower(): name for name in names if len(name) <= _COMPARED_NAME}
        close = difflib.get_close_matches(wrong.lower(), lower, n=2, cutoff=0.6)
        if close:
            return f"did you mean {' or '.join(show_path([lower[name]]) for name in close)}?"
    if not names:
        return "none are known here"
    more = ["..."] if len(names) > _LISTED_NAMES else []
    return f"known: {', '.join([show_path([name]) for name in names[:_LISTED_NAMES]] + more)}"
