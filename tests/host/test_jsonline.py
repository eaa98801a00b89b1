"""JSON lines whose times are exact to the nanosecond."""

from __future__ import annotations

import json
from decimal import Decimal

import pytest

from node_model.host.jsonline import Seconds, dump, parse, span_ns
from node_model.node import S


@pytest.mark.parametrize(
    ("instant", "text"),
    [
        (1_795_329_081_123_456_789, "1795329081.123456789"),
        (1_795_329_081_000_000_001, "1795329081.000000001"),
        (0, "0.000000000"),
        (-1, "-0.000000001"),
        (-1_500_000_000, "-1.500000000"),
    ],
)
def test_instant_keeps_its_nanoseconds(instant: int, text: str) -> None:
    """Nine decimals, and no float in between."""
    assert dump(Seconds(instant)) == text
    assert json.loads(text, parse_float=Decimal) * S == instant


def test_everything_else_is_plain_json() -> None:
    """Names are escaped, so that a line is ASCII and one line."""
    value: dict[str, object] = {
        "a": [1, True, None, "ü\n\ud800"],
        "b": (1.5, {"c": {}}),
        "d": Decimal("0.25"),
    }
    text = dump(value)

    assert text.isascii()
    assert "\n" not in text
    assert json.loads(text) == {
        "a": [1, True, None, "ü\n\ud800"],
        "b": [1.5, {"c": {}}],
        "d": 0.25,
    }


@pytest.mark.parametrize(
    ("line", "why"),
    [
        (b"", "no JSON"),
        (b"{", "no JSON"),
        (b"[" * 60_000, "no JSON"),
        (b'{"a": NaN}', "no JSON"),
        (b'{"a": -Infinity}', "no JSON"),
        (b'{"a": ' + b"9" * 5000 + b"}", "no JSON"),
        (b"[]", "no JSON object"),
        (b"7", "no JSON object"),
        (b'{"a": "\xff"}', "no UTF-8"),
        (b"\xef\xbb\xbf{}", "no JSON"),
    ],
)
def test_what_is_no_object_is_refused(line: bytes, why: str) -> None:
    """One sentence says why; nothing else is raised."""
    with pytest.raises(ValueError, match=why):
        parse(line)


@pytest.mark.parametrize(
    ("value", "span"),
    [
        (0, 0),
        (2, 2 * S),
        (Decimal("0.004"), 4_000_000),
        (Decimal("0.0000000004"), 0),
        (Decimal(600), 600 * S),
        (Decimal("600.1"), None),
        (Decimal("1e999999"), None),
        (Decimal("1e-999999"), 0),
        (-1, None),
        (Decimal("-0.001"), None),
        (True, None),
        ("1", None),
        (None, None),
        ([], None),
    ],
)
def test_spans_are_bounded_numbers(value: object, span: int | None) -> None:
    """A hostile exponent is refused before anybody computes with it."""
    assert span_ns(value, 600 * S) == span
