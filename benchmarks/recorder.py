"""What the recorder loses on a vcan, beside what programs in C sustain there.

First the highest rate is looked for that `cangen` and `candump` with a large buffer sustain
without loss. Half of it, evenly paced, is then recorded by our port into a trace and a file:
nothing may be lost. At last frames come flat out: what is lost must be counted and marked,
each loss in the place where it happened.

    nodeproof vcan --vm -- python -m benchmarks.recorder [--seconds 60] [--rate N]

Needs can-utils, gcc and a vcan0. The frames carry their number, so a loss is seen in any case.
"""

from __future__ import annotations

import argparse
import contextlib
import struct
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from benchmarks.tables import show
from hil_tests.bus.socketcan import SocketCanPort
from hil_tests.clock import MS, S
from hil_tests.reporting.pcapng import PcapngSink
from hil_tests.trace import BusEvent, EventKind, Sighting, Trace

CHANNEL = "vcan0"
CAN_ID = "123"
BUFFER = 8 << 20
"""Bytes, as our port asks for."""
GAPS_MS = (0.5, 0.2, 0.1, 0.05, 0.02, 0.01, 0.0)
"""Of cangen, one after the other, until something is lost."""
PROBE_S = 3
QUIET_MS = 1000
"""Candump ends when nothing has come for that long."""
FULL_BUS = 8000
"""Frames of eight bytes a second on a full bus at 1 Mbit/s, with usual stuffing."""
LOOK_NS = 500 * MS
"""How often to look whether the sender has ended."""
HEAD = struct.Struct(">II")
PACKET = 6
FRAME_BYTES = 60
"""Of an enhanced packet that holds a frame of eight bytes: its data begin at 36."""


SENDER = r"""
#include <linux/can.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

/* CHANNEL COUNT GAP_NS: numbered frames, each due at its own instant; then, 1 s later, a last. */
int main(int argc, char **argv)
{
    long count = atol(argv[2]), gap = atol(argv[3]);
    struct sockaddr_can address = { .can_family = AF_CAN,
                                    .can_ifindex = if_nametoindex(argv[1]) };
    struct can_frame frame = { .can_id = 0x123, .can_dlc = 8 };
    struct timespec due, began, ended;
    int wire = socket(PF_CAN, SOCK_RAW, CAN_RAW);
    if (argc != 4 || bind(wire, (struct sockaddr *)&address, sizeof address))
        return 2;
    setsockopt(wire, SOL_CAN_RAW, CAN_RAW_FILTER, NULL, 0);
    clock_gettime(CLOCK_MONOTONIC, &due);
    began = due;
    for (long number = 0; number <= count; number++) {
        long wait = number < count ? gap : 1000000000L;
        due.tv_nsec += wait % 1000000000L;
        due.tv_sec += wait / 1000000000L + due.tv_nsec / 1000000000L;
        due.tv_nsec %= 1000000000L;
        if (number == count) {
            clock_gettime(CLOCK_MONOTONIC, &ended);
            sleep(1);
        } else if (gap) {
            clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &due, NULL);
        }
        memcpy(frame.data, &number, 8);
        if (write(wire, &frame, sizeof frame) != sizeof frame)
            return 3;
    }
    printf("%ld\n", (ended.tv_sec - began.tv_sec) * 1000000000L + ended.tv_nsec - began.tv_nsec);
    return 0;
}
"""


@dataclass(frozen=True)
class Probe:
    """What cangen and candump did at one gap."""

    gap_ms: float
    sent: int
    received: int
    span_s: float

    @property
    def rate(self) -> float:
        """Frames a second."""
        return self.sent / self.span_s


@dataclass(frozen=True)
class Recording:
    """What our port recorded of numbered frames."""

    sent: int
    span_s: float
    recorded: int
    counted: int
    gaps: int
    misplaced: int
    in_file: int

    @property
    def kept(self) -> bool:
        """Every frame is recorded or counted, each loss marked in its place, in the file too."""
        whole = self.recorded + self.counted == self.sent
        return whole and not self.misplaced and self.in_file == self.recorded


def probe(gap_ms: float, folder: Path) -> Probe:
    """Send with cangen for some seconds and count what candump logs."""
    count = int(PROBE_S / (gap_ms / 1000 + 0.00005))
    log = folder / "candump.txt"
    with log.open("wb") as out:
        dump = subprocess.Popen(
            ["candump", "-r", str(BUFFER), "-T", str(QUIET_MS), "-L", CHANNEL], stdout=out
        )
        time.sleep(0.3)
        began = time.monotonic()
        command = ["cangen", CHANNEL, "-g", str(gap_ms), "-I", CAN_ID, "-L", "8", "-D", "i"]
        subprocess.run([*command, "-n", str(count)], check=True)
        sent_s = time.monotonic() - began
        dump.wait()
        # What candump had only buffered when cangen ended was not sustained: it counts until
        # the last frame was logged.
        span = max(sent_s, time.monotonic() - began - QUIET_MS / 1000)
    with log.open("rb") as found:
        received = sum(1 for _ in found)
    log.unlink()
    return Probe(gap_ms, count, received, span)


def highest(folder: Path) -> tuple[Probe, list[Probe]]:
    """The fastest probe without loss, and all that were made."""
    made: list[Probe] = []
    best: Probe | None = None
    for gap_ms in GAPS_MS:
        progress(f"cangen -g {gap_ms:g} and candump")
        made.append(probe(gap_ms, folder))
        if made[-1].received < made[-1].sent:
            break
        if best is None or made[-1].rate > best.rate:
            best = made[-1]
    if best is None:
        raise SystemExit("cangen and candump lose frames at every rate")
    return best, made


