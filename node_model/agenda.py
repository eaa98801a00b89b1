"""Who of a row of services is due when, and who hears which identifier.

Laws: `due` is the earliest deadline of all, and `heard` what all listen to, as if each were
asked at every call. They are asked only when their answer can be another one: a service that
is `alone` after its own work; after a client's write those that the object is of concern to;
all of them when somebody says so (`stir`).
"""

from __future__ import annotations

from collections.abc import Callable

from node_model.frame import Frame
from node_model.node import NOTHING, Frames
from node_model.service import QuietService, Service

NEVER = 1 << 62
"""An instant that does not come."""

Places = tuple[int, ...]
"""Of services in the row."""

Receive = Callable[[Frame, int], Frames]
Listener = tuple[int, Receive]
"""Place in the row, and its verb."""


def has_deadlines(service: Service) -> bool:
    """Whether a service may ever be due by itself."""
    return type(service).deadline is not QuietService.deadline


class Agenda:
    """The services of a device that takes part.

    Args:
        row: in the order in which they act at one instant.
    """

    def __init__(self, row: tuple[Service, ...] = ()) -> None:
        self.row = row
        self.alone = [service.alone for service in row]
        self._deadlines = [service.deadline for service in row]
        self._timed = [place for place, service in enumerate(row) if has_deadlines(service)]
        self._advances = [service.advance for service in row]
        self._dues = [NEVER] * len(row)
        self.due = NEVER
        """When the next one wants to act."""
        self._stirred = bool(row)
        self.moved = True
        """Something was said since it was settled."""
        self._concerned: dict[int, tuple[Places, Places]] = {}
        """Who is timed and who is set up by an object, for those that were written."""
        self._undated: set[int] = set()
        """Places of those that may be due at another instant now."""
        self._unasked = set(range(len(row)))
        """Places of those that may listen to something else now."""
        self._heard_by: list[frozenset[int]] = [frozenset()] * len(row)
        self.listeners: dict[int, tuple[Listener, ...]] = {}
        """Who gets a frame, by identifier."""
        self.heard = frozenset[int]()
        """All identifiers that anybody listens to."""

    # What has happened.

    def stir(self) -> None:
        """Any of them may be due at another instant now."""
        self._stirred = self.moved = True

    def write(self, index: int) -> None:
        """A client has written an object."""
        concerned = self._concerned.get(index)
        if concerned is None:
            row = list(enumerate(self.row))
            timed = tuple(place for place, service in row if index in service.timed_by)
            set_up = tuple(place for place, service in row if index in service.set_up_by)
            concerned = self._concerned[index] = timed, set_up
        timed, set_up = concerned
        if timed:
            self._undated.update(timed)
            self.moved = True
        if set_up:
            self._unasked.update(set_up)
            self.moved = True

    def acted(self, place: int) -> None:
        """The service there was told something, or was due."""
        if not self.alone[place]:
            self._stirred = self.moved = True
            return
        due = self._deadlines[place]()
        dues = self._dues
        if due is None:
            due = NEVER
        if due != dues[place]:
            dues[place] = due
            self.due = min(dues)
            self.moved = True

    # What follows.

    def settle(self) -> bool:
        """Ask whoever may have another answer; whether `heard` is another one now."""
        self.moved = False
        if self._stirred or self._undated:
            places = self._timed if self._stirred else sorted(self._undated)
            self._stirred = False
            self._undated.clear()
            dues, deadlines = self._dues, self._deadlines
            for place in places:
                due = deadlines[place]()
                dues[place] = NEVER if due is None else due
            self.due = min(dues, default=NEVER)
        return bool(self._unasked) and self._ask_what_they_hear()

    def _ask_what_they_hear(self) -> bool:
        heard_by, news = self._heard_by, False
        for place in self._unasked:
            heard = self.row[place].listens_to()
            if heard != heard_by[place]:
                heard_by[place] = heard
                news = True
        self._unasked.clear()
        if news:
            self._route()
        return news

    def _route(self) -> None:
        listeners: dict[int, tuple[Listener, ...]] = {}
        for place, heard in enumerate(self._heard_by):
            listener = (place, self.row[place].receive)
            for can_id in heard:
                listeners[can_id] = (*listeners.get(can_id, ()), listener)
        self.listeners = listeners
        self.heard = frozenset(listeners)

    def act(self, now: int) -> Frames:
        """What is due at `now`, which is `due`."""
        dues = self._dues
        if dues.count(now) == 1:
            place = dues.index(now)
            frames = self._advances[place](now)
            self.acted(place)
            return frames
        frames = NOTHING
        for place in [place for place, due in enumerate(dues) if due == now]:
            frames = (*frames, *self._advances[place](now))
            self.acted(place)
        return frames
