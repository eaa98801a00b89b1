"""Exact frame lengths: how often ours equals can-utils', and what each costs.

    python -m benchmarks.frame_lengths --frames 1000000

Ends with status 1 where one length differs. Needs canbusload (Debian: can-utils) and gcc.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from itertools import islice
from pathlib import Path
from time import perf_counter

from tests.oracles import bits, canutils

_BATCH = 100_000
_NAIVE = 2_000
"""Frames for the bit-by-bit reference, which is slow."""


def compare(count: int, seed: int, library: Path) -> tuple[int, float, float]:
    """Lengths of `count` random frames by both; prints the first difference.

    Returns:
        How many agree, seconds that ours took, seconds that can-utils took.
    """
    agree, ours_s, theirs_s = 0, 0.0, 0.0
    source = canutils.random_frames(count, seed)
    while batch := list(islice(source, _BATCH)):
        began = perf_counter()
        ours = [frame.bits for frame in batch]
        between = perf_counter()
        theirs = canutils.lengths(batch, library)
        theirs_s += perf_counter() - between
        ours_s += between - began
        for frame, mine, other in zip(batch, ours, theirs, strict=True):
            if mine == other:
                agree += 1
            else:
                print(f"{frame}: {mine} bits, by can-utils {other}")
    return agree, ours_s, theirs_s


def main() -> int:
    """Compares, prints agreement and rates; 1 where a length differs, 2 without tools."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--frames", type=int, default=1_000_000, metavar="N")
    parser.add_argument("--seed", type=int, default=1, metavar="N")
    parser.add_argument(
        "--where-available", action="store_true", help="without the tools, say so and succeed"
    )
    wanted = parser.parse_args()
    if lacking := canutils.missing():
        print(
            f"not compared, not installed: {', '.join(lacking)} (Debian: can-utils gcc libc6-dev)"
        )
        return 0 if wanted.where_available else 2
    with tempfile.TemporaryDirectory() as folder:
        library = canutils.build(Path(folder))
        agree, ours_s, theirs_s = compare(wanted.frames, wanted.seed, library)
    sample = list(canutils.random_frames(_NAIVE, wanted.seed))
    began = perf_counter()
    for frame in sample:
        bits.on_the_wire(frame)
    naive_s = perf_counter() - began
    print(f"seed {wanted.seed}: {agree} of {wanted.frames} random frames as long as by can-utils")
    print(f"node_model.frame {ours_s / wanted.frames * 1e6:6.2f} us a frame, not cached")
    print(f"bit by bit       {naive_s / _NAIVE * 1e6:6.2f} us a frame")
    print(f"canbusload -e    {theirs_s / wanted.frames * 1e6:6.2f} us a frame, printing included")
    return 0 if agree == wanted.frames else 1


if __name__ == "__main__":
    sys.exit(main())
