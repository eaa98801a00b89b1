"""Reads what `candump -L` and `candump -t a` write: a frame a line, with its stamp.

Laws: a line that is none is an error with its number; stamps are read as text, so that no
digit is lost; a file of any size costs the memory of its longest line, and that is bounded.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

from hil_tests.reporting.files import RecordUnreadable
from hil_tests.reporting.frames import Logged
from hil_tests.trace import BusEvent, EventKind, Sighting
from node_model.frame import Frame

_LONGEST_LINE = 1000
_ERROR = 1 << 29
_STAMP = r"\((?P<s>[0-9]{1,10})\.(?P<fraction>[0-9]{1,9})\)\s+(?P<channel>\S{1,40})\s+"
_LOGGED = re.compile(
    _STAMP + r"(?P<id>[0-9A-Fa-f]{3}|[0-9A-Fa-f]{8})#"
    r"(?:#(?P<fd>[0-9A-Fa-f]*)|(?P<remote>R)(?P<length>[0-8]?)|(?P<data>(?:[0-9A-Fa-f]{2})*))"
    r"(?:_(?P<dlc>[0-9A-Fa-f]))?(?:\s+(?P<way>[RT]))?\s*"
)
_SHOWN = re.compile(
    _STAMP + r"(?:(?P<way>[RT]X)\s+[-BE]\s+[-BE]\s+)?(?P<id>[0-9A-Fa-f]{3}|[0-9A-Fa-f]{8})\s+"
    r"\[(?P<length>[0-9]{1,2})\]\s*(?P<remote>remote request)?"
    r"(?P<data>(?:\s*[0-9A-Fa-f]{2})*)\s*(?:ERRORFRAME)?\s*"
)
_REMEDY = "record with candump -L, or cut the file before that line"


def read_candump(path: Path) -> Iterator[Logged]:
    """Every frame of a candump log, with the name of its channel.

    Raises:
        RecordUnreadable: no such file, or a line that is no frame with a stamp.
    """
    try:
        with path.open("rb") as file:
            number = 0
            while line := file.readline(_LONGEST_LINE):
                number += 1
                text = line.decode("ascii", "replace").strip()
                if text and not text.startswith("#"):
                    yield _logged(text, path, number)
    except OSError as error:
        raise RecordUnreadable(f"recording {path}: {error.strerror or error}") from error


def _logged(text: str, path: Path, number: int) -> Logged:
    found = _LOGGED.fullmatch(text) or _SHOWN.fullmatch(text)
    where = f"recording {path}, line {number}"
    if found is None:
        shown = text if len(text) <= 60 else f"{text[:57]}..."
        raise RecordUnreadable(f"{where}: {shown!r} is no frame with a stamp; {_REMEDY}")
    at = int(found["s"]) * 10**9 + int(found["fraction"].ljust(9, "0"))
    try:
        entry = _entry(found, at)
    except ValueError as error:
        raise RecordUnreadable(f"{where}: {error}; {_REMEDY}") from None
    return Logged(entry, found["channel"], f"line {number}")


def _entry(found: re.Match[str], at: int) -> Sighting | BusEvent:
    groups = found.groupdict()
    word, extended = int(found["id"], 16), len(found["id"]) > 3
    data = bytes.fromhex("".join((groups["data"] or "").split()))
    if extended and word & _ERROR:
        return BusEvent(EventKind.ERROR, at, f"class {word & _ERROR - 1:#x}, data {data.hex()}")
    if groups.get("fd") is not None or len(data) > 8:
        return BusEvent(EventKind.FD_FRAME, at, f"identifier {found['id']}h")
    own = (groups["way"] or "R").startswith("T")
    length = int(groups["length"] or 0)
    if groups["remote"]:
        return Sighting(Frame(word, remote=True, extended=extended, dlc=length), at, 0, own)
    if "fd" not in groups and length != len(data):
        raise ValueError(f"[{length}] and {len(data)} bytes of data do not fit")
    dlc = int(groups.get("dlc") or "0", 16)
    return Sighting(
        Frame(word, data, extended=extended, dlc=dlc if dlc > 8 else len(data)), at, 0, own
    )
