"""An EDS file as sections and options with their lines; nothing is interpreted yet.

Laws: reading takes time in proportion to the size of the file, and no file breaks it. Names
of sections and options are compared without regard to case. Two sections with one name are
read as one, of two options the first counts; each is a finding.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from hil_tests.eds.findings import Finding, Severity
from hil_tests.errors import ConfigError

LARGEST = 8 << 20
"""Bytes of a file; real ones have some hundred thousand."""

SYNTAX = "C-EDS-01"


@dataclass(frozen=True, slots=True)
class Option:
    """`name = text` on a line."""

    name: str
    text: str
    line: int


@dataclass(slots=True)
class Section:
    """`[name]` with its options, by name in lower case."""

    name: str
    line: int
    options: dict[str, Option] = field(default_factory=dict)

    def get(self, name: str) -> Option | None:
        """An option that says something; None where it is missing or empty."""
        option = self.options.get(name.lower())
        return option if option is not None and option.text else None

    def text(self, name: str, default: str = "") -> str:
        """What an option says."""
        option = self.get(name)
        return default if option is None else option.text


@dataclass(slots=True)
class Document:
    """A file: sections by name in lower case, and what was wrong so far."""

    file: str
    sections: dict[str, Section]
    findings: list[Finding]

    def section(self, *names: str) -> Section | None:
        """The first of these sections that exists."""
        for name in names:
            if (found := self.sections.get(name.lower())) is not None:
                return found
        return None

    def error(self, line: int, rule: str, text: str, remedy: str) -> None:
        """Note an error."""
        self.findings.append(Finding(self.file, line, rule, text, remedy))

    def warn(self, line: int, rule: str, text: str, remedy: str) -> None:
        """Note a warning."""
        self.findings.append(Finding(self.file, line, rule, text, remedy, Severity.WARNING))


def read_document(path: str | Path) -> Document:
    """Read a file.

    Raises:
        ConfigError: it cannot be opened, or it is far too large.
    """
    try:
        with Path(path).open("rb") as file:
            data = file.read(LARGEST + 1)
    except (OSError, ValueError) as error:
        raise ConfigError(f"{path}: cannot be read: {error}; give the path of an EDS") from None
    if len(data) > LARGEST:
        raise ConfigError(f"{path}: more than {LARGEST >> 20} MiB; an EDS has less than one")
    return parse(str(path), data)


def parse(file: str, data: bytes) -> Document:
    """The sections in the bytes of a file."""
    document = Document(file, {}, [])
    text = _decoded(document, data)
    section: Section | None = None
    for number, raw in enumerate(re.split(r"\r\n|\n|\r", text), start=1):
        line = raw.strip(" \t\0\f\v")
        if not line or line.startswith(";"):
            continue
        if line.startswith("["):
            section = _begun(document, line, number)
        elif section is not None:
            _take(document, section, line, number)
        else:
            document.error(
                number,
                SYNTAX,
                f"{_short(line)!r} stands before any section",
                "begin with [FileInfo]",
            )
    return document


def _decoded(document: Document, data: bytes) -> str:
    """The text; CiA 306 asks for ASCII."""
    if data.startswith((b"\xff\xfe", b"\xfe\xff")):
        document.warn(1, SYNTAX, "the text is UTF-16", "save it as ASCII")
        return data.decode("utf-16", "replace")
    if data.startswith(b"\xef\xbb\xbf"):
        document.warn(1, SYNTAX, "the file begins with a byte order mark", "save it as ASCII")
        data = data[3:]
    if b"\0" in data:
        line = data.count(b"\n", 0, data.index(b"\0")) + 1
        document.error(line, SYNTAX, "a byte is 00h", "save it as ASCII")
    for encoding in ("ascii", "utf-8"):
        try:
            text = data.decode(encoding)
        except UnicodeDecodeError as error:
            _tell_encoding(document, data, error, encoding)
        else:
            return text
    return data.decode("cp1252", "replace")


def _tell_encoding(
    document: Document, data: bytes, error: UnicodeDecodeError, encoding: str
) -> None:
    if encoding == "ascii":
        line = data.count(b"\n", 0, error.start) + 1
        byte = data[error.start]
        document.warn(line, SYNTAX, f"byte {byte:02X}h is not ASCII", "use ASCII only")


def _begun(document: Document, line: str, number: int) -> Section:
    name, closed, rest = line[1:].partition("]")
    name = name.strip()
    if not closed or not name:
        document.error(number, SYNTAX, f"{_short(line)!r} is no section", "write [name]")
    elif rest.strip() and not rest.strip().startswith(";"):
        document.warn(
            number, SYNTAX, f"{_short(rest.strip())!r} stands behind a section", "drop it"
        )
    section = Section(name, number)
    first = document.sections.setdefault(name.lower(), section)
    if first is not section:
        document.error(
            number,
            SYNTAX,
            f"section [{_short(name)}] was there in line {first.line}",
            "merge the two",
        )
    return first


def _take(document: Document, section: Section, line: str, number: int) -> None:
    name, equals, text = line.partition("=")
    name = name.strip()
    if not equals or not name:
        document.error(
            number, SYNTAX, f"{_short(line)!r} is no option", "write name=value, or begin with ;"
        )
        return
    option = Option(name, text.strip(" \t\0"), number)
    first = section.options.setdefault(name.lower(), option)
    if first is not option:
        document.error(
            number,
            SYNTAX,
            f"{_short(name)} is {_short(option.text)!r} here "
            f"and {_short(first.text)!r} in line {first.line}",
            "keep one",
        )


def _short(text: str) -> str:
    return text if len(text) <= 40 else text[:37] + "..."


def numbered(section: Section) -> Iterator[tuple[int, Option]]:
    """Options whose names are decimal numbers: 1=..., 2=..."""
    for name, option in section.options.items():
        if name.isascii() and name.isdecimal() and len(name) <= 6:
            yield int(name), option
