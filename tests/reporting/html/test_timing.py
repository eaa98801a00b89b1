"""Plots of measured times: where the values come from, and what is drawn."""

from __future__ import annotations

import re
from pathlib import Path

from hil_tests.clock import MS
from hil_tests.reporting.html import plots, timing
from hil_tests.reporting.html.timing import Series
from hil_tests.reporting.html.view import views_of
from hil_tests.reporting.pcapng import PcapngSink
from hil_tests.reporting.results_reader import load_results
from hil_tests.reporting.rows import VerdictRow
from hil_tests.trace import Entry, Moment, Sighting
from node_model.frame import Frame
from tests.reporting.html.making import make_run, result

LIMITS = (95 * MS, 105 * MS)
JUDGED = VerdictRow(
    "HB-01", "passed", "heartbeat of node 1: 9 intervals", (100 * MS, 101 * MS), LIMITS
)


OF_ANOTHER = VerdictRow(
    "HB-01", "passed", "heartbeat of node 1: 9 intervals", (20 * MS, 21 * MS), (19 * MS, 22 * MS)
)


def periods(
    folder: Path, *entries: Entry, rows: tuple[VerdictRow, ...] = (JUDGED,)
) -> list[Series]:
    """Periods that are read off a recording."""
    run = make_run(folder, result(1, *rows))
    with PcapngSink(
        run / "traces" / "t1.pcapng", interface="vcan0", clock="test", flush=False
    ) as sink:
        for entry in entries:
            sink.write(entry)
    return timing.periods(views_of(run, load_results(run / "results.json"), "keypad"))


def beat(at: int, doubt_ns: int = 0) -> Sighting:
    """A heartbeat."""
    return Sighting(Frame(0x701, b"\x05"), at, doubt_ns)


def test_periods_are_read_with_their_doubt(tmp_path: Path) -> None:
    """Each distance of two heartbeats is an interval as wide as the doubt of its stamps."""
    (series,) = periods(tmp_path / "run", *(beat(n * 100 * MS, 1000 + n) for n in range(7)))
    assert series.limits == LIMITS
    assert series.values[0] == (100 * MS - 1001, 100 * MS + 1000)
    assert len(series.values) == 6
    assert series.doubt_ns == 1005 + 1006


def test_periods_end_where_something_was_done(tmp_path: Path) -> None:
    """Across a stimulus, a frame of the tester or a change of state there is no period."""
    entries: list[Entry] = [beat(n * 100 * MS) for n in range(4)]
    entries += [Moment("keys", 310 * MS, 310 * MS, {"held": []}), beat(400 * MS), beat(500 * MS)]
    entries += [Sighting(Frame(0, b"\x01\x01"), 510 * MS, 0, own=True), beat(600 * MS)]
    entries += [Sighting(Frame(0x701, b"\x04"), 700 * MS), beat(900 * MS), beat(1000 * MS)]
    (series,) = periods(tmp_path / "run", *entries)
    assert len(series.values) == 3 + 1 + 1


def test_a_recording_of_several_periods_is_not_held_against_one(tmp_path: Path) -> None:
    """Two pairs of limits in a test: no beat is drawn; the same pair twice is one."""
    beats = [beat(n * 100 * MS) for n in range(7)]
    assert periods(tmp_path / "two", *beats, rows=(JUDGED, OF_ANOTHER)) == []
    (series,) = periods(tmp_path / "one", *beats, rows=(JUDGED, JUDGED))
    assert len(series.values) == 6


def test_too_few_values_are_not_drawn(tmp_path: Path) -> None:
    """Four periods are no distribution."""
    assert periods(tmp_path / "run", *(beat(n * 100 * MS) for n in range(5))) == []


def test_answers_are_gathered_by_requirement_and_limits(tmp_path: Path) -> None:
    """What came nearest to its limit stands first; single cases lose their numbers."""
    rows = [
        VerdictRow(name, "passed", f"key frame of node {n} after 18{n}#0{n}", (lo, lo + 1), limits)
        for n in range(5)
        for name, lo, limits in (
            ("KEY-01", 10 * MS, (None, 100 * MS)),
            ("KEY-02", 10 * MS, (None, 11 * MS)),
        )
    ]
    run = make_run(tmp_path / "run", result(1, *rows))
    views = views_of(run, load_results(run / "results.json"), "keypad")
    found = timing.answers(views)
    assert [series.name for series in found] == [
        "KEY-02: key frame of node … after …",
        "KEY-01: key frame of node … after …",
    ]


def test_plots_show_limits_guard_bands_and_numbers() -> None:
    """Each plot has its two limits, a guard band as wide as the doubt, and says its numbers."""
    values = [(98 * MS + n * 100, 98 * MS + n * 100 + MS) for n in range(1000)]
    series = Series("period", LIMITS, values)
    for plot in (plots.histogram(series), plots.run_chart(series), plots.distribution(series)):
        assert plot.count('class="limit"') == 2
        assert plot.count('class="guard"') == 2
        assert "1000 values from 98 ms to 99.1 ms" in plot
        assert not re.search(r"nan|inf|None", plot)


def test_plots_survive_values_that_are_all_alike() -> None:
    """One value without doubt, on its limit, with the other side open."""
    series = Series("answer", (None, 5), [(5, 5)] * 6)
    for plot in (plots.histogram(series), plots.run_chart(series), plots.distribution(series)):
        assert plot.startswith("<svg")


def test_names_in_plots_are_escaped() -> None:
    """Markup in what was judged is text."""
    series = Series("<script>", LIMITS, [(96 * MS, 97 * MS)] * 6)
    assert "<script>" not in plots.distribution(series)
