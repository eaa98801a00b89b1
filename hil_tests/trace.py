"""The record of a run: an append-only sequence of what was seen and what was done.

Laws: nothing is ever changed or removed; every entry has its place in the order in which
it became known; a frame costs at most 40 bytes of memory; what is written to disk is
written as it comes (a sink gets each entry at once).
"""

from __future__ import annotations

from array import array
from bisect import bisect_left
from collections import Counter
from collections.abc import Container, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum
from functools import lru_cache
from typing import NamedTuple, Protocol

from hil_tests.clock import Interval, named
from node_model.frame import Frame

OWN = 1 << 40
"""Set in the packed head of a frame that the tester sent itself."""

_MOST_DOUBT = (1 << 32) - 1
"""A stamp that is four seconds off or more is kept as that: it decides nothing anyway."""


class Sighting(NamedTuple):
    """A frame seen on the bus. It ended between `at - doubt_ns` and `at`."""

    frame: Frame
    at: int
    doubt_ns: int = 0
    own: bool = False
    """Sent by the tester itself."""


_NO_DETAIL: Mapping[str, object] = {}


class Moment(NamedTuple):
    """Something that the bench did to the device: it took effect somewhere in an interval.

    `what` is a verb: "power", "keys", "bitrate", "leds" and whatever else `bench.chronicle`
    lists; `detail` is plain data that describes it completely, so that a recording can be
    judged again.
    """

    what: str
    began_at: int
    ended_at: int
    detail: Mapping[str, object] = _NO_DETAIL

    @property
    def when(self) -> Interval:
        """The interval in which it took effect."""
        return named(Interval, (self.began_at, self.ended_at))


class Burst:
    """Frames seen one after the other in virtual time, their instants exact, nothing between.

    `own` holds the places, rising, of those that the tester sent itself. `over` says that
    nothing more comes by the instant up to which they were asked for.
    """

    __slots__ = ("frames", "instants", "over", "own")

    def __init__(self) -> None:
        self.frames: list[Frame] = []
        self.instants: list[int] = []
        self.own: list[int] = []
        self.over = False

    def __len__(self) -> int:
        return len(self.frames)

    def pop(self) -> Sighting:
        """Take the last one out of it."""
        place = len(self.frames) - 1
        own = self.own[-1:] == [place]
        if own:
            self.own.pop()
        return Sighting(self.frames.pop(), self.instants.pop(), own=own)

    def sightings(self) -> list[Sighting]:
        """Each of them."""
        found = [
            named(Sighting, (frame, at, 0, False))
            for frame, at in zip(self.frames, self.instants, strict=True)
        ]
        for place in self.own:
            found[place] = named(Sighting, (self.frames[place], self.instants[place], 0, True))
        return found


class Columns(NamedTuple):
    """Frames one after the other, nothing between, as a trace keeps them.

    Args:
        heads: `Frame.head` of each; `OWN` is set where the tester sent it itself.
        bodies: `Frame.body` of each.
        instants: ns.
        doubts: ns, below 2**32.
    """

    heads: array[int]
    bodies: array[int]
    instants: array[int]
    doubts: array[int]

    def sightings(self) -> Iterator[Sighting]:
        """Each of them."""
        for head, body, at, doubt_ns in zip(*self, strict=True):
            yield named(Sighting, (_unpacked(head & OWN - 1, body), at, doubt_ns, head >= OWN))


class EventKind(Enum):
    """What a port can tell of the bus besides frames."""

    ERROR = "error frame"
    BUS_OFF = "bus off"
    OVERFLOW = "receive overflow"
    GAP = "frames lost"
    FD_FRAME = "CAN FD frame"
    DOWN = "interface down"
    STALL = "host stalled"


@dataclass(frozen=True, slots=True)
class BusEvent:
    """Something that happened on the bus or to its reader.

    `lost` counts the frames that a GAP or OVERFLOW cost (0 = not known).
    """

    kind: EventKind
    at: int
    text: str = ""
    lost: int = 0


@dataclass(frozen=True, slots=True)
class Mark:
    """A note of the judge at an instant of the trace, e.g. a verdict."""

    at: int
    text: str
    data: Mapping[str, object] = field(default_factory=dict)


Entry = Sighting | Moment | BusEvent


class Wanted(NamedTuple):
    """Which frames of a trace are worth reading; our own always are.

    Args:
        ids: identifiers (an extended one with bit 29 set).
        zeros_of: of the frames with this identifier only those whose data are all zero.
    """

    ids: Container[int]
    zeros_of: int = -1


_IDENTIFIER = (1 << 30) - 1


class Sink(Protocol):
    """Where a trace is written as it comes; see reporting for the pcapng one."""

    def write(self, entry: Entry | Mark) -> None:
        """Store one entry; after this call a killed process has not lost it."""

    def write_all(self, columns: Columns) -> None:
        """As `write`, of each frame in these columns."""


@lru_cache(maxsize=4096)  # most frames of a trace stand in it many times
def _unpacked(head: int, body: int) -> Frame:
    """The frame with that head and body."""
    size = 0 if head >> 30 & 1 else min(head >> 32 & 0xF, 8)
    return Frame.unpack(head, body.to_bytes(8, "big")[8 - size :])


