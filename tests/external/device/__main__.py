r"""A keypad node written by an outsider, from the Italian source and the control protocol alone.

It shares nothing with the bundled model: a firmware-like main loop, keys that are sampled on a
grid of 5 ms and counted, heartbeats on a timer that the reset starts. The suite must accept it
as it is, and must blame each of its faults (``--fault NAME``; ``--fault list`` names them).

    python -m tests.external.device --channel vcan0 --control tcp:127.0.0.1:5555
    python -m tests.external.device --interface udp_multicast --channel 239.0.0.1:43113 \
        --control unix:/tmp/k

It prints one line when it is ready, and one each time when its memory is written.
"""

from __future__ import annotations

import argparse
import contextlib
import os
import select
import signal
import sys
import time
from typing import Any

from tests.external.device.control import Bench
from tests.external.device.faults import FAULTS
from tests.external.device.firmware import Keypad, Parameters, say
from tests.external.device.wires import Line, PythonCan, SocketCan


def serve(device: Keypad, bench: Bench) -> None:
    """The main loop."""
    while True:
        pause = max(0, device.due() - time.monotonic_ns()) / 1e9
        watched: list[Any] = [device.line, bench.listener]
        if bench.peer is not None:
            watched.append(bench.peer)
        ready, _, _ = select.select(watched, [], [], min(pause, 3600))
        device.run(time.monotonic_ns())
        if device.line in ready:
            for frame in device.line.drain():
                now = time.monotonic_ns()
                device.run(now)
                device.receive(frame, now)
        if bench.listener in ready:
            bench.accept()
        elif bench.peer in ready:
            bench.read()


def main() -> None:
    """Read the command line and be a keypad until killed."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--interface", default="socketcan")
    parser.add_argument("--channel", default="vcan0")
    parser.add_argument("--control", default="tcp:127.0.0.1:5555", metavar="ADDRESS")
    parser.add_argument("--same-clock", action="store_true", help="vouch for the clock")
    parser.add_argument("--memory", default="1,2,1000,0,1", metavar="ID,CODE,MS,SYNC,DEBOUNCE")
    parser.add_argument("--on", action="store_true", help="powered from the start")
    parser.add_argument("--fault", default="", choices=["", "list", *FAULTS], metavar="NAME")
    given = parser.parse_args()
    if given.fault == "list":
        for name, text in FAULTS.items():
            say(f"{name:18}", text)
        return
    line: Line = (
        SocketCan(given.channel)
        if given.interface == "socketcan"
        else PythonCan(given.interface, given.channel)
    )
    device = Keypad(line, Parameters(*map(int, given.memory.split(","))), given.fault)
    bench = Bench(device, given.control, given.same_clock)
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(0))
    with contextlib.suppress(OSError, AttributeError):  # no right to: then without
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(10))
    if given.on:
        device.power(True, time.monotonic_ns())
    say("ready")
    with contextlib.suppress(KeyboardInterrupt):
        serve(device, bench)


if __name__ == "__main__":
    main()
