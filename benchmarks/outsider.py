"""Which faults of a keypad that shares nothing with our model the suite finds, over a vcan.

    nodeproof vcan --vm -- python -m benchmarks.outsider [--fault NAME ...] [--right]

The keypad is `tests.external.device`, in a process of its own; the suite meets it as it meets a
board: over the bus and the control protocol. Each fault meets the tests of the requirements that
it violates, up to the first FAIL. With --right (alone or besides) the whole suite judges the
keypad without a fault: no test may fail. With --multicast all of that goes over python-can's
udp_multicast in plain real time, for which no virtual machine is needed; but on a busy host the
keypad's process is late as a bad board is, and nobody vouches for it: --right belongs in the VM.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from benchmarks.tables import show
from tests.external.device.faults import FAULTS

ROOT = Path(__file__).parents[1]
BENCH = ROOT / "tests" / "external" / "bench.toml"
HOME = "5,2,1000,0,1"
"""What the bench file says that it is set to."""

VIOLATED: Mapping[str, str] = {
    "echo-slow": "COM-05", "echo-alive": "COM-12", "service-rate": "COM-02",
    "service-one-key": "COM-27", "service-boot": "COM-01", "heartbeat-swapped": "COM-09",
    "heartbeat-signed": "COM-09", "code-five": "COM-07", "code-default": "COM-07",
    "id-three-bits": "COM-08", "debounce-tens": "COM-10", "store-slow": "COM-06",
    "sync-in-echo": "COM-05 COM-11", "boot-twice": "NMT-02", "emcy-first": "NMT-02",
    "emcy-swapped": "NMT-02", "emcy-none": "NMT-02", "autostart": "NMT-01 NMT-03",
    "nmt-all": "NMT-04 NMT-07", "nmt-low-bits": "NMT-05", "nmt-stop-start": "NMT-04 NMT-07",
    "nmt-long": "NMT-05 ROB-01", "nmt-reset-quiet": "NMT-06", "nmt-reset-memory": "NMT-06",
    "heartbeat-toggle": "HB-02", "heartbeat-key": "HB-04", "heartbeat-led": "HB-04",
    "heartbeat-fast": "HB-01", "heartbeat-stale": "HB-03", "heartbeat-zero": "HB-05",
    "keys-reversed": "KEY-03", "keys-release": "KEY-04 KEY-05", "keys-shared": "KEY-06",
    "keys-entry": "KEY-01", "keys-pre": "KEY-07", "keys-latch": "KEY-06",
    "keys-bounce": "KEY-04 KEY-05", "keys-backlog": "KEY-07", "leds-coupled": "LED-03",
    "leds-pre": "LED-04", "leds-blink-wins": "LED-20", "leds-or": "LED-01",
    "leds-short": "LED-06", "crash-empty": "ROB-01", "extended": "NMT-05 ROB-01",
    "param-open": "ROB-01", "remote-answers": "ROB-02", "load-late": "HB-04",
    "sdo-echo": "COM-12",
}  # fmt: skip
"""Whose tests a fault meets: requirements that it violates, by the texts of both."""


VCAN = ("socketcan", "vcan0")
MULTICAST = ("udp_multicast", "239.0.0.1:47315")
Bus = tuple[str, str]
"""Interface of python-can, and channel."""


@contextmanager
def keypad(fault: str, bus: Bus) -> Iterator[None]:
    """The independent keypad, ready."""
    interface, channel = bus
    running = subprocess.Popen(
        [sys.executable, "-m", "tests.external.device", "--interface", interface,
         "--channel", channel, "--memory", HOME, "--fault", fault],
        cwd=ROOT, stdout=subprocess.PIPE, text=True,
    )  # fmt: skip
    assert running.stdout is not None
    try:
        if "ready" not in running.stdout.readline():
            raise SystemExit("the device ended before it was ready")
        yield
    finally:
        running.terminate()
        running.communicate()


def judged(fault: str, bus: Bus, options: Sequence[str]) -> Sequence[Mapping[str, Any]]:
    """The suite's result of each test."""
    with tempfile.TemporaryDirectory() as reports, keypad(fault, bus):
        subprocess.run(
            [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider",
             f"--can-interface={bus[0]}", f"--can-iface={bus[1]}", "--can-device=external",
             f"--can-bench={BENCH}", "--can-allow-writes", f"--can-reports={reports}", *options],
            cwd=ROOT, stdout=subprocess.DEVNULL, check=False,
        )  # fmt: skip
        results = json.loads((Path(reports) / "latest" / "results.json").read_text("utf-8"))
        found: Sequence[Mapping[str, Any]] = results["results"]
        return found


def blamed(results: Sequence[Mapping[str, Any]], outcome: str) -> set[str]:
    """The requirements of the verdicts that came out so."""
    verdicts = [each for row in results for each in row["verdicts"]]
    return {each["requirement"] for each in verdicts if each["outcome"] == outcome}


def hunt(fault: str, bus: Bus) -> tuple[str, list[str]]:
    """What the tests of what it violates make of a fault: a word, and the row of the table."""
    began = time.monotonic()
    wanted = VIOLATED[fault].split()
    results = judged(fault, bus, ["-x", *(f"--can-clause={each}" for each in wanted)])
    failed, observed = blamed(results, "failed"), blamed(results, "observation")
    word = "FAIL" if failed else "observation" if observed else "NOT FOUND"
    names = " ".join(sorted(failed or observed))
    seconds = f"{time.monotonic() - began:.0f}"
    row = [fault, FAULTS[fault], VIOLATED[fault], word, names, seconds]
    print(" | ".join(row), file=sys.stderr, flush=True)
    return word, row


def main() -> int:
    """Print the table; status 1 where a fault is not found, or the right device fails."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--fault", action="append", choices=sorted(FAULTS), metavar="NAME")
    parser.add_argument("--right", action="store_true", help="the keypad without a fault, too")
    parser.add_argument("--multicast", action="store_true", help="over udp_multicast")
    chosen = parser.parse_args()
    bus = MULTICAST if chosen.multicast else VCAN
    spared = True
    if chosen.right:
        results = judged("", bus, [])
        failed = [row["test"] for row in results if row["outcome"] in {"failed", "error"}]
        counts = {row["outcome"]: 0 for row in results}
        for row in results:
            counts[row["outcome"]] += 1
        print(f"without a fault: {counts}; failed: {failed or 'none'}", flush=True)
        spared = not failed
    names = chosen.fault or ([] if chosen.right else list(FAULTS))
    found = [hunt(name, bus) for name in names]
    heads = ["fault", "what it does", "violates", "outcome", "blamed", "s"]
    if found:
        show("Faults of the independent keypad", heads, [row for _, row in found])
    words = [word for word, _ in found]
    print(", ".join(f"{word}: {words.count(word)}" for word in sorted(set(words))))
    return int(not spared or "NOT FOUND" in words)


if __name__ == "__main__":
    sys.exit(main())
