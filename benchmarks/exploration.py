"""How quick exploration is, and which of the known faults it finds by itself.

    python -m benchmarks.exploration                  scenarios a second, by family
    python -m benchmarks.exploration --kill 60        each faulty model: found in 60 s of one core?
    python -m benchmarks.exploration --kill 60 --mutant NAME

No scripted test takes part: seeded walks, monitors and oracles alone. A fault is found when
something fails, and blamed when a requirement that it violates does. Processor time.
"""

from __future__ import annotations

import argparse
import statistics
import sys
from collections.abc import Sequence
from multiprocessing import Pool
from time import process_time
from typing import NamedTuple

from benchmarks.tables import ROUNDS, against, show, timed
from hil_tests.explore.lab import Lab
from hil_tests.explore.soak import cores
from hil_tests.explore.walks import walk
from hil_tests.scenarios.families import FAMILIES
from node_model.faults import MUTANTS

STEPS = 20
"""A scenario of the bar has so many steps; those of some families have more."""

BAR = 1000
"""Scenarios of 20 steps a second, on one core."""

SAMPLE = 60


class Speed(NamedTuple):
    """What playing some walks cost."""

    seconds: float
    steps: int


def speed(families: Sequence[str], count: int, seed: int) -> Speed:
    """Play walks; making them up is part of it."""
    lab = Lab()
    steps = 0

    def work() -> None:
        nonlocal steps
        for number in range(count):
            story = walk(seed, number, families)
            steps += len(story.steps)
            lab.play(story)

    return Speed(timed(work), steps)


def speeds() -> None:
    """The table of families, and of all of them as exploration mixes them."""
    rows = []
    for name, count in [*((name, SAMPLE) for name in FAMILIES), ("all, as mixed", 600)]:
        families = () if name.startswith("all") else (name,)
        found = [speed(families, count, seed) for seed in range(ROUNDS)]
        each_ms = statistics.median(one.seconds / count * 1000 for one in found)
        of_bar = statistics.median(one.steps / STEPS / one.seconds for one in found)
        steps = statistics.median(one.steps / count for one in found)
        bar = against(of_bar, BAR) if name.startswith("all") else ""
        rows.append([name, f"{steps:.0f}", f"{each_ms:.2f}", f"{of_bar:.0f}", bar])
    heads = ["family", "steps", "ms each", "of 20 steps a second", "bar"]
    show("Scenarios, monitors and every oracle included, one core", heads, rows)


class Hunt(NamedTuple):
    """How a faulty model fared: walks and seconds to the first failure and the first blame."""

    name: str
    walks: int
    killed_s: float | None
    blamed_s: float | None


def hunt(task: tuple[str, float, int]) -> Hunt:
    """Walk until the model is blamed or the time is over."""
    name, patience_s, seed = task
    lab, violates = Lab(model=name), set(MUTANTS[name].violates)
    began, number, killed_s = process_time(), 0, None
    while (spent := process_time() - began) < patience_s:
        finding = lab.play(walk(seed, number))
        number += 1
        if finding is None:
            continue
        killed_s = spent if killed_s is None else killed_s
        if finding.requirements & violates:
            return Hunt(name, number, killed_s, process_time() - began)
    return Hunt(name, number, killed_s, None)


def kills(names: Sequence[str], patience_s: float, seed: int) -> int:
    """Every model; what survives is named."""
    found: list[Hunt] = []
    with Pool(cores()) as pool:
        tasks = [(name, patience_s, seed) for name in names]
        for one in pool.imap_unordered(hunt, tasks):
            found.append(one)
            if one.killed_s is None or one.blamed_s is None:
                print(f"{one.name}: {'survives' if one.killed_s is None else 'not blamed'}")
            if sys.stdout.isatty():
                print(f"\r{len(found)} of {len(names)}", end="\r", flush=True)
    rows = []
    for limit in sorted({1.0, 10.0, 60.0, patience_s}):
        if limit <= patience_s:
            killed = sum(one.killed_s is not None and one.killed_s <= limit for one in found)
            blamed = sum(one.blamed_s is not None and one.blamed_s <= limit for one in found)
            share = [f"{count} ({count / len(found):.1%})" for count in (killed, blamed)]
            rows.append([f"{limit:g} s", *share])
    show(f"{len(found)} faulty models, seed {seed}", ["within", "found", "blamed"], rows)
    return 0


def main() -> int:
    """Run it."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--kill", type=float, metavar="SECONDS", help="hunt each faulty model")
    parser.add_argument("--mutant", action="append", choices=sorted(MUTANTS), metavar="NAME")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    if options.kill is None:
        speeds()
        return 0
    return kills(options.mutant or list(MUTANTS), options.kill, options.seed)


if __name__ == "__main__":
    sys.exit(main())
