"""The NMT master of a bench: the manager of the device under test, on its bus.

The manager knows what was on the bus and nothing else: it is fed from the trace, and what it
wants to send goes out while the bench waits.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from hil_tests.clock import FOREVER
from hil_tests.judge.cobs import State
from hil_tests.manager import Event, Manager

if TYPE_CHECKING:
    from collections.abc import Callable

    from hil_tests.bench.judging import JudgingBench
    from hil_tests.judge.causal import Seen
    from node_model.frame import Frame


class Master:
    """Manages the device under test.

    Args:
        bench: that carries the frames.
    """

    def __init__(self, bench: JudgingBench) -> None:
        self._bench = bench
        self._manager = Manager(1)
        self._read = 0

    def meet(self) -> Manager:
        """A new manager, which knows nothing of the device yet."""
        limits = self._bench.profile.limits
        self._manager = Manager(self._bench.node_id, limits.command_ns)
        self._read = len(self._bench.trace)
        return self._manager

    @property
    def manager(self) -> Manager:
        """The manager, which has seen everything that was on the bus by now."""
        self._feed()
        return self._manager

    @property
    def state(self) -> State | None:
        """As the device last showed it."""
        return self.manager.state

    def take_events(self) -> list[Event]:
        """What has happened since this was last asked."""
        return self.manager.take_events()

    def tell(self, command: Callable[[Manager, int], Frame]) -> Seen:
        """Give a command, e.g. `Manager.start`, and see it on the bus."""
        self._feed()
        frame = command(self._manager, self._bench.now())
        return self._bench.send(frame)

    def guard(self, guard_ns: int, factor: int) -> None:
        """Poll from now on, whenever the bench waits in `wait`; 0 ends it."""
        self._feed()
        self._manager.guard(guard_ns, factor, self._bench.now())

    def heartbeat(self, consumer_ns: int, *, written: bool = False) -> None:
        """Watch the heartbeat; see `Manager.heartbeat`."""
        self._feed()
        self._manager.heartbeat(consumer_ns, self._bench.now(), written=written)

    def miss(self) -> None:
        """Whatever came since this was last asked is lost on the way to the manager."""
        self._read = len(self._bench.trace)

    def wait(self, span_ns: int) -> None:
        """Let time pass, and poll meanwhile as the manager wants."""
        bench = self._bench
        until = bench.now() + span_ns
        while True:
            due = self._manager.deadline()
            if due is not None and due <= until:
                self._pass(due)
                continue
            self._pass(until)
            if bench.now() >= until:
                return

    def _pass(self, until: int) -> None:
        """Let time pass up to a deadline; frames may move it."""
        bench = self._bench
        while bench.now() < until:
            bench.pump(until)
            self._feed()
            if (self._manager.deadline() or FOREVER) < until:
                return
        for frame in self._manager.advance(bench.now()):
            bench.send(frame)
        self._feed()

    def _feed(self) -> None:
        trace, update = self._bench.trace, self._manager.update
        for index in range(self._read, len(trace)):
            sighting = trace.frame(index)
            if not sighting.own:
                update(sighting.frame, sighting.at)
        self._read = len(trace)