class Trace:
    """Append-only record; frames in packed columns, the rest as objects in between."""

    __slots__ = ("_at", "_body", "_doubt", "_head", "_others", "_places", "_sinks")

    def __init__(self, *sinks: Sink) -> None:
        self._at = array("q")
        self._doubt = array("I")
        self._head = array("q")
        self._body = array("Q")
        self._others: list[Moment | BusEvent] = []
        self._places = array("q")
        self._sinks = sinks

    def __len__(self) -> int:
        """How many frames it holds."""
        return len(self._at)

    @property
    def sinks(self) -> tuple[Sink, ...]:
        """Where it is written."""
        return self._sinks

    def see(self, sighting: Sighting) -> int:
        """Append a frame; returns its index among the frames."""
        frame, at, doubt_ns, own = sighting
        self._at.append(at)
        self._doubt.append(doubt_ns if doubt_ns < _MOST_DOUBT else _MOST_DOUBT)
        self._head.append(frame.head | OWN if own else frame.head)
        self._body.append(frame.body)
        for sink in self._sinks:
            sink.write(sighting)
        return len(self._at) - 1

    def see_all(self, burst: Burst) -> int:
        """Append the frames of a burst; returns the index of the first."""
        frames = burst.frames
        heads = array("q", [frame.head for frame in frames])
        for place in burst.own:
            heads[place] |= OWN
        bodies = array("Q", [frame.body for frame in frames])
        doubts = array("I", bytes(self._doubt.itemsize * len(frames)))
        return self.extend(Columns(heads, bodies, array("q", burst.instants), doubts))

    def extend(self, columns: Columns) -> int:
        """Append frames; returns the index of the first."""
        first = len(self._at)
        heads, bodies, instants, doubts = columns
        self._head += heads
        self._body += bodies
        self._at += instants
        self._doubt += doubts
        for sink in self._sinks:
            sink.write_all(columns)
        return first

    def note(self, entry: Moment | BusEvent) -> None:
        """Append a stimulus or a bus event."""
        self._others.append(entry)
        self._places.append(len(self._at))
        for sink in self._sinks:
            sink.write(entry)

    def remark(self, mark: Mark) -> None:
        """A note of the judge goes to the sinks, in its place; the record itself is without."""
        for sink in self._sinks:
            sink.write(mark)

    def frame(self, index: int) -> Sighting:
        """The frame with that index (negative ones count from the end)."""
        head = self._head[index]
        frame = _unpacked(head & OWN - 1, self._body[index])
        return named(Sighting, (frame, self._at[index], self._doubt[index], head >= OWN))

    def is_own(self, index: int) -> bool:
        """Whether the tester sent that frame itself."""
        return self._head[index] >= OWN

    def frames(self, start: int = 0, stop: int | None = None) -> Iterator[Sighting]:
        """The frames from index `start` up to, not including, `stop`."""
        for index in range(*slice(start, stop).indices(len(self))):
            yield self.frame(index)

    def others(self, start: int = 0) -> Iterator[tuple[int, Frame]]:
        """The frames of others than the tester from index `start`, each after its index."""
        body = self._body
        for index, head in enumerate(self._head[start:], start):
            if head < OWN:
                yield index, _unpacked(head, body[index])

    def bits(self, start: int = 0, stop: int | None = None) -> int:
        """How many bit times the frames from index `start` up to `stop` took on the wire."""
        many = Counter(zip(self._head[start:stop], self._body[start:stop], strict=True))
        return sum(
            _unpacked(head & OWN - 1, body).bits * count for (head, body), count in many.items()
        )

    def hears_others(self) -> bool:
        """Whether it holds a frame of another station than the tester."""
        return any(head < OWN for head in self._head)

    def moments(self) -> Iterator[Moment]:
        """The stimuli, in order."""
        return (entry for entry in self._others if isinstance(entry, Moment))

    def events(self) -> Iterator[BusEvent]:
        """The bus events, in order."""
        return (entry for entry in self._others if isinstance(entry, BusEvent))

    def mark(self) -> tuple[int, int]:
        """The present place, to read on from with `entries`."""
        return len(self._at), len(self._others)

    def entries(self, start: int = 0, skip: int | None = None) -> Iterator[Entry]:
        """Everything in the order in which it became known.

        Args:
            start: index of the first frame.
            skip: how many of the other entries came before; None = all those that became
                known before the frame `start - 1`.
        """
        for entry in self.places(start, skip):
            yield self.frame(entry) if isinstance(entry, int) else entry

    def places(
        self, start: int, skip: int | None, wanted: Wanted | None = None
    ) -> Iterator[int | Moment | BusEvent]:
        """As `entries`, but of the frames only the wanted ones, and of those their index.

        Args:
            start: index of the first frame.
            skip: as of `entries`.
            wanted: these; None = all.
        """
        first = bisect_left(self._places, start) if skip is None else skip
        others = zip(self._places[first:], self._others[first:], strict=True)
        index = start
        for place, other in others:
            yield from self._wanted(index, place, wanted)
            index = max(index, place)
            yield other
        yield from self._wanted(index, len(self), wanted)

    def _wanted(self, start: int, stop: int, wanted: Wanted | None) -> Sequence[int]:
        if wanted is None:
            return range(start, stop)
        (ids, zeros_of), bodies = wanted, self._body
        return [
            index
            for index, head in enumerate(self._head[start:stop], start)
            if head >= OWN
            or (
                (can_id := head & _IDENTIFIER) in ids
                and not (can_id == zeros_of and bodies[index])
            )
        ]

    def index_at(self, instant: int) -> int:
        """Index of the first frame whose stamp is `instant` or later.

        Stamps of one port rise, so a binary search finds it; on a port whose stamps may
        step back the answer is a place to start looking.
        """
        low, high = 0, len(self)
        while low < high:
            middle = (low + high) // 2
            if self._at[middle] < instant:
                low = middle + 1
            else:
                high = middle
        return low

    @property
    def bytes_used(self) -> int:
        """Memory of the packed columns, in bytes."""
        columns = (self._at, self._doubt, self._head, self._body)
        return sum(column.buffer_info()[1] * column.itemsize for column in columns)
