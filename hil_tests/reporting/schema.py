"""Holds a document against a JSON Schema: the few words of it that ours uses, and no other.

A whole validator is a dependency that a bench need not have; a word that this one does not
know is an error of the schema, not something to pass over.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from importlib import resources
from typing import Any

_KINDS: Mapping[str, Any] = {
    "object": dict,
    "array": list,
    "string": str,
    "boolean": bool,
    "null": type(None),
    "integer": int,
    "number": (int, float),
}
_WORDS = {
    *("$ref", "type", "const", "enum", "required", "properties", "additionalProperties"),
    *("items", "minItems", "maxItems", "minimum", "$schema", "title", "$defs"),
}


def results_schema() -> dict[str, Any]:
    """The schema of results.json."""
    place = resources.files("hil_tests.reporting").joinpath("results.schema.json")
    return dict(json.loads(place.read_text("utf-8")))


def breaches(document: object, schema: Mapping[str, Any]) -> Iterator[str]:
    """Where a document breaks a schema, one sentence each.

    Args:
        document: as read from JSON.
        schema: may refer to its own "$defs".

    Raises:
        ValueError: the schema has a word that is not known here.
    """
    return _breaches(document, schema, schema, "")


def _breaches(
    value: Any, rule: Mapping[str, Any], root: Mapping[str, Any], at: str
) -> Iterator[str]:
    if unknown := set(rule) - _WORDS:
        raise ValueError(f"unknown words in the schema: {', '.join(sorted(unknown))}")
    if "$ref" in rule:
        yield from _breaches(value, root["$defs"][rule["$ref"].rpartition("/")[2]], root, at)
        return
    where = at.removeprefix(".") or "the document"
    kinds = rule.get("type", [])
    kinds = [kinds] if isinstance(kinds, str) else kinds
    if kinds and not any(_is(value, kind) for kind in kinds):
        yield f"{where}: {_short(value)} is no {' or '.join(kinds)}"
        return
    yield from _wrong_value(value, rule, where)
    if isinstance(value, list):
        for place, item in enumerate(value):
            yield from _breaches(item, rule.get("items", {}), root, f"{at}[{place}]")
    if isinstance(value, dict):
        yield from (
            f"{at}.{key} is missing".removeprefix(".")
            for key in rule.get("required", ())
            if key not in value
        )
        for key, item in value.items():
            inner = rule.get("properties", {}).get(key, rule.get("additionalProperties", {}))
            if inner is False:
                yield f"{at}.{key} is unknown".removeprefix(".")
            else:
                yield from _breaches(item, inner, root, f"{at}.{key}")


def _wrong_value(value: Any, rule: Mapping[str, Any], where: str) -> Iterator[str]:
    if "enum" in rule and value not in rule["enum"]:
        allowed = ", ".join(map(str, rule["enum"]))
        yield f"{where}: {_short(value)} is none of {allowed}"
    if "const" in rule and value != rule["const"]:
        yield f"{where}: {_short(value)} is not {rule['const']!r}"
    if isinstance(value, int | float) and value < rule.get("minimum", value):
        yield f"{where}: {value} is less than {rule['minimum']}"
    if isinstance(value, list):
        least, most = rule.get("minItems", 0), rule.get("maxItems", len(value))
        if not least <= len(value) <= most:
            yield f"{where}: {len(value)} items instead of {least} .. {most}"


def _is(value: object, kind: str) -> bool:
    """Whether a value is of a kind in JSON Schema's words: true is no number."""
    number = isinstance(value, bool) and kind in {"integer", "number"}
    return isinstance(value, _KINDS[kind]) and not number


def _short(value: object) -> str:
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:57]}..."
