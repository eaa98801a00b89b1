"""The stations on a virtual wire: a controller each, with the frames that wait in it."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from enum import Enum
from typing import Protocol

from node_model.frame import Frame
from node_model.node import Node

DEFAULT_DEPTH = 256
"""Frames that may wait in a controller and its driver's queue."""


class Mailbox(Enum):
    """In which order a controller sends the frames that wait in it."""

    FIFO = "fifo"
    BY_IDENTIFIER = "by identifier"


Waiting = tuple[int, int, Frame, int, "Controller"]
"""Arbitration order, order of asking, the frame, when it was asked for, and by whom."""


Withdraws = Callable[[Frame, int, int], bool]
"""See `Withdrawing`; asking for that protocol with `isinstance` costs as much as ten frames."""


Repeats = Callable[[Frame, int, int, int], Sequence[int]]
"""See `Repeating`."""


class Controller:
    """One station on the wire: a node, or with None the tester's own end.

    Its `lost` counts frames that a full mailbox or the wrong bit rate cost.
    """

    __slots__ = (
        "by_identifier",
        "depth",
        "due_at",
        "listens_to",
        "lost",
        "node",
        "rate",
        "repeats",
        "usual",
        "usual_ns",
        "waiting",
        "withdraws",
    )

    def __init__(self, node: Node | None, mailbox: Mailbox, depth: int) -> None:
        self.node = node
        self.by_identifier = mailbox is Mailbox.BY_IDENTIFIER
        self.depth = depth
        self.waiting: deque[Waiting] = deque()
        self.due_at: int | None = None
        self.rate = -1
        self.listens_to: frozenset[int] | None = frozenset()
        self.lost = 0
        self.usual: Frame | None = None
        """A frame to which no node listens, as all stations are now, and how long it takes."""
        self.usual_ns = 0
        self.withdraws: Withdraws | None = getattr(node, "withdraws", None)
        self.repeats: Repeats | None = getattr(node, "repeats", None)


class Gathered(Protocol):
    """Frames, when each has ended, and the places of a tester's own."""

    frames: list[Frame]
    instants: list[int]
    own: list[int]
