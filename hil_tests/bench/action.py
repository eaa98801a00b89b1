"""An action that takes time: started, then awaited in the loop that also reads the bus.

A driver never blocks and never sleeps. It hands out an `Action`; the bench starts it and
polls it between frames, so that no frame waits unread while an operator thinks.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol, TypeVar

from hil_tests.clock import Interval

Result_co = TypeVar("Result_co", covariant=True)


class Action(Protocol[Result_co]):
    """Something that was asked of the bench and will be done in a while.

    All instants are on the clock of the bench's port.
    """

    @property
    def descriptors(self) -> Sequence[int]:
        """File descriptors whose becoming readable is a reason to poll (may be empty)."""

    @property
    def wake_at(self) -> int:
        """Poll again at this instant at the latest; the action's own time-out included."""

    def start(self, now: int) -> None:
        """Begin; called once."""

    def poll(self, now: int) -> bool:
        """Go on as far as possible without waiting; True when the result is there.

        Raises:
            BenchError: the peer closed, lied, stalled, or the operator did not answer.
        """

    def result(self) -> Result_co:
        """What came of it; only after `poll` said True."""


@dataclass(frozen=True, slots=True)
class LedEdges:
    """Every change of light that the bench saw in a stretch of time."""

    watched: Interval
    start: Mapping[str, bool]
    edges: Sequence[tuple[Interval, str, bool]]
    """When (with doubt), which LED, on or off; in order of time."""


class PowerDriver(Protocol):
    """Switches the supply of the device."""

    def switch(self, on: bool) -> Action[Interval]:
        """Supply on or off; the result is the interval in which it happened."""


class KeysDriver(Protocol):
    """Moves the keys of the device."""

    timed_sequences: bool
    """It can play a timed sequence by itself."""

    def hold(self, held: frozenset[str]) -> Action[Interval]:
        """From now on exactly these keys are held."""

    def sequence(self, steps: Sequence[tuple[int, frozenset[str]]]) -> Action[Sequence[Interval]]:
        """Sets of held keys at spans in ns from the first; one interval a step."""


class FaultsDriver(Protocol):
    """Raises errors in the device and heals them."""

    def fail(self, active: frozenset[str]) -> Action[Interval]:
        """From now on exactly these errors exist."""


class LedsDriver(Protocol):
    """Looks at the LEDs of the device."""

    sees_edges: bool
    """It can report every change of light with its instant."""

    def read(self) -> Action[Mapping[str, str]]:
        """Name of each LED -> "off", "on" or "blink", over at least one blink period."""

    def watch(self, for_ns: int) -> Action[LedEdges]:
        """Every edge in the coming span."""


class BitRateDriver(Protocol):
    """Sets the bit rate at which the tester's end of the bus runs."""

    def set(self, bit_rate: int) -> Action[Interval]:
        """Run at `bit_rate` bit/s from now on."""


class HealthDriver(Protocol):
    """Asks how late the host of a simulated device was."""

    about: str
    """Who says so, for people."""

    def late(self) -> Action[Sequence[tuple[int, int]]]:
        """Pairs (due, sent) in ns since the last call.

        What was seen in between may have been due as early as `due`; that is the *host's*
        time.
        """
