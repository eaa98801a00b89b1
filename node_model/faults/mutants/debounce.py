"""Faults of the debouncing (requirements KEY-04..06)."""

from __future__ import annotations

from node_model.debounce import Debouncer
from node_model.faults.link import Delay
from node_model.faults.mutants.keys import is_key_frame
from node_model.faults.parts import Fault
from node_model.frame import Frame
from node_model.keypad.operation import Operation
from node_model.keypad.parameters import DEBOUNCE_STEP_NS
from node_model.node import MS

# The time.


class DebounceTooShort(Operation, Fault):
    """The debounce time is 11 ms too short."""

    violates = ("KEY-05", "KEY-04", "COM-10")

    def debounce_ns(self) -> int:
        """Just past the scan of 10 ms."""
        return max(super().debounce_ns() - 11 * MS, 0)


class LongDebounceTooShort(Operation, Fault):
    """Debounce times above the shortest are 11 ms too short."""

    violates = ("KEY-05", "KEY-04", "COM-10")

    def debounce_ns(self) -> int:
        """Right for 0 and 1, which is what most boards are set to."""
        right_ns = super().debounce_ns()
        return right_ns - 11 * MS if right_ns > DEBOUNCE_STEP_NS else right_ns


class DebounceTooLong(Operation, Fault):
    """The debounce time is 31 ms too long."""

    violates = ("KEY-05", "COM-10", "COM-23")

    def debounce_ns(self) -> int:
        """Just past the scan of 10 ms and the 20 ms for the frame."""
        return super().debounce_ns() + 31 * MS


class KeyFrameLate(Delay, Fault):
    """Key frames are sent 31 ms after the change was taken."""

    violates = ("KEY-05", "KEY-07", "COM-23")
    span_ns = 31 * MS

    def picks(self, frame: Frame) -> bool:
        """Key frames only."""
        return is_key_frame(frame)


# The filter.


class _PressesAtOnce(Debouncer):
    """A filter for releases only."""

    def edge(self, raw: int, now: int) -> None:
        pressed = raw & ~self.raw
        super().edge(raw, now)
        for bit in [bit for bit in self._mature_at if bit & pressed]:
            self._mature_at[bit] = now
        self.due_at = min(self._mature_at.values(), default=None)


class PressesNotDebounced(Operation, Fault):
    """A press counts at once; only releases are debounced."""

    violates = ("KEY-04", "KEY-05", "KEY-02", "COM-10")
    debouncer_type = _PressesAtOnce


class _ReleasesAtOnce(Debouncer):
    """A filter for presses only."""

    def edge(self, raw: int, now: int) -> None:
        released = self.raw & ~raw
        super().edge(raw, now)
        for bit in [bit for bit in self._mature_at if bit & released]:
            self._mature_at[bit] = now
        self.due_at = min(self._mature_at.values(), default=None)


class ReleasesNotDebounced(Operation, Fault):
    """A release counts at once; only presses are debounced."""

    violates = ("KEY-04", "KEY-05", "COM-10")
    debouncer_type = _ReleasesAtOnce


class _FirstEdge(Debouncer):
    """A timer that an edge back does not stop."""

    def edge(self, raw: int, now: int) -> None:
        started = dict(self._mature_at)
        super().edge(raw, now)
        self._mature_at.update(started)
        self.due_at = min(self._mature_at.values(), default=None)


class ShortPulseCounts(Operation, Fault):
    """A press or release counts after the debounce time, however short it was."""

    violates = ("KEY-04", "KEY-05", "KEY-06", "KEY-20")
    debouncer_type = _FirstEdge


class _Adding(Debouncer):
    """A timer that an edge back only halts."""

    def __init__(self, time_ns: int, raw: int = 0) -> None:
        super().__init__(time_ns, raw)
        self._left: dict[int, int] = {}

    def edge(self, raw: int, now: int) -> None:
        before = dict(self._mature_at)
        super().edge(raw, now)
        self._left.update({b: at - now for b, at in before.items() if b not in self._mature_at})
        for bit in [bit for bit in self._mature_at if bit not in before]:
            self._mature_at[bit] = now + self._left.pop(bit, self.time_ns)
        self.due_at = min(self._mature_at.values(), default=None)


class ShortPulsesAddUp(Operation, Fault):
    """Several short pulses of a key together count once they make up the debounce time."""

    violates = ("KEY-04", "KEY-05", "KEY-20")
    debouncer_type = _Adding


class _OneTimer(Debouncer):
    """One timer for all keys, started anew by each edge."""

    def edge(self, raw: int, now: int) -> None:
        super().edge(raw, now)
        self._mature_at = dict.fromkeys(self._mature_at, now + self.time_ns)
        self.due_at = min(self._mature_at.values(), default=None)


class KeysDebouncedTogether(Operation, Fault):
    """Any edge restarts the debounce time of every pending key."""

    violates = ("KEY-06", "KEY-05", "KEY-02", "KEY-20")
    debouncer_type = _OneTimer


class _SharedTimer(Debouncer):
    """A key that moves while another is pending shares the other's timer."""

    def edge(self, raw: int, now: int) -> None:
        running = self.due_at
        super().edge(raw, now)
        if running is not None:
            self._mature_at = dict.fromkeys(self._mature_at, running)
            self.due_at = min(self._mature_at.values(), default=None)


class SecondKeyRidesAlong(Operation, Fault):
    """A key that moves while another one is being debounced counts together with it."""

    violates = ("KEY-06", "KEY-05", "KEY-04")
    debouncer_type = _SharedTimer


FAULTS: tuple[type[Fault], ...] = (
    DebounceTooShort,
    LongDebounceTooShort,
    DebounceTooLong,
    KeyFrameLate,
    PressesNotDebounced,
    ReleasesNotDebounced,
    ShortPulseCounts,
    ShortPulsesAddUp,
    KeysDebouncedTogether,
    SecondKeyRidesAlong,
)
