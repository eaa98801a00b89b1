"""A record, read as time goes on: what the bus says, and whether the test does what was done.

Laws: entries come in the order of the record, each once; a frame of the tester's own comes
only after the test has asked for it; time never goes past a stimulus that the test has not
yet given. Where the test asks for something else than what was recorded, no verdict can rest
on the record any more: a `Departure` says what was asked and what is there.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterator, Mapping

from hil_tests.bench.chronicle import CLOCK
from hil_tests.clock import MS, show_span
from hil_tests.errors import FrameNotCarried
from hil_tests.judge.verdict import NotRun
from hil_tests.replay.record import TestRecord
from hil_tests.trace import Burst, BusEvent, Entry, EventKind, Moment, Sighting
from node_model.frame import Frame

SLACK_NS = 20 * MS
"""In real time the clock was read a little later than a frame says; in virtual time never."""

ASKED_NS = 200 * MS
"""A host of a model that is asked for its lateness answers within this."""

_PASSIVE = frozenset(("wait", "late", CLOCK))
"""What a record says of time and of the host: nothing that a test does."""


class Departure(NotRun):
    """The test does what was not done when it was recorded."""


class Source:
    """The place in a record up to which it was told.

    Args:
        record: of one test.
        virtual: it was recorded in virtual time, where every instant is exact.
    """

    def __init__(self, record: TestRecord, *, virtual: bool) -> None:
        self.now = record.opening.ended_at
        self._record = record
        self._entries = record.entries
        self._slack_ns = 0 if virtual else SLACK_NS
        self._later_ns = 0 if virtual else 1
        """Who reads the clock of a real bus after a frame reads a later instant than its stamp."""
        self._place = 0
        self._done: set[int] = set()
        """Places of notes that were passed over before their turn."""
        self._notes = [
            place for place, entry in enumerate(self._entries) if isinstance(entry, Moment)
        ]
        self._sent: list[Frame] = []
        self._late: list[tuple[int, int]] = []
        self._awaits = False
        self._over = False
        """The test is over: what is left was read while it was looked at for the last time."""

    # What the bus says.

    def send(self, frame: Frame) -> None:
        """The test queues a frame.

        Raises:
            FrameNotCarried: the adapter had no way to send it.
        """
        found = self._stimulus()
        if found is not None:
            place, moment = found
            if moment.what == "refused" and moment.detail.get("frame") == str(frame):
                self._done.add(place)
                raise FrameNotCarried(f"{frame}: the adapter of the recording cannot send it")
        self._sent.append(frame)

    def next(self, until: int) -> Sighting | BusEvent | None:
        """What happened on the bus by `until`.

        Raises:
            Departure: the test waits on where the recorded one did something.
        """
        until = max(until, self.now)
        while True:
            entry = self._peek()
            if entry is None:
                self._idle(until, self._record.ends_at, self._ending())
                return None
            if isinstance(entry, Moment):
                if self._pass(entry, until):
                    continue
                self._stop(entry, until)
                return None
            if isinstance(entry, BusEvent) and entry.kind is EventKind.STALL:
                self._place += 1  # the bench tells of stalls itself
                continue
            if entry.at > until and not self._over and not self._overslept(until):
                self.now = until
                return None
            if isinstance(entry, Sighting) and entry.own:
                if entry.frame not in self._sent:
                    self._idle(until, entry.at, self._unsent(entry))
                    return None
                self._sent.remove(entry.frame)
            self._place += 1
            if not self._over:
                self.now = max(self.now, entry.at + self._later_ns)
            return entry

    def burst(self, until: int, most: int) -> Burst:
        """Frames up to `until`, to a note or an event, or to one that the test never sent."""
        burst, entries = Burst(), self._entries
        place = self._place
        last = min(len(entries), place + most)
        while place < last:
            entry = entries[place]
            if not isinstance(entry, Sighting) or entry.at > until:
                break
            if entry.own and entry.frame not in self._sent:
                break
            if entry.own:
                self._sent.remove(entry.frame)
                burst.own.append(len(burst))
            burst.frames.append(entry.frame)
            burst.instants.append(entry.at)
            place += 1
        self._place = place
        if len(burst):
            self.now = max(self.now, burst.instants[-1])
        return burst

    def _peek(self) -> Entry | None:
        while self._place in self._done:
            self._place += 1
        return self._entries[self._place] if self._place < len(self._entries) else None

    def _pass(self, note: Moment, until: int) -> bool:
        """Go past a note that is no stimulus; False where the note stands in the way."""
        if note.what == "late":
            self._hear(note)
        elif note.what == "wait":
            if until < note.began_at - self._slack_ns or self._is_that(note, until):
                return False
        elif note.what == CLOCK:
            if until <= note.began_at and not self._over:
                return False
        elif not _is_passive(note):
            return False
        self._place += 1
        return True

    def _stop(self, note: Moment, until: int) -> None:
        """A wait comes to a note: its own end, or something that the test has yet to do."""
        if note.what == "wait" and self._is_that(note, until):
            self._place += 1
            self.now = max(self.now, note.ended_at)
        elif note.what in _PASSIVE:
            self.now = until
        elif not self._awaits:
            self._idle(until, note.began_at, f"the record has {words(note)}")

    def _is_that(self, note: Moment, until: int) -> bool:
        """Whether a wait until then is the one that ended late in the record."""
        return note.began_at - self._slack_ns <= until <= note.ended_at + self._slack_ns

    def _overslept(self, until: int) -> bool:
        """Whether this wait ended late in the record, so that it heard more than it should."""
        note = next((note for _, note in self._ahead() if note.what != CLOCK), None)
        return note is not None and note.what == "wait" and self._is_that(note, until)

    def _idle(self, until: int, most: int, there: str) -> None:
        """Nothing comes; time goes on until then, as far as the record knows.

        Raises:
            Departure: it knows only up to `most`.
        """
        if until > max(most, self.now) + self._slack_ns:
            raise self._departure(f"the test waits on for {show_span(until - most)}", most, there)
        self.now = max(self.now, until)

    def _departure(self, asked: str, at: int, there: str) -> Departure:
        since = show_span(at - self._record.opening.began_at)
        return Departure(
            f"the recording cannot show this: {asked}; {since} after its beginning {there}"
        )

    def _ending(self) -> str:
        return "the record ends" if self._record.end else "the record breaks off"

    def _unsent(self, entry: Sighting) -> str:
        asked = f" (asked for now: {', '.join(map(str, self._sent))})" if self._sent else ""
        return f"the record has {entry.frame} sent by the tester{asked}"

    # What the test does.

    def _stimulus(self) -> tuple[int, Moment] | None:
        """The next thing that was done, and its place."""
        return next((found for found in self._ahead() if not _is_passive(found[1])), None)

    def _ahead(self) -> Iterator[tuple[int, Moment]]:
        """The notes that are still to come, each with its place."""
        for index in range(bisect_left(self._notes, self._place), len(self._notes)):
            place = self._notes[index]
            note = self._entries[place]
            if place not in self._done and isinstance(note, Moment):
                yield place, note

    def await_that(self, what: str, detail: Mapping[str, object], asked: str) -> Moment | None:
        """Something that takes time: its note in the record; None = more must be read first.

        Args:
            what: verb of the note.
            detail: what must stand in it.
            asked: what the test does, for people.

        Raises:
            Departure: something else was done.
        """
        _, moment = self._expected(what, detail, asked)
        self._awaits = True
        entry = self._peek()
        while isinstance(entry, Moment) and entry is not moment:
            if entry.what == "late":
                self._hear(entry)
            self._place += 1
            entry = self._peek()
        if entry is not moment:
            return None
        self._awaits = False
        self._place += 1
        self.now = max(self.now, moment.ended_at)
        return moment

    def do(self, what: str, detail: Mapping[str, object], asked: str) -> Moment:
        """Something that is done at once: its note in the record.

        Raises:
            Departure: something else was done.
        """
        place, moment = self._expected(what, detail, asked)
        self._done.add(place)
        return moment

    def renew(self, detail: Mapping[str, object], asked: str) -> None:
        """Another device is there from now on; nothing of the old one counts any more.

        Raises:
            Departure: something else was done.
        """
        place, moment = self._expected("renew", {**detail, "fresh": True}, asked)
        self._place = place + 1
        self._sent.clear()
        self.now = max(self.now, moment.ended_at)

    def _expected(self, what: str, detail: Mapping[str, object], asked: str) -> tuple[int, Moment]:
        found = self._stimulus()
        if found is None:
            raise self._departure(asked, self._record.ends_at, self._ending())
        moment = found[1]
        fits = all(moment.detail.get(key) == value for key, value in detail.items())
        if moment.what != what or not fits:
            raise self._departure(asked, moment.began_at, f"the record has {words(moment)}")
        return found

    # What the clock showed, and what the host of a model said of itself.

    def told(self) -> int:
        """The test reads the clock: what it showed then, as far as the record knows."""
        for place in range(self._place, len(self._entries)):
            note = self._entries[place]
            if not isinstance(note, Moment):
                break
            if place in self._done or (note.what == "renew" and _is_passive(note)):
                continue
            if note.what == CLOCK:
                self._done.add(place)
                self.now = max(self.now, note.ended_at)
            break
        return self.now

    def lateness(self) -> list[tuple[int, int]]:
        """What was told since the last call, up to now: pairs of due and sent."""
        for place, note in self._ahead():
            if note.began_at > self.now + ASKED_NS or not _is_passive(note):
                break
            if note.what == "late":
                self._hear(note)
                self._done.add(place)
                if note.began_at <= self.now + self._slack_ns:
                    self.now = max(self.now, note.ended_at)  # so long it took to ask
        told, self._late = self._late, []
        return told

    def _hear(self, note: Moment) -> None:
        pairs = note.detail.get("pairs")
        for pair in pairs if isinstance(pairs, list) else ():
            match pair:
                case [int(due), int(sent)]:
                    self._late.append((due, sent))
                case _:
                    pass  # a record of somebody else's making

    def wind_up(self) -> None:
        """The test is over: time goes to where the record ends, if nothing was left to do."""
        if self._stimulus() is None and self._record.end is not None:
            self._over = True
            self.now = max(self.now, self._record.ends_at)


def _is_passive(note: Moment) -> bool:
    """Whether it says nothing that a test does; what the device is set to follows from that."""
    return note.what in _PASSIVE or (note.what == "renew" and not note.detail.get("fresh"))


def words(moment: Moment) -> str:
    """A stimulus of a record, for people."""
    detail = moment.detail
    if moment.what == "power":
        return f"power {'on' if detail.get('on') else 'off'}"
    if moment.what == "keys":
        held = detail.get("held")
        return (
            f"keys held: {', '.join(map(str, held)) or 'none'}" if isinstance(held, list) else ""
        )
    if moment.what == "faults":
        active = detail.get("active")
        names = ", ".join(map(str, active)) if isinstance(active, list) else ""
        return f"errors: {names or 'none'}"
    if moment.what == "bitrate":
        return f"bit rate {detail.get('bit_rate')}"
    if moment.what == "renew":
        return f"a fresh device with {detail.get('parameters')}"
    return {"leds": "LEDs read", "lights": "LEDs watched"}.get(moment.what, moment.what)
