"""The raw text of a file: what each section says, with line numbers.

Lenient where the meaning is plain: any of the usual encodings and line ends, any case,
sections twice, stray lines. Each of these leaves a remark. The first of two values counts.
"""

from __future__ import annotations

import codecs
from dataclasses import dataclass, field

from node_model.eds.errors import EdsError, Remark, excerpt

LARGEST = 8 << 20
"""Bytes; the files of large devices have some hundred thousand."""

_MARKS = (
    (codecs.BOM_UTF8, "utf-8"),
    (codecs.BOM_UTF16_LE, "utf-16-le"),
    (codecs.BOM_UTF16_BE, "utf-16-be"),
)


@dataclass(frozen=True, slots=True)
class Said:
    """The value of an option, and its line."""

    value: str
    line: int


@dataclass(slots=True)
class Paragraph:
    """A section: its name as written, the line where it begins, its options in lower case."""

    title: str
    line: int
    options: dict[str, Said] = field(default_factory=dict)

    def said(self, option: str) -> Said | None:
        """What an option says; None where it says nothing."""
        found = self.options.get(option)
        return found if found and found.value else None

    def words(self, option: str) -> str:
        """What an option says, as text."""
        found = self.options.get(option)
        return found.value if found else ""


@dataclass(slots=True)
class Text:
    """A file: its sections by name in lower case, and the remarks so far."""

    file: str
    paragraphs: dict[str, Paragraph] = field(default_factory=dict)
    remarks: list[Remark] = field(default_factory=list)

    def remark(self, line: int, text: str) -> None:
        """Note what should be otherwise."""
        self.remarks.append(Remark(line, text))

    def refuse(self, line: int, what: str, remedy: str) -> EdsError:
        """The error to raise."""
        return EdsError(self.file, line, what, remedy)

    def paragraph(self, *names: str) -> Paragraph:
        """The first of these sections that is there; an empty one where none is."""
        for name in names:
            if name in self.paragraphs:
                return self.paragraphs[name]
        return Paragraph(names[0], 0)


def read_text(file: str, data: bytes) -> Text:
    """What is in the bytes of a file.

    Raises:
        EdsError: it is too large, or no text.
    """
    text = Text(file)
    if len(data) > LARGEST:
        raise text.refuse(0, f"{len(data)} bytes", f"an EDS has less than {LARGEST >> 20} MiB")
    present: Paragraph | None = None
    lines = decode(text, data).replace("\r\n", "\n").replace("\r", "\n").split("\n")
    for number, line in enumerate(map(str.strip, lines), start=1):
        if not line or line[0] == ";":
            continue
        if line[0] == "[":
            present = _open(text, line, number)
            continue
        name, sign, value = line.partition("=")
        if present is None or not sign or not name.strip():
            text.remark(number, f"{excerpt(line)} belongs to nothing and is skipped")
            continue
        _enter(text, present, name.strip().lower(), Said(value.strip(), number))
    return text


def decode(text: Text, data: bytes) -> str:
    """The characters of a file: after a byte order mark, else UTF-8, else Windows 1252.

    Raises:
        EdsError: there are bytes of 0.
    """
    for mark, encoding in _MARKS:
        if data.startswith(mark):
            text.remark(1, f"the file begins with the byte order mark of {encoding}")
            return _sound(text, data[len(mark) :].decode(encoding, "replace"))
    try:
        return _sound(text, data.decode("utf-8"))
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        text.remark(line, f"byte {data[error.start]:02X}h is read as Windows 1252")
        return _sound(text, data.decode("cp1252", "replace"))


def _sound(text: Text, decoded: str) -> str:
    at = decoded.find("\0")
    if at >= 0:
        line = decoded.count("\n", 0, at) + 1
        raise text.refuse(line, "a character is 00h", "save the file as plain text")
    return decoded


def _open(text: Text, line: str, number: int) -> Paragraph:
    title = line[1:].partition("]")[0].strip()
    if "]" not in line or not title:
        raise text.refuse(number, f"{excerpt(line)} is no section", "write [name]")
    key = title.lower()
    if key in text.paragraphs:
        text.remark(number, f"section [{title[:40]}] is there twice and is read as one")
    return text.paragraphs.setdefault(key, Paragraph(title, number))


def _enter(text: Text, present: Paragraph, name: str, said: Said) -> None:
    first = present.options.setdefault(name, said)
    if first is not said:
        ignored = "" if first.value == said.value else f"; {excerpt(said.value)} is ignored"
        text.remark(said.line, f"{name[:40]} was there in line {first.line}{ignored}")
