"""What the pages of a report show, as plain values; the templates only lay it out."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path

from markupsafe import Markup

from hil_tests.decode import decode
from hil_tests.reporting import journal
from hil_tests.reporting.html import narrative, sequence
from hil_tests.reporting.html.checks import Check, checks_of
from hil_tests.reporting.html.facts import fact
from hil_tests.reporting.html.narrative import Line
from hil_tests.reporting.html.recording import Kinds, Recording, read_recording
from hil_tests.reporting.results import COMPLETE
from hil_tests.reporting.results_reader import Results
from hil_tests.reporting.rows import PASSING, TestResult, TraceFile

ARGUED = frozenset(("failed", "error", "inconclusive", "observation"))
"""Outcomes of tests that are told at length."""

_ORPHAN = "The run ended before this test did: there is its recording, and no verdict."
_STEPS, _STEPS_ARGUED = 14, 120
_FRAMES = 6


@dataclass(slots=True)
class TestView:
    """One test.

    Args:
        number: 1, 2, 3... in the order of the run; names its page, `#t1`.
        result: as `results.json` has it.
        recording: None where none was kept or found.
        checks: its verdicts.
        lines: stimuli, sent frames, events and checks, the most telling ones.
        left_out: how many more there were.
        window: decoded frames round the finding, or the first ones.
        chart: message sequence chart of the window; "" where nothing is argued.
        origin_at: first instant of its recording, shown as 0.
        missing: why there is no recording, where there should be one.
    """

    __test__ = False

    number: int
    result: TestResult
    recording: Recording | None
    checks: list[Check]
    lines: list[Line] = field(default_factory=list)
    left_out: int = 0
    window: list[Line] = field(default_factory=list)
    chart: Markup = field(default_factory=Markup)
    origin_at: int = 0
    missing: str = ""
    data: str = ""
    """The bus for the timeline, see `embed`; "" = none."""

    @property
    def is_argued(self) -> bool:
        """Whether it is told at length."""
        return self.result.outcome in ARGUED

    @property
    def module(self) -> str:
        """The file, without folders and ending."""
        return self.result.test.partition("::")[0].rpartition("/")[2].removesuffix(".py")

    @property
    def name(self) -> str:
        """The test without its file."""
        return self.result.test.partition("::")[2] or self.result.test

    @property
    def finding(self) -> Check | None:
        """The check that decided, where it was not a pass."""
        bad = [each for each in self.checks if each.row.outcome not in PASSING]
        return min(bad, key=lambda check: _ORDER.index(check.row.outcome), default=None)


_ORDER = ("failed", "error", "inconclusive", "observation", "not run", "not applicable")


def views_of(folder: Path, results: Results, kind: str) -> list[TestView]:
    """Every test of a run, and at the end the recordings of tests that never ended.

    Args:
        folder: of the run.
        results: of the run.
        kind: of the device, see `decode`.
    """
    folder, kinds = folder.resolve(), Kinds(lambda frame: decode(frame, None, kind))
    return [
        _test_view(number, result, folder, kinds)
        for number, result in enumerate(_with_orphans(folder, results), 1)
    ]


def _with_orphans(folder: Path, results: Results) -> Iterator[TestResult]:
    """The results, and the recordings that none of them names: of tests that never ended."""
    yield from results.results
    known = {result.trace.path for result in results.results if result.trace}
    known.add(fact(results.run, "device", "identity", "trace"))
    broken_off = fact(results.under_way, "trace")
    for path in sorted((folder / "traces").glob("*.pcapng")):
        trace = path.relative_to(folder).as_posix()
        if trace not in known:
            test = fact(results.under_way, "test") if trace == broken_off else None
            yield TestResult(str(test or path.stem), "error", trace=TraceFile(trace), text=_ORPHAN)


def _test_view(number: int, result: TestResult, folder: Path, kinds: Kinds) -> TestView:
    recording, missing = _recording(folder, result, kinds)
    checks = checks_of(result.verdicts, recording)
    view = TestView(number, result, recording, checks, missing=missing)
    if recording is not None:
        _tell(view, recording)
    else:
        view.lines = [narrative.check_line(check) for check in checks[:_STEPS_ARGUED]]
        view.left_out = len(checks) - len(view.lines)
    return view


def _recording(folder: Path, result: TestResult, kinds: Kinds) -> tuple[Recording | None, str]:
    """The recording of a test, if it lies in the folder of its run."""
    if result.trace is None:
        return None, ""
    name = result.trace.path
    path = folder / name
    if not path.resolve().is_relative_to(folder):
        return None, f"{name}: not in the folder of this run"
    if not path.is_file():
        return None, f"{name}: the file is not there"
    recording = read_recording(path, kinds)
    return recording, recording.damage


def _tell(view: TestView, recording: Recording) -> None:
    """What happened, from its recording."""
    view.origin_at = _origin(recording)
    most = _STEPS_ARGUED if view.is_argued else _STEPS
    view.lines, view.left_out = narrative.steps(recording, view.checks, most)
    if not view.is_argued:
        count = min(len(recording), _FRAMES)
        view.window = [narrative.frame_line(recording, index) for index in range(count)]
        return
    finding = view.finding
    view.window = narrative.window(recording, finding.row.at if finding else None)
    line = narrative.check_line(finding) if finding else None
    view.chart = sequence.chart(view.window, view.origin_at, line)


def _origin(recording: Recording) -> int:
    stamps = [journal.stamp(note) for _, note in recording.notes[:1]]
    return min([*stamps, *recording.at[:1]], default=0)


@dataclass(frozen=True, slots=True)
class Verdict:
    """What the run says as a whole.

    Args:
        word: in one word or two.
        slug: class of its colour.
        text: one sentence.
    """

    word: str
    slug: str
    text: str


def verdict_of(results: Results, tests: Sequence[TestView]) -> Verdict:
    """PASSED only where something was judged and nothing speaks against it."""
    counts = Counter(test.result.outcome for test in tests)
    judged = counts["passed"] + counts["observation"] + counts["failed"]
    if counts["failed"]:
        word, slug, text = "Failed", "failed", _sentence(counts["failed"], "failed")
    elif results.state != COMPLETE:
        word, slug = "Interrupted", "error"
        text = f"The run did not come to its end; {judged} tests were judged before."
    elif counts["error"] or results.summary.get("problems"):
        word, slug = "Bench error", "error"
        text = "The bench or the suite broke; nothing of that is held against the device."
    elif counts["inconclusive"]:
        word, slug = "Inconclusive", "inconclusive"
        text = _sentence(counts["inconclusive"], "inconclusive")
    elif not judged:
        word, slug, text = "Nothing judged", "not-run", "No test judged the device."
    else:
        word, slug = "Passed", "passed"
        text = "Everything that was judged meets its requirement."
    return Verdict(word, slug, text)


def _sentence(count: int, word: str) -> str:
    return f"{count} test{'s' * (count > 1)} {word}."


@lru_cache(maxsize=64)
def slug(outcome: str) -> str:
    """An outcome as the name of a class in a style sheet."""
    return outcome.replace(" ", "-")
