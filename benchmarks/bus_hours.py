"""How many bus hours a second: the world against SimPy and canopen's LocalNode.

    python -m benchmarks.bus_hours

Every figure is a median of five, everything interleaved in one run, in processor time; a
ratio is the median of the five ratios of what ran side by side. Needs the extra `bench`.
Ends with status 1 where SimPy's wire differs or the monitors object to a sound device.
"""

from __future__ import annotations

import statistics
import sys
from collections.abc import Callable, Generator, Mapping, Sequence
from functools import partial
from typing import Any

from benchmarks.local_node import LocalKeypad
from benchmarks.simpy_wire import SimpyWire
from benchmarks.tables import against, interleaved, ratio, show, timed
from benchmarks.tester import Tester, world_of
from benchmarks.workloads import ALL, NODE_ID, PRESSED, Workload
from node_model.frame import Frame
from node_model.node import S

_LOCAL_NODE_BAR = 20
_BEATS = 200
_LIVE_FRAMES = 600

_OURS = ("world alone", "trace + monitors")
_ALIVE = "LocalNode alive: own timer, TPDOs, a master"
"""The same work on both sides, and so the row that the bar means: the node's own timer makes
the heartbeats, a key is told when it changed, somebody else on the bus sees each frame."""

_BY_THE_CLOCK = "LocalNode's 1 ms heartbeat, by the clock"


def simpy_of(workload: Workload) -> SimpyWire:
    """The same as SimPy processes."""
    wire = SimpyWire(workload.bit_rate)
    workload.build(wire, wire.attach(), workload.span_ns)
    return wire


def alone(workload: Workload) -> None:
    """The world; its tester waits for each frame and does nothing with it."""
    next_frame, until = world_of(workload).next_frame, workload.span_ns
    while next_frame(until) is not None:
        pass


def unheard(workload: Workload) -> None:
    """The world; nobody waits for its frames."""
    world_of(workload).run(workload.span_ns)


def judged(workload: Workload) -> None:
    """The world; its tester keeps a trace in memory and shows each frame to the monitors."""
    Tester(workload).take()


def _listen(wire: SimpyWire, seen: list[tuple[Frame, int]] | None) -> Generator[Any, Any, None]:
    """A tester as a SimPy process: woken for each frame."""
    while True:
        heard = yield wire.next_frame()
        if seen is not None:
            seen.append(heard)


def simpy(workload: Workload) -> None:
    """SimPy; a tester's process waits for each frame and does nothing with it."""
    wire = simpy_of(workload)
    wire.env.process(_listen(wire, None))
    wire.run(workload.span_ns)


def simpy_unheard(workload: Workload) -> None:
    """SimPy at its leanest: frames are counted, nobody waits for them."""
    simpy_of(workload).run(workload.span_ns)


ENGINES: Mapping[str, Callable[[Workload], object]] = {
    "world alone": alone,
    "trace + monitors": judged,
    "SimPy": simpy,
    "world, unheard": unheard,
    "SimPy, unheard": simpy_unheard,
}

_SAME_WORK = {"SimPy": "world alone", "SimPy, unheard": "world, unheard"}
"""What each of SimPy's engines is held against: with a tester that waits, and with none."""


def deliveries(workload: Workload) -> list[tuple[Frame, int]]:
    """Frames and instants in the world."""
    world, seen = world_of(workload), []
    while (delivery := world.next_frame(workload.span_ns)) is not None:
        seen.append((delivery[0], delivery[1]))
    return seen


def compared(workload: Workload) -> tuple[int, bool]:
    """How many frames the world has, and whether SimPy has the same at the same instants."""
    ours = deliveries(workload)
    wire = simpy_of(workload)
    theirs: list[tuple[Frame, int]] = []
    wire.env.process(_listen(wire, theirs))
    wire.run(workload.span_ns)
    return len(ours), ours == theirs


def run(engine: Callable[[Workload], object], workload: Workload) -> None:
    """All the worlds of a workload."""
    for _ in range(workload.worlds):
        engine(workload)


def engine_rows(workload: Workload, seconds: Mapping[str, list[float]]) -> list[list[str]]:
    """A line of the table for each engine."""
    frames = len(deliveries(workload)) * workload.worlds
    span_s = workload.span_ns * workload.worlds / S
    rows = []
    for engine, times in seconds.items():
        wall_s = statistics.median(times)
        speed = span_s / wall_s
        faster, bar = "", ""
        if engine in _SAME_WORK:
            value = ratio(times, seconds[_SAME_WORK[engine]])
            faster = f"{value:.2f}"
            bar = against(value, workload.simpy_bar) if workload.simpy_bar else ""
        elif engine == "trace + monitors" and workload.judged_bar:
            hours = workload.judged_bar >= 3600
            unit = 3600 if hours else 1
            bar = against(speed / unit, workload.judged_bar / unit) + (" h/s" if hours else " x")
        each = f"{wall_s / frames * 1e6:.2f}"
        rows.append([f"  {engine}", each, f"{speed:.0f}", f"{speed / 3600:.3g}", faster, bar])
    return rows


