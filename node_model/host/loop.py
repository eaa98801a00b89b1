"""Keeps a node's time: frames, deadlines and stimuli happen in the order of their instants.

Laws:
1. One thread. What the node is told carries the instant at which it happened (the
   kernel's stamp of a frame, the deadline that the node announced, the planned instant of
   a key edge), not the instant at which this process got round to it. So a host that was
   stopped for a second delays frames and changes nothing else.
2. Everything that happened earlier is done before anything later; the node's time never
   goes back. A stamp that does lie before the node's time (two CPUs may stamp out of
   order by microseconds) counts as the node's time.
3. Each frame that went out late is remembered, for the judge to hold it against the host.

Setting the machine's clock while a node is hosted breaks these laws; the tester's port
reports such a step.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable
from typing import Generic, Protocol, TypeVar

from node_model.frame import Frame
from node_model.host.wires import Wire
from node_model.node import MS, Frames, Node, Panel, earliest

N_co = TypeVar("N_co", bound=Node, covariant=True)

LATE_NS = MS // 2
"""From here on a frame counts as late. Well above the usual cost of a wake-up and a send
(0.05 to 0.2 ms), below the smallest span that the suite judges (1 ms)."""

_MOST_LATE = 65_536
"""Entries kept when nobody asks; the oldest are forgotten."""

RETRY_NS = MS // 2
"""When to try again where the interface's queue is full."""


class Job(Protocol):
    """Something asked of the host that takes time: its steps are due at planned instants."""

    def due(self) -> int | None:
        """When `run` wants to be called next; None = it is done."""

    def run(self, at: int) -> None:
        """The step due at `at`."""

    def look(self, at: int) -> None:
        """The node was just told something at `at`."""

    def answer(self) -> dict[str, object]:
        """What to tell who asked; only once it is done."""


class Loop(Generic[N_co]):
    """A node on a wire.

    Args:
        node: the node; switched off.
        wire: its end of the bus.
        clock: CLOCK_REALTIME in ns, the clock of the wire's stamps.
    """

    def __init__(self, node: N_co, wire: Wire, clock: Callable[[], int] = time.time_ns) -> None:
        self.node = node
        self.wire = wire
        self.clock = clock
        self.held: frozenset[str] = frozenset()
        self.tester_rate: int | None = None
        self.job: Job | None = None
        self.late: deque[tuple[int, int]] = deque(maxlen=_MOST_LATE)
        self._time = clock()
        self._outbox: deque[tuple[Frame, int]] = deque()

    def catch_up(self) -> None:
        """Do everything that is due by now, oldest first."""
        horizon = self.clock()
        self._flush()
        receive = self.wire.receive
        while (got := receive()) is not None:
            frame, at = got
            self._until(at)
            self._hear(frame, at)
            if at > horizon:
                break  # so that a full bus does not keep us here for ever
        else:
            self._until(horizon)

    def wake_at(self) -> int | None:
        """When `catch_up` has something to do even if no frame comes; None = never."""
        retry = self.clock() + RETRY_NS if self._outbox else None
        return earliest(self.node.deadline(), self.job.due() if self.job else None, retry)

    def instant(self) -> int:
        """The node's present, with everything that came or was due before it done.

        The time of a stimulus.
        """
        self.catch_up()
        return self._time

    # Stimuli: to be called with the instant of `instant`, or at a planned one.

    def power(self, on: bool, at: int) -> None:
        """Supply on or off."""
        self._tell(self.node.power_on if on else self.node.power_off, at)

    def hold(self: Loop[Panel], held: frozenset[str], at: int) -> None:
        """Exactly these keys are held from `at` on."""
        self.held = held
        self._tell(lambda now: self.node.hold(held, now), at)

    def fail(self: Loop[Panel], active: frozenset[str], at: int) -> None:
        """Exactly these errors exist from `at` on."""
        self._tell(lambda now: self.node.fail(active, now), at)

    def _tell(self, verb: Callable[[int], Frames], at: int) -> None:
        self._time = at = max(at, self._time)
        self._emit(verb(at), at)
        if self.job is not None:
            self.job.look(at)

    def _until(self, instant: int) -> None:
        """Node deadlines and steps of the job up to `instant`, in order of time.

        At the same instant the node's deadline comes first: a key that moves at the very
        instant of a report cannot be in it.
        """
        node = self.node
        while True:
            due = node.deadline()
            job = self.job
            step = job.due() if job else None
            if job is not None and step is not None and (due is None or step < due):
                if step > instant:
                    break
                job.run(max(step, self._time))
                continue
            if due is None or due > instant:
                break
            self._time = at = max(due, self._time)
            self._emit(node.advance(at), due)
            if job is not None:
                job.look(at)
        if instant > self._time:
            self._time = instant

    def _hear(self, frame: Frame, at: int) -> None:
        """A frame ended on the wire; a controller at another bit rate does not get it."""
        node = self.node
        rate = node.bit_rate
        if not rate or (self.tester_rate is not None and rate != self.tester_rate):
            return
        wanted = node.listens_to
        if wanted is not None and (frame.extended or frame.can_id not in wanted):
            return
        now = max(at, self._time)
        self._emit(node.receive(frame, now), at)
        if self.job is not None:
            self.job.look(now)

    def _emit(self, frames: Frames, due: int) -> None:
        """Send what the node said; at another bit rate than the tester's nobody hears it."""
        if not frames:
            return
        rate = self.node.bit_rate
        if not rate or (self.tester_rate is not None and rate != self.tester_rate):
            return
        self._outbox.extend((frame, due) for frame in frames)
        self._flush()

    def _flush(self) -> None:
        outbox = self._outbox
        while outbox:
            frame, due = outbox[0]
            if not self.wire.send(frame):
                return
            outbox.popleft()
            sent = self.clock()
            if sent - due > LATE_NS:
                self.late.append((due, sent))
