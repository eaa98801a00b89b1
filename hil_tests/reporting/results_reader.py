"""Reads `results.json` back, checks what later steps rely on, and mends a torn end.

A kill in the very middle of a write can leave the last item without its end. Each item
stands on a line of its own, so what came before is whole: it is read, and `torn` says so.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hil_tests.reporting.files import RecordUnreadable
from hil_tests.reporting.results import INTERRUPTED, SCHEMA
from hil_tests.reporting.rows import OUTCOMES, TestResult, TraceFile, VerdictRow
from hil_tests.reporting.tally import Tally, Totals

RESULTS = "results.json"
"""Name of the file in the folder of a run."""

_HEAD_LINES = 3


@dataclass(frozen=True, slots=True)
class Results:
    """A run, as its file tells it."""

    run: Mapping[str, Any]
    results: tuple[TestResult, ...]
    requirements: Mapping[str, Any]
    """How each requirement stands, by id."""
    totals: Mapping[str, Any]
    finished: bool
    """The run came to its end; else it was killed, or still goes on."""
    state: str
    """"complete"; or "interrupted": killed, told to stop, or still going on."""
    under_way: Mapping[str, Any] | None
    """The test that was under way, and where its recording is."""
    summary: Mapping[str, Any]
    torn: bool = False
    """The file was cut within its last item; totals are counted anew."""


class _Wrong(Exception):
    """Something in the document is not what it should be."""


def load_results(path: Path) -> Results:
    """The run that a results file tells of.

    Raises:
        RecordUnreadable: no such file, not JSON, another schema, or a field that is
            missing or of the wrong kind; the text names file, place and value.
    """
    try:
        text = path.read_text("utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise RecordUnreadable(f"results {path}: {error}") from error
    try:
        document, torn = _parse(text)
        return _results(document, torn)
    except RecursionError:
        raise RecordUnreadable(f"results {path}: nested too deeply") from None
    except _Wrong as wrong:
        raise RecordUnreadable(f"results {path}: {wrong}") from None


def _parse(text: str) -> tuple[dict[str, Any], bool]:
    try:
        document, torn = json.loads(text), False
    except ValueError as error:
        document, torn = _mended(text, error), True
    if not isinstance(document, dict) or "schema" not in document:
        raise _Wrong(f'is no results file: no "schema"; {SCHEMA!r} is read here')
    if document["schema"] != SCHEMA:
        raise _Wrong(f"schema {str(document['schema'])[:60]!r}; {SCHEMA!r} is read here")
    return document, torn


def _mended(text: str, error: ValueError) -> object:
    """The head and the whole items of a file whose end is torn."""
    lines = text.split("\n")
    try:
        document = json.loads("\n".join([*lines[:_HEAD_LINES], "]}"]))
        items = document["results"]
    except (ValueError, KeyError, TypeError):
        raise _Wrong(f"is no JSON: {error}") from None
    items += _whole_items(lines[_HEAD_LINES:])
    totals, tally = Totals(), Tally()
    for place, item in enumerate(items):
        result = _result(item, f"results[{place}]").to_json()
        totals = totals.plus(result)
        tally.add(totals.tests, result)
    sums = {"requirements": tally.to_json(), "totals": totals.to_json()}
    end: dict[str, Any] = {
        "under_way": None,
        "finished": False,
        "state": INTERRUPTED,
        "summary": {},
    }
    return {**document, **sums, **end}


def _whole_items(lines: Iterable[str]) -> Iterator[dict[str, Any]]:
    """Items that have their last field, the running number: what replaced it would lack it."""
    decoder = json.JSONDecoder()
    for number, line in enumerate(lines, 1):
        try:
            item, _ = decoder.raw_decode(line)
        except ValueError:
            return
        if not isinstance(item, dict) or item.get("number") != number:
            return
        yield item


def _results(document: Mapping[str, Any], torn: bool) -> Results:
    run = _field(document, "run", dict, "")
    items = _field(document, "results", list, "")
    return Results(
        run=run,
        results=tuple(_result(item, f"results[{place}]") for place, item in enumerate(items)),
        requirements=_field(document, "requirements", dict, ""),
        totals=_field(document, "totals", dict, ""),
        finished=_field(document, "finished", bool, ""),
        state=_field(document, "state", str, ""),
        under_way=_field(document, "under_way", dict, "") if document.get("under_way") else None,
        summary=_field(document, "summary", dict, ""),
        torn=torn,
    )


def _field(table: Any, key: str, kind: type, place: str, default: Any = None) -> Any:
    """The value of a key, if it is there and of that kind."""
    where = f"{place}.{key}" if place else key
    if not isinstance(table, dict):
        raise _Wrong(f"{place}: {_shown(table)} is no object")
    if key not in table:
        if default is None:
            raise _Wrong(f"{where} is missing")
        return default
    value = table[key]
    numbers = (int, float) if kind is float else kind
    if not isinstance(value, numbers) or (isinstance(value, bool) and kind is not bool):
        raise _Wrong(f"{where}: {_shown(value)} is no {kind.__name__}")
    return value


def _shown(value: object) -> str:
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:57]}..."


def _outcome(table: Any, place: str) -> str:
    found = str(_field(table, "outcome", str, place))
    if found not in OUTCOMES:
        raise _Wrong(f"{place}.outcome: {_shown(found)} is none of {', '.join(OUTCOMES)}")
    return found


def _text_or_none(table: Any, key: str, place: str) -> str | None:
    return None if table.get(key) is None else str(_field(table, key, str, place))


def _int_or_none(table: Any, key: str, place: str) -> int | None:
    return None if table.get(key) is None else int(_field(table, key, int, place))


def _trace(item: Any, place: str) -> TraceFile | None:
    path = _text_or_none(item, "trace", place)
    if path is None:
        return None
    total = _text_or_none(item, "trace_sha256", place) or ""
    return TraceFile(path, total, _int_or_none(item, "trace_frames", place) or 0)


def _result(item: Any, place: str) -> TestResult:
    rows = _field(item, "verdicts", list, place, [])
    claims = _field(item, "requirements", list, place, [])
    return TestResult(
        test=_field(item, "test", str, place),
        outcome=_outcome(item, place),
        title=_field(item, "title", str, place, ""),
        seconds=_field(item, "seconds", float, place, 0.0),
        bus_ns=_field(item, "bus_ns", int, place, 0),
        frames=_field(item, "frames", int, place, 0),
        error_frames=_field(item, "error_frames", int, place, 0),
        losses=_field(item, "losses", int, place, 0),
        lost=_field(item, "lost", int, place, 0),
        busy_ns=_int_or_none(item, "busy_ns", place),
        requirements=tuple(str(claim) for claim in claims),
        verdicts=tuple(_row(row, f"{place}.verdicts[{n}]") for n, row in enumerate(rows)),
        trace=_trace(item, place),
        reproduce=_text_or_none(item, "reproduce", place),
        text=_field(item, "text", str, place, ""),
    )


def _row(row: Any, place: str) -> VerdictRow:
    return VerdictRow(
        requirement=_field(row, "requirement", str, place),
        outcome=_outcome(row, place),
        what=_field(row, "what", str, place, ""),
        measured_ns=_interval(row, "measured_ns", place),
        limits_ns=_pair(row, "limits_ns", place),
        text=_field(row, "text", str, place, ""),
        at=_int_or_none(row, "at", place),
        cause_at=_interval(row, "cause_at", place),
        effect_at=_interval(row, "effect_at", place),
    )


def _interval(row: Any, key: str, place: str) -> tuple[int, int] | None:
    pair = _pair(row, key, place)
    if pair is None:
        return None
    low, high = pair
    if low is None or high is None:
        raise _Wrong(f"{place}.{key}: both ends are needed")
    return low, high


_ENDS = (int, type(None))


def _pair(row: Any, key: str, place: str) -> tuple[int | None, int | None] | None:
    if not isinstance(row, dict) or row.get(key) is None:
        return None
    match _field(row, key, list, place):
        case [low, high] if type(low) in _ENDS and type(high) in _ENDS:
            return low, high
        case pair:
            raise _Wrong(f"{place}.{key}: {_shown(pair)} is no pair of whole numbers")
