"""Reads the shipped EDS files; to be replaced by node_model.eds."""

from __future__ import annotations

import configparser
from functools import cache
from importlib import resources

from node_model.od import Access, DataType, Entry


@cache
def _table(name: str) -> configparser.ConfigParser:
    parser = configparser.ConfigParser(interpolation=None)
    parser.read_string((resources.files("node_model.profiles") / name).read_text("utf-8"))
    return parser


def _bytes(kind: DataType, text: str, node_id: int) -> bytes:
    if kind is DataType.VISIBLE_STRING:
        return text.encode()
    if not kind.is_number:
        return bytes.fromhex(text)
    value = sum(node_id if part == "$NODEID" else int(part, 0) for part in text.split("+"))
    return kind.pack(value)


def entries_of(name: str, node_id: int) -> list[Entry]:
    """The objects of a shipped EDS."""
    found = []
    for section, values in _table(name).items():
        place, _, sub = section.partition("sub")
        if "DataType" not in values or len(place) != 4:
            continue
        kind = DataType(int(values["DataType"], 0))
        value = _bytes(kind, values.get("DefaultValue", ""), node_id)
        low, high = (values.get(key) for key in ("LowLimit", "HighLimit"))
        found.append(
            Entry(
                int(place, 16),
                int(sub or "0", 16),
                values["ParameterName"],
                kind,
                Access(values["AccessType"]),
                value,
                value,
                int(low) if low else None,
                int(high) if high else None,
                values.get("PDOMapping") == "1",
            )
        )
    return found
