"""Whether a frame costs the same after three million frames as after ten thousand.

    python -m benchmarks.flat_cost

Worlds with one judged keypad are brought to several ages; then windows of frames are timed
in turn, one world after the other, so that a drifting machine harms all ages alike. The
memory is what the interpreter really allocated for a trace (spare room of its columns
included), by tracemalloc, in a run of its own.
"""

from __future__ import annotations

import argparse
import sys
import tracemalloc
from functools import partial
from statistics import median

from benchmarks.tables import against, interleaved, ratio, show, timed
from benchmarks.tester import Tester
from benchmarks.workloads import FLAT
from hil_tests.trace import Sighting, Trace
from node_model.heartbeat import heartbeat_frame
from node_model.nmt import NmtState

_AGES = (10_000, 100_000, 1_000_000, 3_000_000)
_WINDOW = 10_000
_ROUNDS = 15
_FLAT = 1.15
_BYTES_BAR = 40
_MEMORY_FRAMES = 300_000


def allocated(frames: int) -> float:
    """Bytes a frame that a trace of that many frames holds."""
    beat = heartbeat_frame(1, NmtState.OPERATIONAL)
    tracemalloc.start()
    before = tracemalloc.get_traced_memory()[0]
    trace = Trace()
    for at in range(frames):
        trace.see(Sighting(beat, at))
    used = tracemalloc.get_traced_memory()[0] - before
    tracemalloc.stop()
    return used / len(trace)


def watched_bytes(frames: int) -> float:
    """Bytes a frame that a whole judged run holds: world, trace, monitors."""
    tracemalloc.start()
    before = tracemalloc.get_traced_memory()[0]
    tester = Tester(FLAT)
    tester.take(frames)
    used = tracemalloc.get_traced_memory()[0] - before
    tracemalloc.stop()
    return used / frames


def main() -> int:
    """Ages the worlds, measures, prints."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--frames", type=int, default=_AGES[-1], metavar="N")
    oldest = parser.parse_args().frames
    ages = [age for age in _AGES if age < oldest] + [oldest]
    testers = {f"{age} frames": Tester(FLAT) for age in ages}
    for age, tester in zip(ages, testers.values(), strict=True):
        tester.take(age)
    windows = {
        name: partial(timed, partial(tester.take, _WINDOW)) for name, tester in testers.items()
    }
    seconds = interleaved(windows, _ROUNDS)
    youngest = next(iter(seconds.values()))
    rows = []
    for name, times in seconds.items():
        grown = ratio(times, youngest)
        bar = against(grown, _FLAT, least=False) if times is not youngest else ""
        rows.append([name, f"{median(times) / _WINDOW * 1e6:.2f}", f"{grown:.3f}", bar])
    title = "A keypad at 100 ms, trace and monitors: the next frames after so many"
    show(title, ("", "us/frame", "to the youngest", "bar"), rows)
    trace, whole = allocated(_MEMORY_FRAMES), watched_bytes(_MEMORY_FRAMES)
    show(
        f"Memory after {_MEMORY_FRAMES} frames",
        ("", "bytes/frame", "bar"),
        [
            ["trace", f"{trace:.1f}", against(trace, _BYTES_BAR, least=False)],
            ["world, trace, monitors", f"{whole:.1f}", ""],
        ],
    )
    return 0


if __name__ == "__main__":
    sys.exit(main())
