"""Ten generic devices in one host process on a vcan: which heartbeat period holds?

    nodeproof vcan --vm -- python -m benchmarks.many_nodes [--nodes 10] [--seconds 60]

`python -m node_model --profile generic --node-id 1-10` hosts devices of an EDS file with a
heartbeat, candump records. All beats of all nodes are due at the same instant. A beat is due
at its node's first instant plus whole periods; how late it came is told by the kernel's
stamp. A period is missed where no beat came before the next one was due. The bar: none in
60 s at 50 ms. Then shorter periods, 10 s each, until one does not hold. Needs can-utils.
"""

from __future__ import annotations

import argparse
import contextlib
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from benchmarks.tables import show
from node_model.node import MS, US, S

CHANNEL = "vcan0"
BAR_MS = 50
SHORTER_MS = (20, 10, 5, 4, 3, 2, 1)
SEARCH_S = 10
WARM_S = 3
"""Not counted: boot-up, and code that runs for the first times."""

EDS = """[FileInfo]
FileName=beating.eds
[DeviceInfo]
ProductName=beating
BaudRate_250=1
[MandatoryObjects]
SupportedObjects=3
1=0x1000
2=0x1001
3=0x1018
[1000]
ParameterName=Device type
DataType=0x0007
AccessType=ro
[1001]
ParameterName=Error register
DataType=0x0005
AccessType=ro
[1018]
ParameterName=Identity
ObjectType=0x9
SubNumber=2
[1018sub0]
ParameterName=Highest sub-index
DataType=0x0005
AccessType=ro
DefaultValue=1
[1018sub1]
ParameterName=Vendor
DataType=0x0007
AccessType=ro
[OptionalObjects]
SupportedObjects=1
1=0x1017
[1017]
ParameterName=Producer heartbeat time
DataType=0x0006
AccessType=rw
DefaultValue={period_ms}
"""

LINE = re.compile(r"\((\d+)\.(\d{6})\) \S+ 7([0-9A-F]{2})#")
"""A heartbeat in a log of candump."""


@dataclass(frozen=True, slots=True)
class Found:
    """What came of a period."""

    period_ms: int
    seconds: float
    late_ns: list[int]
    missed: int
    silent: int
    """Nodes of which nothing came."""
    busy: float
    """Share of the processor that the host took."""

    @property
    def holds(self) -> bool:
        """Each node had a beat in each period."""
        return not self.missed and not self.silent

    def row(self) -> Sequence[str]:
        """For the table."""
        late = sorted(self.late_ns) or [0]
        picks = (late[len(late) // 2], late[min(len(late) * 99 // 100, len(late) - 1)], late[-1])
        return (
            f"{self.period_ms} ms",
            f"{self.seconds:.0f}",
            f"{len(self.late_ns)}",
            f"{self.missed}",
            *(f"{value / US:.0f}" for value in picks),
            f"{self.busy:.0%}",
            "yes" if self.holds else "NO",
        )


@contextlib.contextmanager
def running(command: Sequence[str], say: int) -> Iterator[subprocess.Popen[bytes]]:
    """A program for a while."""
    with subprocess.Popen(command, stdout=say) as process:
        try:
            yield process
        finally:
            process.terminate()


def log_of(nodes: int, period_ms: int, seconds: float, folder: Path) -> tuple[str, float]:
    """What candump saw, and the share of the processor that the host took."""
    sheet = folder / "beating.eds"
    sheet.write_text(EDS.format(period_ms=period_ms), encoding="ascii")
    host = [sys.executable, "-m", "node_model", "--profile", "generic", "--eds", str(sheet)]
    host += ["--node-id", f"1-{nodes}", "--channel", CHANNEL]
    log = folder / "log"
    with (
        log.open("wb") as out,
        running(["candump", "-L", CHANNEL], out.fileno()),
        running(host, subprocess.PIPE) as process,
    ):
        if not process.stdout or not process.stdout.readline():
            raise SystemExit("the host did not start")
        time.sleep(WARM_S)
        began, before = time.monotonic_ns(), _ran_ns(process.pid)
        time.sleep(seconds)
        busy = (_ran_ns(process.pid) - before) / (time.monotonic_ns() - began)
    return log.read_text("ascii"), busy


def _ran_ns(pid: int) -> int:
    """Processor time of a program up to now (proc(5), schedstat)."""
    return int(Path(f"/proc/{pid}/schedstat").read_text("ascii").split()[0])


def judged(log: str, busy: float, nodes: int, period_ms: int, seconds: float) -> Found:
    """How late each beat was, and which periods had none."""
    stamps: dict[int, list[int]] = {node_id: [] for node_id in range(1, nodes + 1)}
    for second, micro, node_id in LINE.findall(log):
        stamps.get(int(node_id, 16), []).append(int(second) * S + int(micro) * US)
    late: list[int] = []
    missed = silent = 0
    for times in stamps.values():
        counted = [(number, at) for number, at in enumerate(times) if at - times[0] >= WARM_S * S]
        if not counted:
            silent += 1
            continue
        period = period_ms * MS
        first = min(at - number * period for number, at in counted)
        own = [at - number * period - first for number, at in counted]
        missed += sum(value >= period for value in own)
        late += own
    return Found(period_ms, seconds, late, missed, silent, busy)


def measured(nodes: int, period_ms: int, seconds: float) -> Found:
    """One run of the host."""
    with tempfile.TemporaryDirectory() as folder:
        log, busy = log_of(nodes, period_ms, seconds, Path(folder))
    return judged(log, busy, nodes, period_ms, seconds)


def main() -> int:
    """Print the table; status 1 where the bar is not kept."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--nodes", type=int, default=10)
    parser.add_argument("--seconds", type=float, default=60)
    options = parser.parse_args()
    results = [measured(options.nodes, BAR_MS, options.seconds)]
    for period_ms in SHORTER_MS:
        if not results[-1].holds:
            break
        print(f"{results[-1].period_ms} ms holds", flush=True)
        results.append(measured(options.nodes, period_ms, min(SEARCH_S, options.seconds)))
    heads = ("period", "s", "beats", "missed", "median us late", "p99", "worst", "busy", "holds")
    show(f"{options.nodes} nodes in one process", heads, [found.row() for found in results])
    return 0 if results[0].holds else 1


if __name__ == "__main__":
    sys.exit(main())
