"""The contract of a port: one blocking verb, one thread, no callbacks, no sleep.

Laws:
1. `next` is the only place where a tester waits. In virtual time it runs the world; in
   real time it waits in one select over the CAN socket and the descriptors in `also`.
2. Everything that happened on the bus comes out of `next` exactly once and in order, the
   tester's own frames included (`own`), as soon as they were really on the bus.
3. Stamps are integer ns of one clock, the one of `now`. The true end of a frame lies in
   `at - doubt_ns .. at`.
4. Lost frames are told: an event of kind GAP or OVERFLOW stands where they are missing.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol, runtime_checkable

from hil_tests.trace import Burst, BusEvent, Columns, Sighting
from node_model.frame import Frame

BURST = 256
"""How many frames a port in virtual time hands out at once, at most."""

FEW = 2
"""Most waits see no more frames: to judge them together does not pay."""


class Port(Protocol):
    """The tester's end of a bus."""

    name: str
    """For people: "vcan0 (socketcan)", "virtual"."""

    timed: bool
    """The wire arbitrates and has bit times (a real bus, the virtual one; not vcan)."""

    clock: str
    """For people: which clock stamps the frames, and its doubt."""

    doubt_ns: int
    """Doubt of an ordinary stamp."""

    def now(self) -> int:
        """The present instant on the clock that stamps the frames."""

    def send(self, frame: Frame) -> None:
        """Queue a frame for the bus; it is seen again in `next` once it was sent.

        Raises:
            BusUnavailable: the interface is down or refuses to send.
        """

    def next(self, until: int, also: Sequence[int] = ()) -> Sighting | BusEvent | None:
        """The next thing that happens on the bus, at the latest at `until`.

        Args:
            until: instant on this port's clock; one that has passed means "do not wait,
                but do hand out what is there".
            also: file descriptors; becoming readable ends the wait, too (real time only).

        Returns:
            A frame or an event; None when `until` has come or a descriptor is readable.

        Raises:
            BusUnavailable: the interface went away.
        """

    def set_bit_rate(self, bit_rate: int) -> None:
        """Run the tester's own controller at `bit_rate` bit/s.

        Raises:
            BenchError: this interface cannot; with what to do instead.
        """

    def close(self) -> None:
        """Leave the bus; calling it twice is allowed."""


@runtime_checkable
class ToldPort(Port, Protocol):
    """A port of which it is known what its clock showed when a test read it."""

    def told(self) -> int:
        """The present instant, as it was read then."""


@runtime_checkable
class GatheringPort(Port, Protocol):
    """A port in real time that can hand out what it had to read in a hurry as it is."""

    def gather(self) -> Columns | None:
        """Frames that wait in the port, where there are many; None = ask `next`."""


@runtime_checkable
class BurstPort(Port, Protocol):
    """A port in virtual time: what nobody waits for need not come one by one."""

    def burst(self, until: int, most: int = BURST) -> Burst:
        """Let time pass up to `until`, or to something that needs a closer look.

        That is an event, for which `next` has to be called, as for an empty burst. One that is
        `over` needs no `next`: nothing more comes by then.

        Args:
            until: instant on this port's clock.
            most: how many frames at once.
        """
