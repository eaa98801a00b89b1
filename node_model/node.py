"""The contract of every device model, and its laws.

1. A node is told the time; it never asks. Times are integer nanoseconds and never go back.
2. Each verb returns the frames that the node wants to send, in order.
3. `deadline()` names the instant at which `advance` wants to be called next, or None.
   Calling `advance` earlier changes nothing; after `advance(t)` the deadline is None or
   later than t.
4. The same inputs at the same times give the same outputs.
5. A periodic service advances from the instant at which it was *due*: a late host delays
   a frame, never the schedule.
6. Level outputs (bit rate, LEDs) are attributes or functions of time; edge outputs are
   returned.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol, runtime_checkable

from node_model.frame import Frame

US = 1_000
MS = 1_000_000
S = 1_000_000_000
"""Nanoseconds in a microsecond, a millisecond, a second."""

Frames = Sequence[Frame]
NOTHING: tuple[Frame, ...] = ()


class Node(Protocol):
    """What the wire and the host know of a device."""

    bit_rate: int
    """Bit rate of its CAN controller in bit/s; 0 while it takes no part (off, starting)."""

    listens_to: frozenset[int] | None
    """Base identifiers that pass its acceptance filter; None = every frame of any kind."""

    def power_on(self, now: int) -> Frames:
        """Supply is applied at `now`; on a powered node this does nothing."""

    def power_off(self, now: int) -> Frames:
        """Supply is cut at `now`; volatile state is gone. Never returns a frame."""

    def receive(self, frame: Frame, now: int) -> Frames:
        """A frame of another station ended on the wire at `now`."""

    def advance(self, now: int) -> Frames:
        """Time has come to `now`; whatever was due is done, oldest first."""

    def deadline(self) -> int | None:
        """When `advance` must be called next, or None."""


def earliest(*instants: int | None) -> int | None:
    """The smallest of the given deadlines; None where all are None."""
    soonest: int | None = None
    for instant in instants:
        if instant is not None and (soonest is None or instant < soonest):
            soonest = instant
    return soonest


@runtime_checkable
class Withdrawing(Node, Protocol):
    """A node whose controller takes back frames that the bus keeps waiting."""

    def withdraws(self, frame: Frame, asked_at: int, now: int) -> bool:
        """Whether a frame that it asked for at `asked_at` is not to start at `now` any more."""


@runtime_checkable
class Repeating(Node, Protocol):
    """A node that can tell at once when it sends the same frame again and again."""

    def repeats(self, frame: Frame, until: int, gap_ns: int, most: int) -> Sequence[int]:
        """The coming deadlines at which it sends this very frame and does nothing else.

        They count as done: nobody calls `advance` for them. The next deadline is after them.

        Args:
            frame: what it sent last, alone.
            until: none of them is later; nothing is told to it by then.
            gap_ns: they are further apart than this.
            most: no more of them.
        """


class Panel(Node, Protocol):
    """A node as a host or a virtual bench handles it: keys, LEDs and errors, where it has them."""

    name: str
    keys: tuple[str, ...]
    """Names of its keys, in bit order."""

    leds: tuple[str, ...]
    """Names of its LEDs, in bit order."""

    faults: tuple[str, ...]
    """Names of the errors that a bench can raise."""

    powered: bool

    def hold(self, held: frozenset[str], now: int) -> Frames:
        """From `now` on exactly these keys are physically held.

        Raises:
            ValueError: a name that is none of `keys`.
        """

    def fail(self, active: frozenset[str], now: int) -> Frames:
        """From `now` on exactly these errors exist; power does not end them.

        Raises:
            ValueError: a name that is none of `faults`.
        """

    def lit(self, led: str, now: int) -> bool:
        """Whether that LED shines at `now` (a function of time between two inputs)."""

    def lamp_change(self, now: int) -> int | None:
        """The next instant after `now` at which a lamp changes by itself; None = never."""

    def image(self) -> bytes:
        """Content of the non-volatile memory; changes only inside the four verbs."""


def refuse_strangers(what: str, names: frozenset[str], known: Sequence[str], owner: str) -> None:
    """Refuse names of keys, LEDs or errors that a device has not.

    Raises:
        ValueError: names the strangers, and what there is.
    """
    strangers = names.difference(known)
    if strangers:
        unknown, there = ", ".join(sorted(strangers)), ", ".join(known) or "none"
        raise ValueError(f"no {what} {unknown}; this {owner} has {there}")
