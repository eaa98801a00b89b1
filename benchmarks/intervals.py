"""How evenly the hosted keypad beats over a vcan, beside `cangen -g 100` in the same run.

    nodeproof vcan --vm -- python -m benchmarks.intervals [--seconds 60]

Both beat every 100 ms; our port records both. What counts is by how much the distance of two
neighbouring frames, from the kernel's stamps, differs from 100 ms. The bar: median and p99 of
the keypad's at most twice those of cangen. Needs can-utils and a vcan0.
"""

from __future__ import annotations

import argparse
import contextlib
import re
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from importlib.resources import files
from itertools import pairwise
from pathlib import Path

from benchmarks.tables import against, show
from hil_tests.bus.socketcan import SocketCanPort
from hil_tests.clock import MS, US, S
from hil_tests.trace import Sighting

CHANNEL = "vcan0"
PERIOD_NS = 100 * MS
BEAT, THEIRS = 0x701, 0x123
BAR = 2.0
WARM_NS = 3 * S
"""Not counted: both programs run their code for the first times."""


def profile(folder: Path) -> Path:
    """The keypad's profile with a heartbeat of 100 ms from the factory."""
    text = (files("node_model") / "profiles" / "keypad.toml").read_text(encoding="utf-8")
    changed, count = re.subn(r"(?m)^heartbeat_ms = \d+$", "heartbeat_ms = 100", text)
    if count != 1:
        raise SystemExit("the keypad's profile has no factory heartbeat_ms")
    path = folder / "keypad100.toml"
    path.write_text(changed, encoding="utf-8")
    return path


@contextlib.contextmanager
def running(*command: str, await_line: bool = False) -> Iterator[None]:
    """A program for a while; its first line is waited for where asked."""
    out = subprocess.PIPE if await_line else subprocess.DEVNULL
    with subprocess.Popen(command, stdout=out) as process:
        try:
            if await_line and process.stdout is not None:
                process.stdout.readline()
            yield
        finally:
            process.terminate()


def stamps(seconds: int) -> dict[int, list[int]]:
    """When the frames of both came."""
    found: dict[int, list[int]] = {BEAT: [], THEIRS: []}
    with contextlib.closing(SocketCanPort(CHANNEL)) as port:
        begin = port.now() + WARM_NS
        until = begin + seconds * S
        while (item := port.next(until)) is not None:
            if isinstance(item, Sighting) and item.at >= begin and item.frame.can_id in found:
                found[item.frame.can_id].append(item.at)
    return found


def errors_us(times: Sequence[int]) -> list[float]:
    """By how much each distance differs from the period, sorted."""
    return sorted(abs(later - sooner - PERIOD_NS) / US for sooner, later in pairwise(times))


def quantile(values: Sequence[float], share: float) -> float:
    """The smallest value that is not exceeded by that share of them."""
    return values[min(int(len(values) * share), len(values) - 1)]


def main() -> int:
    """Print the table; status 1 where the bar is not kept."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--seconds", type=int, default=60)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        host = [sys.executable, "-m", "node_model", "--channel", CHANNEL]
        host += ["--profile", str(profile(Path(folder)))]
        cangen = ["cangen", CHANNEL, "-g", "100", "-I", f"{THEIRS:X}", "-L", "1", "-D", "i"]
        with running(*host, await_line=True), running(*cangen):
            found = stamps(options.seconds)
    ours, theirs = errors_us(found[BEAT]), errors_us(found[THEIRS])
    if len(ours) < options.seconds or len(theirs) < options.seconds:
        raise SystemExit(f"too few frames: {len(ours)} of the keypad, {len(theirs)} of cangen")
    rows = []
    kept = True
    for name, share in (("median", 0.5), ("p99", 0.99), ("worst", 1.0)):
        mine, other = quantile(ours, share), quantile(theirs, share)
        ratio = mine / max(other, 0.001)
        bar = against(ratio, BAR, least=False) if share < 1 else ""
        kept = kept and (share == 1 or ratio <= BAR)
        rows.append((name, f"{mine:.1f}", f"{other:.1f}", f"{ratio:.2f}", bar))
    heads = ("interval - 100 ms, us", "keypad", "cangen -g 100", "ratio", "bar")
    show(f"{len(ours)} intervals of the keypad, {len(theirs)} of cangen", heads, rows)
    return 0 if kept else 1


if __name__ == "__main__":
    sys.exit(main())
