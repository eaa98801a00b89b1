"""All objects of a file: sections [1018] and [1018sub1], compact ones unfolded."""

from __future__ import annotations

from node_model.eds.described import Described, counted, describe, renumbered, revalued
from node_model.eds.text import Paragraph, Said, Text
from node_model.od import Access, DataType

MOST_OBJECTS = 50_000
"""Real devices have up to some thousands."""
FIRST_INDEX = 0x1000
"""Below are data types, no objects."""
DOMAIN_OBJECT, ARRAY, RECORD = 2, 8, 9
LAST_SUB = 0xFE
_HEX = frozenset("0123456789abcdef")


def place_of(name: str) -> tuple[int, int | None] | None:
    """Index and sub-index in the name of a section; None where it is no object's."""
    index, sign, sub = name.partition("sub")
    if len(index) != 4 or not set(index) <= _HEX:
        return None
    if not sign:
        return int(index, 16), None
    if not 0 < len(sub) <= 2 or not set(sub) <= _HEX:
        return None
    return int(index, 16), int(sub, 16)


def objects_of(text: Text) -> list[Described]:
    """Every sub-index, in order.

    Raises:
        EdsError: one of them cannot be read, or there are far too many.
    """
    heads: dict[int, Paragraph] = {}
    parts: dict[int, dict[int, Paragraph]] = {}
    for name, paragraph in text.paragraphs.items():
        place = place_of(name)
        if place is None or place[0] < FIRST_INDEX:
            continue
        index, sub = place
        if sub is None:
            heads[index] = paragraph
        elif parts.setdefault(index, {}).setdefault(sub, paragraph) is not paragraph:
            text.remark(paragraph.line, f"[{paragraph.title}] is there twice; the first counts")
    found: list[Described] = []
    for index in sorted(heads.keys() | parts.keys()):
        found += _object(text, heads.get(index), index, parts.get(index, {}))
        if len(found) > MOST_OBJECTS:
            raise text.refuse(0, f"more than {MOST_OBJECTS} objects", "split the file")
    return found


def _object(
    text: Text, head: Paragraph | None, index: int, parts: dict[int, Paragraph]
) -> list[Described]:
    if head is None:
        first = next(iter(parts.values()))
        text.remark(first.line, f"[{first.title}] has no section [{index:04X}]")
        head = Paragraph(f"{index:04X}", first.line)
    said = head.said("objecttype")
    shape = counted(text, said, "ObjectType") if said else 0
    found: dict[int, Described] = {}
    if shape in {ARRAY, RECORD} or parts:
        found = _unfolded(text, head, index)
        for sub, paragraph in parts.items():
            found[sub] = describe(text, paragraph, index, sub)
    else:
        found[0] = describe(text, _single(head, shape), index, 0)
    return [found[sub] for sub in sorted(found)]


def _single(head: Paragraph, shape: int) -> Paragraph:
    """A DOMAIN needs neither type nor access."""
    if shape != DOMAIN_OBJECT:
        return head
    options = dict(head.options)
    for name, value in (("datatype", "0x000F"), ("accesstype", "rw")):
        if head.said(name) is None:
            options[name] = Said(value, head.line)
    return Paragraph(head.title, head.line, options)


def _unfolded(text: Text, head: Paragraph, index: int) -> dict[int, Described]:
    """The sub-indices that CompactSubObj stands for (CiA 306, 4.6.3.2.4)."""
    said = head.said("compactsubobj")
    count = counted(text, said, "CompactSubObj") if said else 0
    if said is None or count == 0:
        return {}
    if not 0 < count <= LAST_SUB:
        text.remark(said.line, f"CompactSubObj is {count}; a sub-index is at most {LAST_SUB}")
        count = min(max(count, 0), LAST_SUB)
    model = describe(text, head, index, 1)
    names = text.paragraph(f"{index:04x}name")
    values = text.paragraph(f"{index:04x}value")
    found = {0: _count(head, index, count)}
    for sub in range(1, count + 1):
        each = renumbered(model, sub, names.words(str(sub)) or f"{model.name}{sub}")
        value = values.said(str(sub))
        found[sub] = each if value is None else revalued(text, each, value)
    return found


def _count(head: Paragraph, index: int, count: int) -> Described:
    """Sub-index 0 of a compact object: how many others there are."""
    text = Text("")
    options = {
        "parametername": Said("Highest sub-index", head.line),
        "datatype": Said("0x0005", head.line),
        "accesstype": Said(Access.RO.value, head.line),
        "defaultvalue": Said(str(count), head.line),
    }
    made = describe(text, Paragraph(head.title, head.line, options), index, 0)
    assert made.kind is DataType.UNSIGNED8
    return made
