"""The history of devices: an index over the runs of a reports folder, by serial number.

The runs are the truth; the index, an SQLite file beside them, is made from them and can be thrown
away. A run that was changed or is new is read again, one that is gone is forgotten.
"""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator, Sequence
from contextlib import closing
from dataclasses import asdict
from pathlib import Path
from typing import Any

from hil_tests.reporting.files import RecordUnreadable
from hil_tests.reporting.plotting import COLOURS, ShareAxis, document, element, legend, titled
from hil_tests.reporting.results_reader import RESULTS
from hil_tests.reporting.summary import Stand, Summary, show_share, summary_of

INDEX = "history.sqlite"
_VERSION = 1
_RUN_FIELDS = (
    "name", "started", "device", "serial", "firmware", "profile", "mutant", "bench", "state",
    "exit_status",
)  # fmt: skip
_TABLES = f"""
CREATE TABLE run ({", ".join(_RUN_FIELDS)}, stamp TEXT, PRIMARY KEY (name));
CREATE TABLE stand (run TEXT REFERENCES run(name), requirement, outcome, share, doubts, what);
CREATE INDEX by_serial ON run (serial, started);
CREATE INDEX by_run ON stand (run);
PRAGMA user_version = {_VERSION};
"""
_MOST_LINES = 8
_WIDTH, _HEIGHT = 900, 420


class History:
    """The runs of a folder, and what is told of them.

    Args:
        reports: the folder; its index is brought up to date.
        rebuild: forget the index first.

    Raises:
        RecordUnreadable: there is no such folder, or it cannot be written to.
    """

    def __init__(self, reports: Path, *, rebuild: bool = False) -> None:
        if not reports.is_dir():
            raise RecordUnreadable(f"{reports}: no such folder; name one with --reports DIR")
        self._reports = reports
        self._index = reports / INDEX
        self.unreadable: list[str] = []
        """Runs that could not be read, one sentence each."""
        try:
            if rebuild:
                self._index.unlink(missing_ok=True)
            with closing(self._open()) as base, base:
                self._update(base)
        except (OSError, sqlite3.Error) as error:
            raise RecordUnreadable(
                f"index {self._index}: {error}; --rebuild makes it anew"
            ) from error

    def _open(self) -> sqlite3.Connection:
        base = sqlite3.connect(self._index, timeout=30)
        version = base.execute("PRAGMA user_version").fetchone()[0]
        if version != _VERSION:
            for name in ("stand", "run"):
                base.execute(f"DROP TABLE IF EXISTS {name}")
            base.executescript(_TABLES)
        return base

    def _update(self, base: sqlite3.Connection) -> None:
        known = dict(base.execute("SELECT name, stamp FROM run"))
        found = {path.parent.name: path for path in self._files()}
        for name in known.keys() - found.keys():
            _forget(base, name)
        for name, path in found.items():
            stamp = _stamp(path)
            if known.get(name) == stamp:
                continue
            _forget(base, name)
            try:
                _remember(base, summary_of(path), stamp)
            except RecordUnreadable as error:
                self.unreadable.append(str(error))

    def _files(self) -> Iterator[Path]:
        """The results of every run; `latest` is a second name of one."""
        for path in sorted(self._reports.glob(f"*/{RESULTS}")):
            if not path.parent.is_symlink():
                yield path

    def serials(self) -> list[tuple[str, int, str]]:
        """Serial number, how many runs, and when the last one began; "" = not told."""
        query = "SELECT serial, COUNT(*), MAX(started) FROM run GROUP BY serial ORDER BY serial"
        with closing(self._open()) as base:
            return [(str(serial), count, last) for serial, count, last in base.execute(query)]

    def runs(self, serial: str | None) -> list[Summary]:
        """The runs of a device, the oldest first; None = of every device."""
        fields = ", ".join(_RUN_FIELDS)
        query = f"SELECT {fields} FROM run WHERE ? IS NULL OR serial = ? ORDER BY started"  # noqa: S608
        with closing(self._open()) as base:
            rows = base.execute(query, (serial, serial)).fetchall()
            return [
                Summary(**dict(zip(_RUN_FIELDS, row, strict=True)), stands=_stands(base, row[0]))
                for row in rows
            ]


def _stamp(path: Path) -> str:
    facts = path.stat()
    return f"{facts.st_size} {facts.st_mtime_ns}"


def _forget(base: sqlite3.Connection, name: str) -> None:
    base.execute("DELETE FROM stand WHERE run = ?", (name,))
    base.execute("DELETE FROM run WHERE name = ?", (name,))