def show_engines(seconds: Mapping[str, list[float]]) -> None:
    """The table of the world against SimPy."""
    rows: list[list[str]] = []
    for workload in ALL:
        title = workload.name
        if workload.worlds > 1:
            wall_s = statistics.median(seconds[f"{workload.name}/world alone"])
            title += f" (world alone: {wall_s / workload.worlds * 1e3:.3f} ms each)"
        rows.append([title, "", "", "", "", ""])
        mine = {engine: seconds[f"{workload.name}/{engine}"] for engine in ENGINES}
        rows.extend(engine_rows(workload, mine))
    heads = ("", "us/frame", "x real time", "bus h/s", "world faster by", "bar")
    show("The same node objects on the same bit-timed, arbitrated wire", heads, rows)


def show_check() -> bool:
    """Says whether SimPy's wire does what the world does."""
    same = True
    print("Frames and instants of SimPy's wire against the world's:")
    for workload in (*ALL, PRESSED):
        count, equal = compared(workload)
        tester = Tester(workload)
        tester.take()
        verdicts = tester.objections()
        print(
            f"  {workload.name}: {count} frames {'identical' if equal else 'DIFFER'};"
            f" the monitors object to {len(verdicts)}"
        )
        same = same and equal and not verdicts
    return same


def masks_of(workload: Workload) -> list[int | None]:
    """The keypad's frames as LocalNode's work: keys to report, None for a heartbeat."""
    frames = [frame for frame, _ in deliveries(workload)]
    return [
        frame.data[0] if frame.can_id == 0x180 + NODE_ID else None
        for frame in frames
        if frame.can_id in (0x180 + NODE_ID, 0x700 + NODE_ID)
    ]


def show_local_node(seconds: Mapping[str, list[float]], masks: Sequence[int | None]) -> None:
    """The table of the world against LocalNode on the virtual bus."""
    keys = sum(mask is not None for mask in masks)
    counts = {_ALIVE: _LIVE_FRAMES, _BY_THE_CLOCK: _BEATS}
    rows = []
    for name, times in seconds.items():
        each = [took / counts.get(name, len(masks)) for took in times]
        us = statistics.median(each) * 1e6
        faster = [""] * len(_OURS)
        if name not in _OURS:
            ours = ([took / len(masks) for took in seconds[engine]] for engine in _OURS)
            faster = [f"{ratio(each, its):.1f}" for its in ours]
        bar = ""
        if name == _ALIVE:
            alone = [took / len(masks) for took in seconds[_OURS[0]]]
            bar = against(ratio(each, alone), _LOCAL_NODE_BAR)
        rows.append([f"  {name}", f"{us:.2f}", f"{1e6 / us:.0f}", *faster, bar])
    title = f"{len(masks) - keys} heartbeats and {keys} key frames, each seen by a tester"
    heads = ("", "us/frame", "frames/s", *(f"{name} faster by" for name in _OURS), "bar")
    show(title, heads, rows)


def measures() -> dict[str, Callable[[], float]]:
    """One measure for each workload and engine."""
    return {
        f"{workload.name}/{name}": partial(timed, partial(run, engine, workload))
        for workload in ALL
        for name, engine in ENGINES.items()
    }


def main() -> int:
    """Checks, measures, prints."""
    same = show_check()
    masks = masks_of(PRESSED)
    with LocalKeypad(NODE_ID) as device, LocalKeypad(NODE_ID, master=True) as pair:
        local: dict[str, Callable[[], float]] = {
            "world alone": partial(timed, partial(alone, PRESSED)),
            "trace + monitors": partial(timed, partial(judged, PRESSED)),
            "LocalNode pushed, read in its thread": partial(timed, partial(device.push, masks)),
            "LocalNode pushed, a master waited for": partial(timed, partial(pair.push, masks)),
            _ALIVE: partial(pair.live, masks[:_LIVE_FRAMES]),
            _BY_THE_CLOCK: partial(device.beat, _BEATS),
        }
        seconds = interleaved({**measures(), **local})
    show_engines(seconds)
    show_local_node({name: seconds[name] for name in local}, masks)
    return 0 if same else 1


if __name__ == "__main__":
    sys.exit(main())