def progress(text: str) -> None:
    """Say on standard error what goes on: the machine is slow."""
    print(text, file=sys.stderr, flush=True)


def build(folder: Path) -> Path:
    """Compile the sender."""
    source = folder / "sender.c"
    source.write_text(SENDER, encoding="ascii")
    program = folder / "sender"
    subprocess.run(["gcc", "-O2", "-o", str(program), str(source)], check=True)
    return program


def record(sender: Path, count: int, gap_ns: int, folder: Path) -> Recording:
    """Record `count` numbered frames and the one that ends them."""
    progress(f"recording {count} frames, {gap_ns} ns apart")
    path = folder / "trace.pcapng"
    with (
        contextlib.closing(SocketCanPort(CHANNEL)) as port,
        PcapngSink(path, interface=port.name, clock=port.clock, flush=False) as sink,
    ):
        trace = Trace(sink)
        process = subprocess.Popen(
            [str(sender), CHANNEL, str(count), str(gap_ns)], stdout=subprocess.PIPE, text=True
        )
        drain(port, trace, process)
        said = process.communicate()[0]
        if process.returncode:
            raise SystemExit(f"the sender ended with status {process.returncode}")
    events = [each for each in trace.events() if each.kind is EventKind.GAP]
    in_file, misplaced = walk(path.read_bytes(), events, count)
    path.unlink()
    return Recording(
        sent=count + 1,
        span_s=int(said) / S,
        recorded=len(trace),
        counted=sum(each.lost for each in events),
        gaps=len(events),
        misplaced=misplaced,
        in_file=in_file,
    )


def drain(port: SocketCanPort, trace: Trace, sender: subprocess.Popen[str]) -> None:
    """Record all that comes until the sender has ended."""
    see, note, receive, gather = trace.see, trace.note, port.next, port.gather
    ended = False
    while not ended:
        ended = sender.poll() is not None
        until = port.now() + LOOK_NS
        while (item := receive(until)) is not None:
            if isinstance(item, Sighting):
                see(item)
            else:
                note(item)
            while (columns := gather()) is not None:
                trace.extend(columns)


def walk(content: bytes, events: Sequence[BusEvent], count: int) -> tuple[int, int]:
    """Go through the file: frames in it, and jumps of their numbers that no gap tells.

    A gap must stand where the numbers jump, and tell by how much.
    """
    told = iter(events)
    frames = expected = lost = wrong = place = 0
    while place < len(content):
        kind, size = HEAD.unpack_from(content, place)
        if kind == PACKET and size == FRAME_BYTES:
            number = int.from_bytes(content[place + 36 : place + 44], "little")
            wrong += number != expected + lost
            expected, lost = number + 1, 0
            frames += 1
        elif kind == PACKET:
            lost += next(told).lost
        place += size
    return frames, wrong + (expected != count + 1)


def main() -> int:
    """Print the tables; status 1 where a bar is not kept."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--seconds", type=int, default=60, help="of paced traffic")
    parser.add_argument("--rate", type=float, help="of the paced frames a second; else looked for")
    parser.add_argument("--overload", type=int, default=100_000, help="frames flat out")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        progress("compiling the sender")
        sender = build(folder)
        rate = options.rate
        if rate is None:
            best, made = highest(folder)
            show(
                "cangen and candump",
                ("gap", "frames/s", "sent", "lost"),
                [
                    (f"{p.gap_ms:g} ms", f"{p.rate:.0f}", str(p.sent), str(p.sent - p.received))
                    for p in made
                ],
            )
            rate = best.rate / 2
            print(f"highest rate without loss {best.rate:.0f} frames/s; half of it: {rate:.0f}")
        record(sender, 200, MS, folder)  # warm-up
        gap_ns = round(S / rate)
        paced = record(sender, round(options.seconds * rate), gap_ns, folder)
        rows = {f"paced, {rate:.0f}/s": paced}
        if options.rate is None:
            full = record(sender, options.seconds * FULL_BUS, S // FULL_BUS, folder)
            rows["full bus, 1 Mbit/s"] = full
        flat_out = record(sender, options.overload, 0, folder)
        rows["flat out"] = flat_out
    return report(rows, paced, flat_out)


def report(rows: Mapping[str, Recording], paced: Recording, flat_out: Recording) -> int:
    """Print what was recorded beside the bars."""
    heads = ("our port, trace and file", "s", "frames/s", "sent", "recorded", "counted lost")
    cells = [
        (
            name,
            f"{each.span_s:.1f}",
            f"{each.sent / each.span_s:.0f}",
            *(str(n) for n in (each.sent, each.recorded, each.counted, each.gaps, each.misplaced)),
        )
        for name, each in rows.items()
    ]
    show("Recorded over vcan", (*heads, "gaps", "misplaced"), cells)
    none = paced.kept and paced.recorded == paced.sent
    told = all(each.kept for each in rows.values()) and flat_out.counted > 0
    print(f"of the paced frames none lost: {'yes' if none else 'NO'}")
    print(f"at overload every loss counted and marked: {'yes' if told else 'NO'}")
    return 0 if none and told else 1


if __name__ == "__main__":
    sys.exit(main())