def _remember(base: sqlite3.Connection, run: Summary, stamp: str) -> None:
    values = [getattr(run, field) for field in _RUN_FIELDS]
    marks = ", ".join("?" * (len(values) + 1))
    base.execute(f"INSERT INTO run VALUES ({marks})", [*values, stamp])  # noqa: S608
    base.executemany(
        "INSERT INTO stand VALUES (?, ?, ?, ?, ?, ?)",
        [
            (run.name, name, each.outcome, each.share, each.doubts, each.what)
            for name, each in run.stands.items()
        ],
    )


def _stands(base: sqlite3.Connection, run: str) -> dict[str, Stand]:
    query = "SELECT requirement, outcome, share, doubts, what FROM stand WHERE run = ?"
    return {name: Stand(*rest) for name, *rest in base.execute(query, (run,))}


# What is shown.


def narrowest(runs: Sequence[Summary], prefixes: Sequence[str] = ()) -> list[str]:
    """The requirements whose margins were the narrowest in any of the runs, these first.

    Args:
        runs: of a device.
        prefixes: only ids that begin so; none = the few that matter most.
    """
    least: dict[str, float] = {}
    for run in runs:
        for name, stand in run.stands.items():
            if stand.share is not None:
                least[name] = min(stand.share, least.get(name, stand.share))
    chosen = sorted(least, key=lambda name: (least[name], name))
    if prefixes:
        return [name for name in chosen if name.startswith(tuple(map(str.upper, prefixes)))]
    return chosen[:_MOST_LINES]


def table(runs: Sequence[Summary], names: Sequence[str]) -> list[str]:
    """A line for each run: when, what was tested, how it ended, and the room left."""
    head = ["started", "serial", "firmware", "bench", "ended", "worst", *names]
    rows = [head]
    for run in runs:
        failed = [name for name, stand in run.stands.items() if stand.outcome == "failed"]
        ended = str(run.exit_status) if run.state == "complete" else run.state
        who = run.serial + (f" MUTANT {run.mutant}" if run.mutant else "")
        cells = [run.started[:19], who, run.firmware, run.bench, ended]
        cells.append(f"{len(failed)} failed" if failed else "none failed")
        rows.append([*cells, *(show_share(run.stands.get(name)) for name in names)])
    widths = [max(len(row[place]) for row in rows) for place in range(len(head))]
    return [
        "  ".join(f"{cell:{width}}" for cell, width in zip(row, widths, strict=True)).rstrip()
        for row in rows
    ]


def to_json(runs: Sequence[Summary]) -> list[dict[str, Any]]:
    """The runs as plain data."""
    return [asdict(run) for run in runs]


def plot(runs: Sequence[Summary], names: Sequence[str], title: str) -> str:
    """A line for each requirement: the room that was left, run after run."""
    top = 50
    bottom = top + _HEIGHT
    height = bottom + 60 + 18 * len(names)
    axis = ShareAxis(float(bottom), float(top))
    parts = [element("text", title, x=20, y=28, font_size=16)]
    for y, text, class_ in axis.ticks():
        parts.append(element("line", x1=70, x2=_WIDTH - 20, y1=y, y2=y, class_=class_))
        parts.append(element("text", text, x=60, y=y + 4.0, text_anchor="end", class_="dim"))
    step = (_WIDTH - 160) / max(len(runs) - 1, 1)
    places = [90 + step * place for place in range(len(runs))]
    for name, colour in zip(names, _colours(), strict=False):
        parts += _line(name, colour, runs, places, axis)
    for run, x in list(zip(runs, places, strict=True))[:: max(len(runs) // 8, 1)]:
        under = " ".join(filter(None, [run.started[:10], run.firmware]))
        parts.append(element("text", under, x=x, y=bottom + 20, text_anchor="middle"))
    parts += legend(names, 90.0, bottom + 50.0)
    return document(_WIDTH, height, title, parts)


def _colours() -> Iterator[str]:
    while True:
        yield from COLOURS


def _line(
    name: str, colour: str, runs: Sequence[Summary], places: Sequence[float], axis: ShareAxis
) -> list[str]:
    """Dots and the line through them; a run that measured nothing leaves it open."""
    parts, points = [], []
    for run, x in zip(runs, places, strict=True):
        stand = run.stands.get(name)
        if stand is None or stand.share is None:
            continue
        y = axis.at(stand.share)
        points.append(f"{x:.1f},{y:.1f}")
        dot = element("circle", cx=x, cy=y, r=4, fill=colour)
        parts.append(titled(dot, f"{name}: {show_share(stand)}, {stand.outcome}; {run.label}"))
    path = element("polyline", points=" ".join(points), fill="none", stroke=colour)
    return [path, *parts]
