"""Folders of runs for tests of the report: results and recordings as a run writes them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

from hil_tests.clock import MS
from hil_tests.reporting.pcapng import PcapngSink
from hil_tests.reporting.results import ResultsFile, TestResult, TraceFile, VerdictRow
from hil_tests.trace import BusEvent, EventKind, Mark, Moment, Sighting
from node_model.frame import Frame

HOSTILE = "</script></style><img src=x onerror=\"alert('pwned')\"> {{ 7*7 }} \u2028 ]]> & \"'`"
LATE = "EMCY 50xxh of node 1 after 701#00; measured 110 ms .. 112 ms; allowed at most 100 ms"
HEAD: Mapping[str, Any] = {
    "started": "2026-11-22T07:40:25+00:00",
    "command": ["--can-clause", "NMT-02"],
    "options": {"can_seed": {"value": 0, "source": "default"}},
    "versions": {"python": "3.11.7"},
    "bus": {"interface": "virtual time", "channel": "-", "bit_rate": 250_000, "timed": True},
    "device": {
        "kind": "virtual",
        "profile": {"name": "keypad", "kind": "keypad"},
        "node_id": 1,
        "mutant": None,
    },
    "clock": {"text": "virtual time, exact", "doubt_ns": 0},
    "seed": 0,
    "bench": {"name": "virtual", "facilities": ["power"]},
    "requirements": {
        name: {"text": f"{name} says so.", "class": "must", "source": "s", "clause": "c"}
        for name in ("NMT-02", "HB-01")
    },
}


def failed() -> VerdictRow:
    """An EMCY that came too late."""
    what = "EMCY 50xxh of node 1 after 701#00"
    measured, limits = (110 * MS, 112 * MS), (None, 100 * MS)
    ends = (49 * MS, 50 * MS), (160 * MS, 161 * MS)
    return VerdictRow("NMT-02", "failed", what, measured, limits, LATE, 165 * MS, *ends)


def passed(name: str = "NMT-02") -> VerdictRow:
    """A boot-up in time."""
    what = "boot-up of node 1 after power-on (regular start)"
    text = f"{what}; measured 48.999 ms .. 50 ms; allowed at most 1 s"
    measured, limits = (49 * MS - 1000, 50 * MS), (None, 1000 * MS)
    ends = (0, 1000), (49 * MS, 50 * MS)
    return VerdictRow(name, "passed", what, measured, limits, text, 60 * MS, *ends)


def result(number: int, *rows: VerdictRow, outcome: str = "passed", **more: Any) -> TestResult:
    """The result of a test whose recording `write_trace` may have written."""
    facts: dict[str, Any] = {
        "bus_ns": 300 * MS,
        "frames": 3,
        "requirements": ("NMT-02",),
        "trace": TraceFile(f"traces/t{number}.pcapng"),
        "reproduce": f"pytest test_start.py::test_{number}",
    }
    test = f"a/test_start.py::test_{number}"
    return TestResult(test, outcome, verdicts=rows, **facts | more)


def write_trace(path: Path, *rows: VerdictRow, doubt_ns: int = 0) -> Path:
    """A start: power, boot-up, EMCY, a command of the tester, an error frame, verdicts."""
    path.parent.mkdir(exist_ok=True)
    with PcapngSink(path, interface="vcan0", clock="test", flush=False) as sink:
        sink.write(Moment("power", 0, 1000, {"on": True, "mode": "regular", "held": []}))
        sink.write(Sighting(Frame(0x701, b"\x00"), 50 * MS, doubt_ns))
        sink.write(Sighting(Frame(0x081, bytes.fromhex("0050010000000000")), 161 * MS, doubt_ns))
        sink.write(Sighting(Frame(0x000, b"\x01\x01"), 170 * MS, doubt_ns, own=True))
        sink.write(BusEvent(EventKind.ERROR, 180 * MS, "stuff error"))
        sink.write(Moment("keys", 200 * MS, 200 * MS, {"held": ["k3"]}))
        sink.write(Sighting(Frame(0x181, b"\x04\x00"), 260 * MS, doubt_ns))
        for row in rows:
            sink.write(Mark(row.at or 0, row.text, {"outcome": row.outcome}))
    return path


def make_run(
    folder: Path,
    *results: TestResult,
    head: Mapping[str, Any] = HEAD,
    finish: bool = True,
    traces: bool = True,
) -> Path:
    """A folder of a run; `finish=False` leaves it as a killed run does."""
    (folder / "traces").mkdir(parents=True)
    with ResultsFile(folder / "results.json", head) as file:
        for each in results:
            file.add(each.to_json())
            if each.trace and traces:
                write_trace(folder / each.trace.path, *each.verdicts)
        if finish:
            file.finish({"exit_status": 1, "problems": []})
    return folder


class Page(HTMLParser):
    """What a browser without JavaScript would see: elements and texts."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.elements: list[tuple[str, dict[str, str | None]]] = []
        self.texts: list[str] = []
        self._inside = ""
        self.feed(text)
        self.close()

    def handle_starttag(self, tag: str, attrs: Sequence[tuple[str, str | None]]) -> None:
        """Keep an element."""
        self.elements.append((tag, dict(attrs)))
        self._inside = tag

    def handle_data(self, data: str) -> None:
        """Keep a text, unless it is for the browser."""
        if self._inside not in {"style", "script"}:
            self.texts.append(data)

    def handle_endtag(self, tag: str) -> None:
        """What follows stands outside."""
        self._inside = "" if tag == self._inside else self._inside

    @property
    def text(self) -> str:
        """All texts, blanks and line breaks as one blank."""
        return " ".join(" ".join(self.texts).split())

    def of(self, tag: str) -> list[dict[str, str | None]]:
        """The attributes of all elements with that name."""
        return [attributes for name, attributes in self.elements if name == tag]
