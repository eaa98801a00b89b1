"""JSON lines with exact time: instants in integer ns, written as seconds with 9 decimals.

A float of seconds since 1970 resolves only 0.24 us, so the digits are written and read
as decimal numbers and never pass through a float.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from decimal import Decimal

LINE_LIMIT = 64 * 1024
"""Bytes a line may have in either direction, line feed not counted (control protocol 1)."""

_NS = 1_000_000_000


class Seconds(int):
    """An instant or a span in ns that goes out as a JSON number of seconds."""


def dump(value: object) -> str:
    """A value as JSON text on one line, ASCII only."""
    match value:
        case Seconds():
            sign = "-" if value < 0 else ""
            whole, rest = divmod(abs(value), _NS)
            return f"{sign}{whole}.{rest:09d}"
        case Mapping():
            pairs = (f"{json.dumps(str(key))}:{dump(item)}" for key, item in value.items())
            return "{" + ",".join(pairs) + "}"
        case list() | tuple():
            return "[" + ",".join(map(dump, value)) + "]"
        case Decimal():
            return str(value)
        case _:
            return json.dumps(value)


def parse(line: bytes) -> dict[str, object]:
    """The object on a line.

    Raises:
        ValueError: no UTF-8, no JSON, or no object; the text is one sentence.
    """
    try:
        value = json.loads(
            line.decode("utf-8"), parse_float=Decimal, parse_constant=_refuse_constant
        )
    except UnicodeDecodeError as error:
        raise ValueError(f"the line is no UTF-8 (byte {error.start})") from None
    except (ValueError, RecursionError) as error:
        raise ValueError(f"the line is no JSON: {str(error)[:80]}") from None
    if not isinstance(value, dict):
        raise ValueError("the line is no JSON object")
    return value


def _refuse_constant(name: str) -> object:
    raise ValueError(f"{name} is no JSON number")


def span_ns(value: object, most_ns: int) -> int | None:
    """A JSON number of seconds as a span in ns; None unless it is 0..`most_ns`."""
    if isinstance(value, bool) or not isinstance(value, int | Decimal):
        return None
    # The range first: the exponent of a hostile number may be enormous.
    if not 0 <= value <= most_ns // _NS:
        return None
    return int(value * _NS + Decimal("0.5"))
