"""Reading plain data that may be anything: what is not there, or of another type, is nothing."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any


def fact(data: Any, *keys: str) -> Any:
    """A value inside nested tables; None where it is not there."""
    for key in keys:
        if not isinstance(data, Mapping):
            return None
        data = data.get(key)
    return data


def words(data: Any, *keys: str) -> list[str]:
    """A list of texts; empty where there is none."""
    found = fact(data, *keys)
    return [str(each) for each in found] if isinstance(found, list) else []


def table_of(data: Any, *keys: str) -> Mapping[str, Any]:
    """A table; empty where there is none."""
    found = fact(data, *keys)
    return found if isinstance(found, Mapping) else {}
