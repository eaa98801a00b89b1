"""EDS files for tests: the sound one, and parts of it changed."""

from __future__ import annotations

from pathlib import Path

from hil_tests.eds import Sheet, lint
from hil_tests.eds.lines import parse
from hil_tests.eds.sheet import sheet_of

FILES = Path(__file__).parent / "files"
SOUND = (FILES / "sound.eds").read_text("ascii")


def sheet(text: str | bytes) -> Sheet:
    """What a text says."""
    data = text if isinstance(text, bytes) else text.encode("ascii")
    return sheet_of(parse("x.eds", data))


def changed(*pairs: tuple[str, str]) -> Sheet:
    """The sound file with the first occurrence of each text replaced."""
    text = SOUND
    for old, new in pairs:
        assert old in text
        text = text.replace(old, new, 1)
    return sheet(text)


def found(of: Sheet) -> list[str]:
    """The findings of the lint, without the file's name."""
    return [str(finding).removeprefix("x.eds:") for finding in lint(of)]


def line_of(text: str, source: str = SOUND) -> int:
    """Where a text stands."""
    return source[: source.index(text)].count("\n") + 1
