"""What happened in a test, line by line: stimuli, frames, bus events and checks, in order."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from itertools import islice
from typing import NamedTuple

from hil_tests.clock import show_span
from hil_tests.reporting import journal
from hil_tests.reporting.html.checks import Check
from hil_tests.reporting.html.recording import Note, Recording
from hil_tests.reporting.html.stimuli import told
from hil_tests.reporting.rows import PASSING
from hil_tests.trace import Moment

STIMULUS, NOTE = "stimulus", "note"
SENT, SEEN, EVENT, CHECK = "sent", "seen", "event", "check"
_ACTS = frozenset(("power", "keys", "faults"))
"""What reaches the device by another way than the bus."""
_LAST = "end"
BEFORE, AFTER = 22, 4
"""Entries of a window before and after the instant that it is about."""


class Line(NamedTuple):
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


def frame_line(recording: Recording, index: int) -> Line:
    """A frame as a line."""
    number = recording.kind[index]
    own = number in recording.kinds.own
    text = recording.kinds.texts[number]
    return Line(SENT if own else SEEN, recording.at[index], text, recording.kinds.words(number))


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


def steps(recording: Recording, checks: Sequence[Check], most: int) -> tuple[list[Line], int]:
    """Stimuli, frames of the tester, bus events and checks, and how many were left out.

    Of many, those round the checks that deserve a look are kept, then the first ones.
    """
    all_of_it = _in_order(recording, checks, 4 * most)
    kept = all_of_it if len(all_of_it) <= most else _telling(all_of_it, most)
    return [_line(thing, recording) for thing in kept], len(all_of_it) - len(kept)


_Thing = int | Note | Check
"""What happened: index of a frame, a note, or a check."""


def _in_order(recording: Recording, checks: Sequence[Check], most_frames: int) -> list[_Thing]:
    """What happened; put into words is only what is shown of it."""
    frames = _first_own(recording, most_frames)
    things: list[_Thing] = [*frames]
    keys = [_order(recording.at[index]) for index in frames]
    for _, note in recording.notes:
        things.append(note)
        last = isinstance(note, Moment) and note.what == _LAST
        keys.append(_order(journal.stamp(note), _AT_LAST if last else 0))
    things += checks
    keys += [_order(check.row.at, _AFTER_ITS_CAUSE) for check in checks]
    return [things[place] for place in sorted(range(len(things)), key=keys.__getitem__)]


_AFTER_ITS_CAUSE, _AT_LAST = 1, 2


def _order(at: int | None, rank: int = 0) -> tuple[bool, int, int]:
    """By instant; a check follows what it was made of, and the end of a test all else."""
    return at is None, at or 0, rank


def _order_of(line: Line) -> tuple[bool, int, int]:
    rank = _AT_LAST if line.raw == _LAST else _AFTER_ITS_CAUSE if line.what == CHECK else 0
    return _order(line.at, rank)


def _line(thing: _Thing, recording: Recording) -> Line:
    if isinstance(thing, int):
        return frame_line(recording, thing)
    return check_line(thing) if isinstance(thing, Check) else note_line(thing)


def with_finding(lines: Sequence[Line], finding: Line | None) -> list[Line]:
    """Lines with a check among them, in its place."""
    return list(lines) if finding is None else sorted([*lines, finding], key=_order_of)


def _first_own(recording: Recording, most: int) -> list[int]:
    """Indices of the first frames that the tester sent."""
    own = recording.kinds.own
    found = (index for index, kind in enumerate(recording.kind) if kind in own)
    return list(islice(found, most))


def _telling(things: Sequence[_Thing], most: int) -> list[_Thing]:
    """What is shown where there is too much."""
    chosen: set[int] = set()
    for place, thing in enumerate(things):
        if isinstance(thing, Check) and thing.row.outcome not in PASSING:
            chosen.update(range(max(0, place - 8), min(len(things), place + 3)))
            if len(chosen) > most:
                break
    for place in range(len(things)):
        if len(chosen) >= most:
            break
        chosen.add(place)
    return [things[place] for place in sorted(chosen)]


def window(recording: Recording, at: int | None) -> list[Line]:
    """What stands around an instant; around the end, where none is known."""
    count = len(recording)
    index = count if at is None else bisect_right(recording.at, at)
    lines = [
        frame_line(recording, each)
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
