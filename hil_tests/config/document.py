"""Reads a TOML file that anybody may have written into plain tables.

Bounded before it is parsed: Python's TOML parser takes time that grows with the square
of the number of dots in a line, half a minute for a line of 64 KiB.
"""

from __future__ import annotations

import difflib
import itertools
import re
import stat
import tomllib
from pathlib import Path

from hil_tests.config.report import Problem, refusal
from hil_tests.errors import ConfigError

MAX_BYTES = 64 * 1024
MAX_LINE = 1000
"""Characters; the longest sensible line, a table of keys, has about 200."""

_PLACE = re.compile(r"\s*\(at (line \d+, column \d+|end of document)\)\s*$")


def read_document(path: str) -> dict[str, object]:
    """The tables of a TOML file.

    Raises:
        ConfigError: the file is missing, no regular file, unreadable, too big, not UTF-8
            or no TOML; the text gives the line where there is one.
    """
    data = _read_bytes(path)
    try:
        text = data.decode("utf-8-sig")  # Windows editors write a byte order mark
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        raise _refusal(
            path, f"line {line}: byte {data[error.start]:#04x} is no UTF-8; save it as UTF-8"
        ) from None
    return parse_document(text, path)


def parse_document(text: str, path: str) -> dict[str, object]:
    """The tables of a TOML text; `path` names it in errors.

    Raises:
        ConfigError: the text is too long or no TOML.
    """
    for number, line in enumerate(text.split("\n"), 1):
        if len(line) > MAX_LINE:
            raise _refusal(path, f"line {number}: longer than {MAX_LINE} characters; break it up")
    try:
        return tomllib.loads(text)
    except RecursionError:
        raise _refusal(path, "nested too deeply; a file of this kind has two levels") from None
    except ValueError as error:  # syntax, or a number with more digits than Python converts
        raise _refusal(path, _syntax(str(error), text)) from None


def _read_bytes(path: str) -> bytes:
    try:
        mode = Path(path).stat().st_mode
        if not stat.S_ISREG(mode):
            raise _refusal(path, _not_a_file(mode))
        with Path(path).open("rb") as file:
            data = file.read(MAX_BYTES + 1)
    except FileNotFoundError:
        raise _refusal(path, f"no such file{_neighbour(path)}") from None
    except OSError as error:
        raise _refusal(path, f"cannot be read: {error.strerror or error}") from None
    except ValueError as error:  # a NUL in the name
        raise _refusal(path, f"is no file name: {error}") from None
    if len(data) > MAX_BYTES:
        raise _refusal(path, f"larger than {MAX_BYTES // 1024} KiB; is it the right file?")
    return data


def _not_a_file(mode: int) -> str:
    if stat.S_ISDIR(mode):
        return "is a directory; name the TOML file in it"
    return "is a device, pipe or socket; name a regular TOML file"


def _neighbour(path: str) -> str:
    """A file beside the missing one whose name is much like it."""
    wanted = Path(path)
    try:
        names = [entry.name for entry in itertools.islice(wanted.parent.iterdir(), 500)]
    except (OSError, ValueError):
        return f"; the folder {wanted.parent} cannot be listed"
    close = difflib.get_close_matches(wanted.name[:64], names, n=1)
    return f"; did you mean {wanted.with_name(close[0])}?" if close else ""


def _syntax(message: str, text: str) -> str:
    """The parser's complaint with the place in front."""
    found = _PLACE.search(message)
    if not found:
        return f"no TOML: {message[:200]}"
    place, what = found[1], message[: found.start()]
    if place == "end of document":
        place = f"line {text.rstrip().count(chr(10)) + 1}, at the end"
    return f"{place}: no TOML: {what[:200]}"


def _refusal(path: str, what: str) -> ConfigError:
    return refusal(path, [Problem((), what)])
