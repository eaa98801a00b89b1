"""The record of one test, as its trace holds it: everything that it takes to judge it again."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hil_tests.bench.chronicle import CLOCK
from hil_tests.reporting.files import RecordUnreadable
from hil_tests.reporting.pcapng import read_pcapng
from hil_tests.trace import BusEvent, Entry, EventKind, Mark, Moment


@dataclass(frozen=True, slots=True)
class TestRecord:
    """One trace.

    Args:
        path: of the file.
        opening: how the bench stood when the test began, and what was tested.
        entries: frames, events, stimuli and actions in between; and what the clock showed
            when the test read it, as moments, too.
        end: when nobody looked any more, and what came of it; None = it breaks off.
        marks: expectations and verdicts.
    """

    __test__ = False  # pytest would take it for a test class

    path: Path
    opening: Moment
    entries: tuple[Entry, ...]
    end: Moment | None
    marks: tuple[Mark, ...]

    @property
    def test(self) -> str:
        """Node id of the test."""
        return str(self.opening.detail["test"])

    @property
    def ends_at(self) -> int:
        """The last instant that it tells of."""
        if self.end is not None:
            return self.end.ended_at
        last = self.entries[-1] if self.entries else self.opening
        return last.ended_at if isinstance(last, Moment) else last.at

    def fact(self, name: str, kind: type, path: str = "") -> Any:
        """A fact of its beginning.

        Args:
            name: e.g. "bit_rate".
            kind: what it must be.
            path: the object that it stands in, e.g. "port"; "" = none.

        Raises:
            RecordUnreadable: it is missing, or of another kind.
        """
        facts: Any = self.opening.detail.get(path) if path else self.opening.detail
        value = facts.get(name) if isinstance(facts, dict) else None
        if not isinstance(value, kind):
            where = f"{path}.{name}" if path else name
            raise RecordUnreadable(
                f"recording {self.path}: its beginning says {str(value)[:40]!r} for {where}, which"
                f" is no {kind.__name__}"
            )
        return value


def load_record(path: Path) -> TestRecord:
    """The record in a trace.

    Raises:
        RecordUnreadable: no trace of a test of ours, or damage in it.
    """
    entries: list[Entry] = []
    marks: list[Mark] = []
    opening: Moment | None = None
    end: Moment | None = None
    for entry in read_pcapng(path):
        if isinstance(entry, Mark):
            if entry.data.get("kind") == CLOCK:
                entries.append(Moment(CLOCK, entry.at, entry.at))
            else:
                marks.append(entry)
        elif isinstance(entry, Moment) and entry.what == "begin":
            opening = opening or entry
        elif isinstance(entry, Moment) and entry.what == "end":
            end = entry
        else:
            entries.append(entry)
    if opening is None or not isinstance(opening.detail.get("test"), str):
        raise RecordUnreadable(
            f"recording {path}: it does not begin as a trace of a test does; it can be judged"
            " without its stimuli: nodeproof replay FILE --node-id N"
        )
    if end is None and entries and _breaks_off(entries[-1]):
        entries.pop()  # a word of the reader, not of the bus
    return TestRecord(path, opening, tuple(entries), end, tuple(marks))


def _breaks_off(entry: Entry) -> bool:
    return (
        isinstance(entry, BusEvent)
        and entry.kind is EventKind.GAP
        and entry.text.startswith("the recording breaks off")
    )
