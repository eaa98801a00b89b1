"""A small axis in the manner of CiA 402: control word, status word, a position that follows.

Laws: it moves while operation is enabled, from where it is straight to the target position,
at the speed of 2020h (increments a millisecond); so where it is follows from its inputs and
the time alone. An error stops it, and stays in the status word until the error is gone and
the control word acknowledges it with a rising bit 7.
"""

from __future__ import annotations

from collections.abc import Callable
from enum import IntEnum
from functools import partial

from node_model.drive.profile import Profile
from node_model.node import MS
from node_model.od import AbortCode, Entry, ObjectDictionary, SdoAbort
from node_model.od.dictionary import key_of

ERROR_CODE = 0x603F
MODE, MODE_DISPLAY = 0x6060, 0x6061
SPEED = 0x2020
MODES = frozenset({0, 1, 8})
"""No mode, profile position, cyclic synchronous position."""

ENABLE_VOLTAGE, SWITCH_ON, ENABLE = 0x02, 0x01, 0x08
QUICK_STOP, RESET_FAULT = 0x04, 0x80
"""Bits of the control word (CiA 402-2 4.0.0, 6.3); a cleared QUICK_STOP stops."""


class Power(IntEnum):
    """States of the power drive system, with their status word (bit 9: under bus control)."""

    DISABLED = 0x0240
    READY = 0x0231
    SWITCHED_ON = 0x0233
    ENABLED = 0x0237
    FAULT = 0x0218


def commanded(state: Power, control: int) -> Power:
    """The state that a control word leads to, one step at a time up, at once down."""
    if not control & ENABLE_VOLTAGE or not control & QUICK_STOP:
        return Power.DISABLED
    if not control & SWITCH_ON:
        return Power.READY
    if state is Power.DISABLED:
        return state
    if state is Power.READY or not control & ENABLE:
        return Power.SWITCHED_ON
    return Power.ENABLED


Told = Callable[[int, int, int], None]
"""Called with index, sub-index and instant after the axis has changed an object."""


class Axis:
    """The application of a drive.

    Args:
        profile: where its objects are.
        told: is told of each object that the axis changes.
    """

    def __init__(self, profile: Profile, told: Told) -> None:
        self._od = ObjectDictionary(())
        self._actual: Entry | None = None
        self._seen = b""
        """Value of the actual position that is right while it stands still."""
        self._profile = profile
        self._told = told
        self.state = Power.DISABLED
        self.codes: dict[str, int] = {}
        self._control = 0
        self._from = 0
        self._since = 0

    def attach(self, od: ObjectDictionary) -> None:
        """Work on these objects."""
        self._od = od
        self._actual = od.entries.get(key_of(*self._profile.actual))
        od.guard(MODE, self._guard_mode)
        for index in (self._profile.control[0], self._profile.set_point[0], MODE, SPEED):
            od.observe(index, partial(self.written, index))

    def reset(self, now: int) -> None:
        """As after power-on: disabled, where its objects say."""
        self.codes.clear()
        self.state = Power.DISABLED
        self._control = self._od.number(*self._profile.control)
        self._from, self._since = self._od.number(*self._profile.actual), now

    # What happens to it.

    def written(self, index: int, sub: int, now: int) -> None:
        """A client or an RPDO has written an object."""
        if (index, sub) == self._profile.control:
            self.control(self._od.number(index, sub), now)
        elif (index, sub) == self._profile.set_point or index == SPEED:
            self.start_from(now)
        elif index == MODE:
            self._change((MODE_DISPLAY, 0), self._od.number(MODE), now)

    def control(self, word: int, now: int) -> None:
        """A control word."""
        rising, self._control = word & ~self._control, word
        if self.state is not Power.FAULT:
            self._go(commanded(self.state, word), now)
        elif rising & RESET_FAULT and not self.codes:
            self._change((ERROR_CODE, 0), 0, now)
            self._go(Power.DISABLED, now)

    def fail(self, name: str, code: int, now: int) -> None:
        """An error comes: it stops."""
        self.codes[name] = code
        self._change((ERROR_CODE, 0), code, now)
        self._go(Power.FAULT, now)

    def heal(self, name: str) -> None:
        """An error goes; the fault is still to be acknowledged."""
        del self.codes[name]

    # Motion.

    def update(self, now: int) -> None:
        """The actual position as it is now."""
        actual = self._actual
        if actual is None or (self.state is not Power.ENABLED and actual.value is self._seen):
            return
        position = self.position(now)
        if position != self._od.number(*self._profile.actual):
            self._change(self._profile.actual, position, now)
        self._seen = actual.value

    def position(self, now: int) -> int:
        """Where it is."""
        if self.state is not Power.ENABLED:
            return self._from
        way = self._od.number(*self._profile.set_point) - self._from
        most = self._od.number(SPEED, 0, 1000) * (now - self._since) // MS
        return self._from + max(-most, min(most, way))

    def start_from(self, now: int) -> None:
        """A new way begins where the actual position is."""
        self._from, self._since = self._od.number(*self._profile.actual), now

    def _go(self, state: Power, now: int) -> None:
        if state is self.state:
            return
        self.start_from(now)
        self.state = state
        self._change(self._profile.status, state, now)

    def _change(self, place: tuple[int, int], value: int, now: int) -> None:
        if self._od.has(*place) and self._od.number(*place) != value:
            self._od.put_number(*place, value)
            self._told(*place, now)

    def _guard_mode(self, sub: int, data: bytes) -> None:  # noqa: ARG002  a VAR
        if data[0] not in MODES:
            raise SdoAbort(AbortCode.VALUE)
