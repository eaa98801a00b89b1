"""The script that draws the README's picture."""

from __future__ import annotations

import io
import xml.etree.ElementTree as ET

from docs import make_picture

TEXT = "{http://www.w3.org/2000/svg}text"


def drawn(printed: str, *options: str) -> ET.Element:
    """The picture of what a program printed."""
    target = io.StringIO()
    make_picture.main(io.StringIO(printed), target, options)
    return ET.fromstring(target.getvalue())  # noqa: S314 - our own


def test_every_word_is_in_the_picture() -> None:
    """Colours become colours, characters of XML stay characters."""
    found = [
        (text.text, text.get("fill")) for text in drawn("a <b> \x1b[31mc\x1b[0m d\n").iter(TEXT)
    ]
    plain = make_picture.Style().colour

    assert found == [("a <b> ", plain), ("c", "#ff6b6b"), (" d", plain)]


def test_a_long_line_is_folded_at_a_blank() -> None:
    """The rest goes on below, moved in."""
    texts = [text.text for text in drawn("aaaa bbbb cccc\n", "--columns", "10").iter(TEXT)]

    assert texts == ["aaaa bbbb", "    cccc"]


def test_a_long_word_is_cut() -> None:
    """Nothing leaves the picture."""
    texts = [text.text for text in drawn("abcdefghijklm\n", "--columns", "10").iter(TEXT)]

    assert texts == ["abcdefghij", "    klm"]


def test_the_command_stands_above() -> None:
    """After a prompt, and bold."""
    prompt, command, printed = drawn("x\n", "--command", "pytest").iter(TEXT)

    assert (prompt.text, command.text, printed.text) == ("$", "pytest", "x")
    assert (prompt.get("font-weight"), command.get("font-weight")) == (None, "bold")
