"""What a run ends with on the terminal: what did not simply pass, how each group stands."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from typing import TYPE_CHECKING, Any

from hil_tests.clock import S, show_span
from hil_tests.reporting.tally import GRAVITY, Standing
from hil_tests.run import outcome
from hil_tests.run.terminal import one_line

if TYPE_CHECKING:
    from hil_tests.run.ledger import Ledger, Told

_HOUR = 3600 * S
_NAMED_TESTS = 4
_MOST_FAILURES = 20
"""With more the screen helps nobody; the report has them all."""


def sections(ledger: Ledger) -> Iterator[tuple[str, list[str]]]:
    """Titles and lines of what a run ends with."""
    for name in (outcome.NOT_RUN, outcome.NOT_APPLICABLE):
        lines = reason_lines([each for each in ledger.told if each.outcome == name])
        if lines:
            yield name, lines
    for name in (outcome.OBSERVATION, outcome.INCONCLUSIVE):
        told = [each for each in ledger.told if each.outcome == name]
        if told:
            yield name, [line for each in told for line in _told_lines(ledger, each)]
    if ledger.failures:
        yield outcome.FAILED, list(_failures(ledger))
    if ledger.broken:
        yield "bench broken", [ledger.broken]
    if ledger.problems:
        yield "problems of the bench", ledger.problems
    if ledger.standings:
        yield "requirements", group_lines(ledger.standings)
    yield "nodeproof", closing_lines(ledger)


def _told_lines(ledger: Ledger, told: Told) -> list[str]:
    """Which test, why, and where to look."""
    lines = [told.test, f"    {told.why}"]
    return [*lines, f"    trace: {ledger.folder.path / told.trace}"] if told.trace else lines


def reason_lines(told: Iterable[Told]) -> list[str]:
    """Tests that were not run, by reason."""
    by_reason: dict[str, list[str]] = {}
    for each in told:
        by_reason.setdefault(each.why, []).append(each.test.rpartition("::")[2])
    lines = []
    for reason, tests in sorted(by_reason.items()):
        more = len(tests) - _NAMED_TESTS
        shown = ", ".join(tests[:_NAMED_TESTS]) + (f" and {more} more" if more > 0 else "")
        lines.append(f"  {len(tests):3d}  {reason}")
        lines.append(f"       {shown}")
    return lines


# Failures.


def _failures(ledger: Ledger) -> Iterator[str]:
    for row in ledger.failures[:_MOST_FAILURES]:
        yield row["test"]
        yield from failure_lines(row, ledger)
    more = len(ledger.failures) - _MOST_FAILURES
    if more > 0:
        yield f"and {more} more; the report has them all"


def failure_lines(row: Mapping[str, Any], ledger: Ledger) -> Iterator[str]:
    """The five lines that matter: requirement, expected, measured, where to look, how to repeat.

    Args:
        row: of a test that failed, as results.json has it.
        ledger: knows the requirements and the folder.
    """
    failed = [each for each in row["verdicts"] if each["outcome"] == outcome.FAILED]
    verdict = failed[0] if failed else {}
    name = verdict.get("requirement") or next(iter(row["requirements"]), "")
    known = ledger.catalogue.get(name)
    text = f"{name} ({known['class']}; {known['clause']}): {known['text']}" if known else name
    yield f"    requirement: {one_line(text)}"
    expected, found = _compared(verdict) or (row["title"], verdict.get("what") or row["text"])
    yield f"    expected:    {one_line(expected or 'see above')}"
    yield f"    measured:    {one_line(found or 'see above')}"
    place = f", at {verdict['at'] / S:.6f} s" if verdict.get("at") is not None else ""
    trace = f"{ledger.folder.path / row['trace']}{place}" if row["trace"] else "none was kept"
    yield f"    trace:       {trace}"
    yield f"    repeat:      {row['reproduce']}"


def _compared(verdict: Mapping[str, Any]) -> tuple[str, str] | None:
    """What was expected of a span, and what was measured; None = no span was."""
    measured, limits = verdict.get("measured_ns"), verdict.get("limits_ns")
    if not measured or not limits:
        return None
    ends = [
        f"{word} {show_span(end)}"
        for word, end in zip(("at least", "at most"), limits, strict=True)
        if end is not None
    ]
    found = " .. ".join(dict.fromkeys(show_span(end) for end in measured))
    margin = verdict["margin"]
    beyond = f": {show_span(-margin['ns'])} beyond the limit" if margin else ""
    return f"{verdict['what']}; {', '.join(ends)}", f"{found}{beyond}"


# How the requirements stand.


def group_lines(standings: Mapping[str, Standing]) -> list[str]:
    """A line for each group of requirements: how they stand, and who came nearest to a limit."""
    groups: dict[str, dict[str, Standing]] = {}
    for name, standing in sorted(standings.items()):
        groups.setdefault(name.partition("-")[0], {})[name] = standing
    rows = [(group, _counts(found), _narrowest(found)) for group, found in groups.items()]
    widest = max(len(counts) for _, counts, _ in rows)
    return [
        f"  {group:5s}{counts:{widest}s}  {narrowest}".rstrip()
        for group, counts, narrowest in rows
    ]


def _counts(found: Mapping[str, Standing]) -> str:
    """How many requirements of a group have which outcome, the worst first."""
    counts = Counter(standing.outcome for standing in found.values())
    return ", ".join(f"{counts[name]} {name}" for name in GRAVITY if counts[name])


def _narrowest(found: Mapping[str, Standing]) -> str:
    """The requirement of a group that came nearest to a limit, as a share of what it allows."""
    shares = {
        name: standing.narrowest
        for name, standing in found.items()
        if standing.narrowest is not None
    }
    if not shares:
        return ""
    name = min(shares, key=lambda each: shares[each]["share"])
    worst = shares[name]
    room = f"{worst['share']:.1%} of the room left" if worst["share"] >= 0 else "beyond its limit"
    return f"narrowest: {name}, {room} ({worst['doubts']:g} times its doubt)"


# The last lines.


def closing_lines(ledger: Ledger) -> list[str]:
    """Verdict counts, bus hours, frames, stalls, and where to look."""
    counts = Counter(ledger.outcomes.values())
    shown = [f"{counts[name]} {name}" for name in outcome.REPORTED if counts[name]]
    account = ledger.account
    hours, frames = account.bus_ns / _HOUR, account.frames
    seen = f"{hours:.2f} bus hours, {frames} frames, {ledger.checks} checks"
    lines = [f"{', '.join(shown) or 'nothing was run'}; {seen}"]
    if account.stalls or account.late_frames:
        lines.append(
            f"the host was busy: the suite was stopped {account.stalls} times, the simulated"
            f" device {account.late_frames} times late (worst {show_span(account.host_late_ns)})"
        )
    lines += characteristic_lines(ledger)
    lines.append(f"results and traces: {ledger.folder.path}")
    return lines + ledger.papers


def characteristic_lines(ledger: Ledger) -> list[str]:
    """What the source leaves open, and how this device does it."""
    found = [
        f"  {name}: {text}"
        for name, standing in sorted(ledger.standings.items())
        for text in sorted(standing.characteristics)
    ]
    return ["characteristics of this device:", *found] if found else []
