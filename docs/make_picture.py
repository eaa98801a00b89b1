"""Draws a terminal run as SVG.

    pytest --color=yes ... | python docs/make_picture.py --command 'pytest ...' > docs/run.svg

Reads what a program printed, colours included, and writes one self-contained picture. What
the terminal would have shown is shown as it is, long lines folded; nothing is left out.
"""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Iterator, Sequence
from typing import NamedTuple, TextIO
from xml.sax.saxutils import escape

COLUMNS = 104
_INDENT = 4
"""How far the rest of a folded line is moved in."""
_CHAR, _LINE, _PAD, _BAR = 8.43, 19, 18, 36
"""Width of a letter of 14 px, height of a line, margin, and height of the title bar, in px."""

_SGR = re.compile(r"\x1b\[([0-9;]*)m")
_PLAIN = "#d4d8dd"
_COLOURS = {
    30: "#5c6370", 31: "#ff6b6b", 32: "#7ec77e", 33: "#e5c07b",
    34: "#61afef", 35: "#c678dd", 36: "#56b6c2", 37: "#d4d8dd",
    90: "#5c6370", 91: "#ff6b6b", 92: "#7ec77e", 93: "#e5c07b",
    94: "#61afef", 95: "#c678dd", 96: "#56b6c2", 97: "#ffffff",
}  # fmt: skip

_SVG = (
    '<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}"'
    ' viewBox="0 0 {width} {height}" role="img">'
)
_TITLE_BAR = (
    '<path d="M0 {bottom}V8a8 8 0 0 1 8-8H{right}a8 8 0 0 1 8 8V{bottom}Z" fill="#2c313a"/>'
)
_BUTTON = '<circle cx="{x}" cy="14" r="6" fill="{colour}"/>'
_BUTTONS = ("#ff6b6b", "#e5c07b", "#7ec77e")
_LETTERS = (
    '<g font-family="\'DejaVu Sans Mono\',Menlo,Consolas,monospace" font-size="14"'
    ' xml:space="preserve">'
)


class Style(NamedTuple):
    """How a letter looks."""

    colour: str = _PLAIN
    bold: bool = False


Cell = tuple[str, Style]
"""A letter and how it looks."""


def cells(line: str, style: Style) -> tuple[list[Cell], Style]:
    """The letters of a line, and the style that holds after it."""
    found: list[Cell] = []
    end = 0
    for code in _SGR.finditer(line):
        found += [(letter, style) for letter in line[end : code.start()]]
        style = changed(style, code[1])
        end = code.end()
    found += [(letter, style) for letter in line[end:]]
    return found, style


def changed(style: Style, codes: str) -> Style:
    """The style after an SGR sequence (ECMA-48, 8.3.117); unknown codes change nothing."""
    for code in (int(part or 0) for part in codes.split(";")):
        if code == 0:
            style = Style()
        elif code == 1:
            style = style._replace(bold=True)
        elif code == 22:
            style = style._replace(bold=False)
        elif code == 39:
            style = style._replace(colour=_PLAIN)
        elif code in _COLOURS:
            style = style._replace(colour=_COLOURS[code])
    return style


def folded(row: Sequence[Cell], columns: int) -> Iterator[Sequence[Cell]]:
    """A line in pieces that fit, broken at blanks where there are some."""
    indent: list[Cell] = []
    while len(row) > columns:
        blanks = [at for at in range(columns // 2, columns) if row[at][0] == " "]
        cut = blanks[-1] if blanks else columns
        yield row[:cut]
        indent = [(" ", Style())] * _INDENT
        row = [*indent, *row[cut + bool(blanks) :]]
    yield row


def spans(row: Sequence[Cell]) -> Iterator[tuple[int, str, Style]]:
    """Neighbours of one style: first column, text, style."""
    start = 0
    while start < len(row):
        style, end = row[start][1], start
        while end < len(row) and row[end][1] == style:
            end += 1
        yield start, "".join(letter for letter, _ in row[start:end]), style
        start = end


def draw(lines: Sequence[str], title: str, columns: int) -> str:
    """The picture."""
    style = Style()
    rows: list[Sequence[Cell]] = []
    for line in lines:
        row, style = cells(line, style)
        rows += folded(row, columns)
    width, height = columns * _CHAR + 2 * _PAD, len(rows) * _LINE + _BAR + _PAD
    texts: list[str] = []
    for number, line_cells in enumerate(rows):
        texts += drawn(line_cells, _BAR + 14 + number * _LINE)
    head = [
        _SVG.format(width=round(width), height=round(height)),
        f"<title>{escape(title)}</title>",
        '<rect width="100%" height="100%" rx="8" fill="#20242b"/>',
        _TITLE_BAR.format(bottom=_BAR - 8, right=round(width) - 8),
        *(_BUTTON.format(x=20 + 20 * n, colour=colour) for n, colour in enumerate(_BUTTONS)),
        _LETTERS,
    ]
    return "\n".join([*head, *texts, "</g>", "</svg>"]) + "\n"


def drawn(row: Sequence[Cell], y: int) -> Iterator[str]:
    """One line; the length of each text is given, so that any font keeps the columns."""
    for column, text, style in spans(row):
        if text.strip():
            bold = ' font-weight="bold"' if style.bold else ""
            yield (
                f'<text x="{_PAD + column * _CHAR:.1f}" y="{y}" fill="{style.colour}"{bold}'
                f' textLength="{len(text) * _CHAR:.1f}" lengthAdjust="spacingAndGlyphs">'
                f"{escape(text)}</text>"
            )


def main(source: TextIO, target: TextIO, argv: Sequence[str]) -> None:
    """Reads a run, writes its picture."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--command", help="shown as the first line, after a prompt")
    parser.add_argument("--columns", type=int, default=COLUMNS)
    options = parser.parse_args(argv)
    lines = source.read().rstrip("\n").split("\n")
    if options.command:
        lines.insert(0, f"\x1b[32m$\x1b[0m \x1b[1m{options.command}\x1b[0m")
    target.write(draw(lines, options.command or "a run of nodeproof", options.columns))


if __name__ == "__main__":
    main(sys.stdin, sys.stdout, sys.argv[1:])
