"""An RPDO: when what it carries takes effect (CiA 301 4.2.0, 7.2.2.2 and 7.5.2.35).

Laws: it lives in operational, while it is valid and maps something. With types 254 and 255
it takes effect at once, with 0 to 240 at the next SYNC, the last one received. One that is
too short never does and is an error; of one that is too long the first bytes count. With an
event time, none within it after another is an error.
"""

from __future__ import annotations

from collections.abc import Callable

from node_model.emcy import COMMUNICATION_ERROR
from node_model.node import NOTHING, Frames, earliest
from node_model.od import Entry, ObjectDictionary
from node_model.pdo.mapping import Direction, Mapping
from node_model.pdo.parameters import EVENTS, TIMER, PdoParameters
from node_model.service import ErrorHandler, Fault

TOO_SHORT = Fault(0x8210, COMMUNICATION_ERROR)
TIME_OUT = Fault(0x8250, COMMUNICATION_ERROR)

Apply = Callable[[list[tuple[Entry, bytes]], int], None]
"""Called with objects and their new values, and the instant at which they take effect."""


class Rpdo:
    """One RPDO.

    Args:
        od: has its parameters and what it maps.
        index: of its communication parameter, 1400h..15FFh.
        errors: is told of short and missing PDOs.
        apply: writes the values that have come.
    """

    parameters_type: Callable[..., PdoParameters] = PdoParameters

    def __init__(
        self, od: ObjectDictionary, index: int, errors: ErrorHandler, apply: Apply
    ) -> None:
        self.parameters = self.parameters_type(od, index, Direction.RECEIVE, self._written)
        self._errors = errors
        self._apply = apply
        self._operational = False
        self._mapping = Mapping()
        self._type = 0
        self._length_cause = f"length of RPDO {index - 0x1400 + 1}"
        self._time_cause = f"time-out of RPDO {index - 0x1400 + 1}"
        self._clear()

    def _clear(self) -> None:
        self.active = False
        self._pending: bytes | None = None
        self._lapse_at: int | None = None
        self._over_at: int | None = None

    # Its life.

    def begin(self) -> None:
        """Operational, or set up anew in it."""
        self._pending = self._lapse_at = None
        self._operational = True
        self._mapping = self.parameters.mapping()
        self._type = self.parameters.type()
        self.active = self.parameters.is_valid() and self._mapping.size > 0

    def end(self) -> None:
        """Not operational any more: what waits for a SYNC is dropped."""
        self._operational = False
        self._clear()

    # What happens to it.

    def on_data(self, data: bytes, window_open: bool, now: int) -> Frames:
        """It has come."""
        if not self.active or self.is_late(window_open):
            return NOTHING
        if self.is_short(data):
            return self._errors.occur(self._length_cause, TOO_SHORT, now)
        frames = self._heal(now)
        self._arm(now)
        self._take(data, now)
        return frames

    def on_sync(self, now: int) -> None:
        """What has come before takes effect."""
        data, self._pending = self._pending, None
        if data is not None:
            self._apply(self._mapping.unpack(data), now)

    def advance(self, now: int) -> Frames:
        """It is missing; or errors are over because it is watched no more."""
        frames: Frames = NOTHING
        if self._over_at is not None and self._over_at <= now:
            self._over_at = None
            frames = self._heal(now)
        if self._lapse_at is not None and self._lapse_at <= now:
            due, self._lapse_at = self._lapse_at, None
            frames = (*frames, *self._errors.occur(self._time_cause, TIME_OUT, due))
        return frames

    def deadline(self) -> int | None:
        """The end of its event time."""
        return self._lapse_at if self._over_at is None else earliest(self._lapse_at, self._over_at)

    # What decides.

    @property
    def lives(self) -> bool:
        """It can take effect, or has errors to take back."""
        return self.active or self._over_at is not None

    def is_synchronous(self) -> bool:
        """It waits for the next SYNC."""
        return self._type not in EVENTS

    def is_late(self, window_open: bool) -> bool:
        """A synchronous one does not count after the window has closed."""
        return self.is_synchronous() and not window_open

    def is_short(self, data: bytes) -> bool:
        """Fewer bytes than are mapped."""
        return len(data) < self._mapping.size

    # What it does.

    def _take(self, data: bytes, now: int) -> None:
        if self.is_synchronous():
            self._pending = data
        else:
            self._apply(self._mapping.unpack(data), now)

    def _arm(self, now: int) -> None:
        period = self.parameters.timer_ns()
        self._lapse_at = now + period if period else None

    def _heal(self, now: int) -> Frames:
        frames = self._errors.heal(self._length_cause, now)
        return (*frames, *self._errors.heal(self._time_cause, now))

    def _written(self, sub: int, now: int) -> None:
        """A client has written a parameter; the errors of the old setting are over."""
        if not self._operational:
            return
        if sub != TIMER:
            self.begin()
        elif self._lapse_at is not None:
            self._arm(now)
        self._over_at = now
