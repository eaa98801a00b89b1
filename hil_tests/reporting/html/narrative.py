"""What happened in a test, line by line: stimuli, frames, bus events and checks, in order."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import islice

from hil_tests.clock import show_span
from hil_tests.reporting import journal
from hil_tests.reporting.html.checks import Check
from hil_tests.reporting.html.recording import Note, Recording
from hil_tests.reporting.html.stimuli import told
from hil_tests.trace import Moment
from node_model.frame import Frame

Decode = Callable[[Frame], str]

STIMULUS, NOTE = "stimulus", "note"
SENT, SEEN, EVENT, CHECK = "sent", "seen", "event", "check"
_ACTS = frozenset(("power", "keys", "faults"))
"""What reaches the device by another way than the bus."""
_LAST = "end"
BEFORE, AFTER = 22, 4
"""Entries of a window before and after the instant that it is about."""


@dataclass(frozen=True, slots=True)
class Line:
    """One thing that happened.

    Args:
        what: "stimulus", "note" (of the bench), "sent" (by the tester), "seen" (of another
            station), "event" or "check".
        at: instant, ns; None = not known.
        raw: the frame as it is written, or the kind of a stimulus or event.
        text: in words.
        outcome: of a check.
        until: end of the interval in which a stimulus took effect.
    """

    what: str
    at: int | None
    raw: str
    text: str
    outcome: str = ""
    until: int | None = None


def frame_line(recording: Recording, index: int, decode: Decode) -> Line:
    """A frame as a line."""
    number = recording.kind[index]
    frame, _, own = recording.kinds.all[number]
    text = recording.kinds.texts[number]
    return Line(SENT if own else SEEN, recording.at[index], text, decode(frame))


def note_line(note: Note) -> Line:
    """A stimulus or a bus event as a line."""
    if isinstance(note, Moment):
        what = STIMULUS if note.what in _ACTS else NOTE
        return Line(what, note.began_at, note.what, told(note), until=note.ended_at)
    return Line(EVENT, note.at, note.kind.value, journal.describe(note))


def check_line(check: Check) -> Line:
    """A check as a line."""
    row = check.row
    return Line(CHECK, row.at, row.requirement, row.text or row.what, row.outcome)


def steps(
    recording: Recording, checks: Sequence[Check], decode: Decode, most: int
) -> tuple[list[Line], int]:
    """Stimuli, frames of the tester, bus events and checks, and how many were left out.

    Of many, those round the checks that deserve a look are kept, then the first ones.
    """
    lines = [frame_line(recording, index, decode) for index in _first_own(recording, 4 * most)]
    lines += [note_line(note) for _, note in recording.notes]
    lines += [check_line(check) for check in checks]
    lines.sort(key=_order)
    if len(lines) <= most:
        return lines, 0
    kept = _telling(lines, most)
    return [lines[place] for place in kept], len(lines) - len(kept)


def _order(line: Line) -> tuple[bool, int, int]:
    """By instant; a check follows what it was made of, and the end of a test all else."""
    return line.at is None, line.at or 0, 2 if line.raw == _LAST else line.what == CHECK


def with_finding(lines: Sequence[Line], finding: Line | None) -> list[Line]:
    """Lines with a check among them, in its place."""
    return list(lines) if finding is None else sorted([*lines, finding], key=_order)


def _first_own(recording: Recording, most: int) -> list[int]:
    """Indices of the first frames that the tester sent."""
    own = recording.kinds.own
    found = (index for index, kind in enumerate(recording.kind) if kind in own)
    return list(islice(found, most))


def _telling(lines: Sequence[Line], most: int) -> list[int]:
    """Places of the lines that are shown where there are too many."""
    chosen: set[int] = set()
    for place, line in enumerate(lines):
        if line.what == CHECK and line.outcome not in {"passed", "characteristic"}:
            chosen.update(range(max(0, place - 8), min(len(lines), place + 3)))
            if len(chosen) > most:
                break
    for place in range(len(lines)):
        if len(chosen) >= most:
            break
        chosen.add(place)
    return sorted(chosen)


def window(recording: Recording, at: int | None, decode: Decode) -> list[Line]:
    """What stands around an instant; around the end, where none is known."""
    count = len(recording)
    index = count if at is None else bisect_right(recording.at, at)
    lines = [
        frame_line(recording, each, decode)
        for each in range(max(0, index - BEFORE), min(count, index + AFTER))
    ]
    since = lines[0].at if lines and index > BEFORE else None
    until = lines[-1].at if lines and index + AFTER < count else None
    for _, note in recording.notes:
        if _within(note, since, until):
            lines.append(note_line(note))
    lines.sort(key=lambda line: line.at or 0)
    place = len(lines) if at is None else sum((line.at or 0) <= at for line in lines)
    return lines[max(0, place - BEFORE) : place + AFTER]


def _within(note: Note, since: int | None, until: int | None) -> bool:
    at = journal.stamp(note)
    return (since is None or at >= since) and (until is None or at <= until)


def show_at(at: int | None, origin_at: int) -> str:
    """An instant for people, in seconds from an origin, to the microsecond."""
    if at is None:
        return ""
    span_ns = at - origin_at
    whole, rest = divmod(abs(span_ns), 1_000_000_000)
    sign = "−" if span_ns < 0 else ""
    return f"{sign}{whole}.{rest // 1000:06d}"


def plain(lines: Sequence[Line], origin_at: int) -> str:
    """Lines as one text in columns."""
    rows = [
        (show_at(line.at, origin_at), "->" if line.what == SENT else "<-", line.raw, line.text)
        for line in lines
    ]
    widths = [max((len(row[n]) for row in rows), default=0) for n in range(3)]
    return "\n".join(
        f"{at:>{widths[0]}}  {way}  {raw:<{widths[2]}}  {text}" for at, way, raw, text in rows
    )


def within_text(line: Line) -> str:
    """By how much the instant of a stimulus is in doubt; "" = exact."""
    if line.until is None or line.at is None or line.until == line.at:
        return ""
    return f"within {show_span(line.until - line.at)}"
