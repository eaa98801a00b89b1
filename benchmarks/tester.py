"""A tester on a virtual wire: keeps a trace in memory, shows each frame to the monitors.

The one place where the benchmarks make monitors.
"""

from __future__ import annotations

from benchmarks.workloads import NODE_ID, SLOW, Workload
from hil_tests.bench.virtual import VirtualPort
from hil_tests.bus.port import BURST
from hil_tests.judge.causal import Lateness
from hil_tests.judge.expected import Expected
from hil_tests.judge.verdict import Limits, Outcome, Verdict
from hil_tests.judge.watch import Watch
from hil_tests.trace import Moment, Trace
from node_model.node import MS, S
from node_model.world import World


def world_of(workload: Workload) -> World:
    """A world with a tester and the workload on it."""
    world = World(workload.bit_rate)
    workload.build(world, world.attach(), workload.span_ns)
    return world


def watch_of(workload: Workload) -> Watch:
    """The monitors of a run; where several nodes beat, the first is the one judged."""
    period_ns = workload.heartbeat_ms * MS
    limits = Limits(period_ns * 95 // 100, period_ns * 105 // 100)
    expected = Expected(
        node_id=NODE_ID if period_ns else None,
        heartbeat_ns=period_ns,
        heartbeat_each=limits,
        heartbeat_mean=limits,
        heartbeat_first=Limits(at_most_ns=limits.at_most_ns),
        bit_rate=workload.bit_rate,
        command_ns=50 * MS,
        boot_up_ns=S,
        exclusive=workload.bit_rate == SLOW,
    )
    watch = Watch(expected, S // workload.bit_rate)
    if period_ns:
        watch.did(Moment("power", 0, 0, {"on": True, "mode": "regular"}))
    return watch


class Tester:
    """A fresh world with a workload, judged as it goes."""

    def __init__(self, workload: Workload) -> None:
        self._port = VirtualPort(World(workload.bit_rate))
        workload.build(self._port.world, self._port.tester, workload.span_ns)
        self.trace = Trace()
        self.watch = watch_of(workload)
        self._until = workload.span_ns

    def take(self, frames: int = 1 << 62) -> None:
        """Judge that many frames, or all up to the workload's end, as a bench that waits."""
        while frames:
            burst = self._port.burst(self._until, min(frames, BURST))
            if not burst:
                return
            self.watch.see_all(burst, self.trace.see_all(burst))
            frames -= len(burst)

    def objections(self) -> list[Verdict]:
        """What the monitors hold against the device."""
        verdicts = self.watch.finish(self._until, Lateness())
        return [verdict for verdict in verdicts if verdict.outcome is not Outcome.PASS]
