"""Any frames to the drive and to a generic device, in virtual time, on all cores.

    python -m benchmarks.fuzz --frames 10000000 [--seed N] [--first M]
    python -m benchmarks.fuzz --seed N --life M

What must hold is in `benchmarks.fuzz.watched` and, of requests that must be served, in
`benchmarks.fuzz.lives`. A finding is told with seed, life and frame, and as a short list of
frames. Status 1 where there is one. A run that was ended goes on from the life that its last
line names.
"""

from __future__ import annotations

import argparse
import multiprocessing
import os
import sys
import time
from collections.abc import Iterable
from functools import partial
from typing import NamedTuple

from benchmarks.fuzz.frames import Input
from benchmarks.fuzz.lives import FRAMES, Lived, inputs_of, play
from benchmarks.fuzz.models import MODELS, chosen
from benchmarks.fuzz.shrink import shrunk
from node_model.node import MS

_TELL_S = 15.0
_MOST_FINDINGS = 20


class Result(NamedTuple):
    """What came of a life, and where it fails its smallest inputs."""

    number: int
    lived: Lived
    small: list[Input]


def lived(seed: int, number: int) -> Result:
    """Play a life; make small what is wrong."""
    name, wired = chosen(number)
    make = MODELS[name]
    inputs = inputs_of(seed, number, make)
    found = play(make, inputs, wired)
    if found.finding is None:
        return Result(number, found, [])

    def fails(smaller: list[Input]) -> bool:
        return play(make, smaller, wired).finding is not None

    return Result(number, found, shrunk(inputs[: found.at], fails))


def told(seed: int, result: Result) -> str:
    """A finding in words."""
    name, wired = chosen(result.number)
    where = "on the wire" if wired else "directly"
    head = f"seed {seed}, life {result.number} ({name}, {where}), frame {result.lived.at}"
    lines = [f"{head}: {result.lived.finding}"]
    lines += [f"    +{wait / MS:g} ms  {frame}" for wait, frame in result.small]
    lines.append(f"    again: python -m benchmarks.fuzz --seed {seed} --life {result.number}")
    return "\n".join(lines)


def summed(seed: int, results: Iterable[Result], wanted: int, first: int = 0) -> int:
    """Tell what comes; how many findings there are."""
    began = last = time.monotonic()
    ahead: set[int] = set()
    """Lives that are over while one before them is not."""
    frames = probes = spent = findings = 0
    for result in results:
        frames += result.lived.frames
        probes += result.lived.probes
        spent += result.lived.spent
        ahead.add(result.number)
        while first in ahead:
            ahead.remove(first)
            first += 1
        if result.lived.finding is not None:
            findings += 1
            if findings <= _MOST_FINDINGS:
                print(told(seed, result), flush=True)
        now = time.monotonic()
        if now - last > _TELL_S or frames >= wanted:
            last = now
            rate = frames / (now - began)
            print(
                f"{frames} frames ({rate:.0f}/s), {probes} rounds of valid requests served, "
                f"{spent} lives cut short, {findings} findings; goes on with --first {first}",
                flush=True,
            )
        if frames >= wanted:
            break
    return findings


def main() -> int:
    """Fuzz; status 1 where something is wrong."""
    parser = argparse.ArgumentParser(
        "python -m benchmarks.fuzz", description=(__doc__ or "").partition("\n")[0]
    )
    parser.add_argument("--frames", type=int, default=1_000_000)
    parser.add_argument("--seed", type=int, default=0, help="another seed, other frames")
    parser.add_argument("--first", type=int, default=0, help="life to begin with, to go on")
    parser.add_argument("--life", type=int, help="only this one, as a finding names it")
    parser.add_argument("--jobs", type=int, default=len(os.sched_getaffinity(0)))
    options = parser.parse_args()
    if options.life is not None:
        return min(summed(options.seed, [lived(options.seed, options.life)], FRAMES), 1)
    most = 2 * (options.frames // FRAMES + 1)  # some are cut short
    with multiprocessing.Pool(options.jobs) as pool:
        play_one = partial(lived, options.seed)
        numbers = range(options.first, options.first + most)
        results = pool.imap_unordered(play_one, numbers, chunksize=4)
        return min(summed(options.seed, results, options.frames, options.first), 1)


if __name__ == "__main__":
    sys.exit(main())
