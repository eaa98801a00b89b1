"""A device whose program crashes: it stands still, dark and silent, until power is cut.

That is what becomes of a board; an error raised through the bench would be blamed on the bench.
A program that never comes to an end crashes as well: whoever watches its time raises `Spins`
in it, and a device that wants its turn for ever at one instant raises it itself.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from node_model.frame import Frame
from node_model.keypad import Keypad
from node_model.node import NOTHING, Frames

MARK = "<mutant>"
"""Stands before the name of a device's module, so that its code can be told in tracebacks."""

ENDLESS = 1000
"""A device that wants its turn so often at one instant, or before it, lets no time pass."""


class Spins(Exception):
    """Raised in a device whose program does not come to an end."""


class Crashes:
    """What devices died of: the first crash in a line, "" = none so far."""

    def __init__(self) -> None:
        self.first = ""

    def note(self, error: Exception) -> None:
        """Keep the first, with the function in which it came up."""
        if self.first:
            return
        place = "the making of it"
        trace = error.__traceback__
        while trace is not None:
            code = trace.tb_frame.f_code
            place = code.co_qualname if code.co_filename.startswith(MARK) else place
            trace = trace.tb_next
        what = "spins" if isinstance(error, Spins) else type(error).__name__
        self.first = f"{what} in {place}"


class Brick(Keypad):
    """A device that does not even start: its program crashes on the way there."""

    def power_on(self, now: int) -> Frames:  # noqa: ARG002  a verb of every node
        """Nothing comes of it."""
        self.powered = True
        return NOTHING


if TYPE_CHECKING:
    Base = Keypad
else:
    Base = object


class StandsStill(Base):
    """Stands before the class of a keypad: verbs and questions that survive a crash."""

    crashes: Crashes
    _crashed = False
    _turns = 0
    _latest = -1

    def power_on(self, now: int) -> Frames:
        """See Node."""
        return self._do(super().power_on, now)

    def power_off(self, now: int) -> Frames:
        """See Node."""
        frames = self._do(super().power_off, now)
        if self._crashed:  # whatever it was about to do, supply is gone
            self.powered = self._crashed = False
        return frames

    def receive(self, frame: Frame, now: int) -> Frames:
        """See Node."""
        return self._do(super().receive, frame, now)

    def hold(self, held: frozenset[str], now: int) -> Frames:
        """See Panel."""
        return self._do(super().hold, held, now)

    def fail(self, active: frozenset[str], now: int) -> Frames:
        """See Panel."""
        return self._do(super().fail, active, now)

    def advance(self, now: int) -> Frames:
        """See Node."""
        self._turns = self._turns + 1 if now <= self._latest else 0
        self._latest = max(now, self._latest)
        return self._do(super().advance if self._turns < ENDLESS else self._spin, now)

    def _spin(self, now: int) -> Frames:
        raise Spins(f"again and again at {now}")

    def deadline(self) -> int | None:
        """See Node."""
        due: int | None = self._ask(super().deadline, None)
        return due

    def lit(self, led: str, now: int) -> bool:
        """See Panel."""
        lit = super().lit
        return bool(self._ask(lambda: lit(led, now), no=False))

    def lamp_change(self, now: int) -> int | None:
        """See Panel."""
        change = super().lamp_change
        at: int | None = self._ask(lambda: change(now), None)
        return at

    def _do(self, verb: Callable[..., Frames], *args: Any) -> Frames:
        try:
            return verb(*args)
        except Exception as error:  # noqa: BLE001  whatever a wrong program raises
            self._stand(error)
            return NOTHING

    def _ask(self, question: Callable[[], Any], no: Any) -> Any:
        try:
            return question()
        except Exception as error:  # noqa: BLE001  whatever a wrong program raises
            self._stand(error)
            return no

    def _stand(self, error: Exception) -> None:
        self.crashes.note(error)
        self._crashed = True
        self._decide_at = self._mode = None
        self.bit_rate = 0
        self.listens_to = frozenset()
