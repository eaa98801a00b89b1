"""How many scenarios a second: fresh worlds, twenty stimuli each, monitors and oracle included.

    python -m benchmarks.scenarios

A scenario is what exploration does all day: a fresh world with a commissioned keypad, its
start, twenty stimuli at 5 to 150 ms from each other, everything reported, the monitors asked.
Kinds: keys and NMT commands held against the key oracle; LED frames; NMT frames alone. Made up
by a fixed sequence, so that every run has the same work. Processor time, medians of five,
interleaved.
"""

from __future__ import annotations

import cProfile
import pstats
import sys
from collections.abc import Callable, Sequence
from functools import partial
from random import Random
from statistics import median

from benchmarks.tables import against, interleaved, show, timed
from hil_tests.bench.bench import Bench
from hil_tests.bench.virtual import VirtualStage
from hil_tests.clock import MS
from hil_tests.config import load_profile
from hil_tests.judge.cobs import LED_BLINK, LED_STEADY, Nmt, nmt_frame
from hil_tests.scenarios.scenario import Scenario
from hil_tests.scenarios.story import play
from hil_tests.scenarios.strategies import decode, spans_ms
from node_model import faults, keypad
from node_model.frame import Frame

_SCENARIOS = 100
_STEPS = 20
_BAR = 1000
_SEED = 4711
_CODES = 9
"""Kinds of step that `decode` knows."""


def open_bench() -> Bench:
    """The bench of a run in virtual time, with the bundled keypad."""
    stage = VirtualStage(partial(faults.make, None), keypad.load())
    profile = load_profile("keypad")
    return Bench(stage, profile, profile.factory)


def key_scenarios(random: Random) -> list[Scenario]:
    """Keys that bounce near the debounce time, with commands in between."""
    made = []
    for _ in range(_SCENARIOS):
        debounce = random.choice((0, 1, 2))
        most = _CODES * len(spans_ms(debounce))
        made.append(decode(debounce, [random.randrange(most) for _ in range(_STEPS)]))
    return made


def keys(bench: Bench, scenarios: Sequence[Scenario]) -> None:
    """Each played, and held against the key oracle."""
    for scenario in scenarios:
        bench.begin_example()
        play(bench, scenario).judge("KEY-06")
        bench.check_monitors()


def posts(bench: Bench, stories: Sequence[Sequence[tuple[int, Frame]]]) -> None:
    """Frames of ours at their distances in ms."""
    for story in stories:
        bench.begin_example()
        bench.operational({"node_id": 6})
        for span_ms, frame in story:
            bench.wait(span_ms * MS)
            bench.post(frame)
        bench.wait(200 * MS)
        bench.check_monitors()


def led_stories(random: Random) -> list[list[tuple[int, Frame]]]:
    """Maps for steady and for blinking light."""
    bases = (LED_STEADY, LED_BLINK)
    return [
        [
            (random.randint(5, 150), Frame(random.choice(bases) + 6, random.randbytes(1)))
            for _ in range(_STEPS)
        ]
        for _ in range(_SCENARIOS)
    ]


def nmt_stories(random: Random) -> list[list[tuple[int, Frame]]]:
    """Commands to the node, to all and to another."""
    return [
        [
            (random.randint(5, 150), nmt_frame(random.choice(list(Nmt)), random.choice((0, 6, 7))))
            for _ in range(_STEPS)
        ]
        for _ in range(_SCENARIOS)
    ]


def starts(bench: Bench) -> None:
    """No stimuli: what a fresh world, a start and the monitors take."""
    for _ in range(_SCENARIOS):
        bench.begin_example()
        bench.operational({"node_id": 6})
        bench.check_monitors()


def works() -> dict[str, Callable[[], None]]:
    """The kinds of scenario."""
    random = Random(_SEED)
    bench = open_bench()
    return {
        "start to operational, no stimuli": partial(starts, bench),
        "20 steps of keys and commands, key oracle": partial(keys, bench, key_scenarios(random)),
        "20 LED frames": partial(posts, bench, led_stories(random)),
        "20 NMT frames": partial(posts, bench, nmt_stories(random)),
    }


def profiled(work: Callable[[], None]) -> None:
    """Where the time of one kind goes."""
    profile = cProfile.Profile()
    profile.runcall(work)
    pstats.Stats(profile).sort_stats("tottime").print_stats(40)


def main() -> int:
    """Measures and prints; with a number as argument, profiles that kind."""
    kinds = works()
    if len(sys.argv) > 1:
        profiled(list(kinds.values())[int(sys.argv[1])])
        return 0
    seconds = interleaved({name: partial(timed, work) for name, work in kinds.items()})
    rows = []
    for name, times in seconds.items():
        each_s = median(times) / _SCENARIOS
        rows.append([name, f"{each_s * 1e3:.2f}", f"{1 / each_s:.0f}", against(1 / each_s, _BAR)])
    show("Scenarios through the bench", ("", "ms each", "a second", "bar"), rows)
    return 0


if __name__ == "__main__":
    sys.exit(main())
