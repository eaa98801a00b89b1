"""127 devices made from an EDS file on one wire: heartbeats of 10 ms, a PDO for each SYNC.

    python -m benchmarks.many_devices

Figures are medians of five, in processor time. Ends with status 1 where the order of the
frames is not the one that arbitration makes.
"""

from __future__ import annotations

import statistics
import sys
import time
from functools import partial

from node_model import devices
from node_model.frame import Frame
from node_model.nmt import NmtCommand
from node_model.node import MS, S
from node_model.sheets import shipped
from node_model.world import World

NODE_IDS = range(1, 128)
BIT_RATE = 1_000_000
HEARTBEAT_MS = 10
CYCLE_NS = 100 * MS
START_NS = 200 * MS
AFTER_BEATS_NS = 8 * MS
"""The heartbeats of all, asked for at once, take 7.4 ms: a SYNC then finds an idle wire. A
controller sends what it was given in that order, so that a PDO would wait for its node's beat."""
SPAN_NS = 5 * S
RUNS = 5
SYNC, PDO_BASE, HEARTBEAT_BASE = 0x080, 0x180, 0x700

Heard = list[tuple[int, Frame]]


def crowded(span_ns: int) -> World:
    """A wire with all of them, operational, and a master that sends SYNCs."""
    blueprint = devices.read("generic", eds=shipped("drive.eds"))
    world = World(BIT_RATE)
    master = world.attach()
    for node_id in NODE_IDS:
        settings = {"node_id": node_id, "bit_rate": BIT_RATE, "heartbeat_ms": HEARTBEAT_MS}
        device = blueprint.make(blueprint.memory(settings))
        world.act(world.attach(device), device.power_on)

    def send(frame: Frame, _: int) -> None:
        world.send(master, frame)

    world.at(START_NS, partial(send, Frame(0, bytes((NmtCommand.START, 0)))))
    for at in range(2 * START_NS + AFTER_BEATS_NS, span_ns, CYCLE_NS):
        world.at(at, partial(send, Frame(SYNC)))
    return world


def listened(world: World, span_ns: int) -> Heard:
    """Every frame with its end."""
    heard = []
    while (found := world.next_frame(span_ns)) is not None:
        heard.append((found[1], found[0]))
    return heard


def faults_of(heard: Heard) -> list[str]:
    """What is not as arbitration and the periods make it.

    After a SYNC the PDOs follow at once, lowest identifier first, and no heartbeat goes
    between them; each device beats once a period.
    """
    found = []
    ids = [frame.can_id for _, frame in heard]
    wanted = [PDO_BASE + node_id for node_id in NODE_IDS]
    for place in (n for n, can_id in enumerate(ids) if can_id == SYNC):
        follows = ids[place + 1 : place + 2 + len(wanted)]
        pdos = [can_id for can_id in follows if can_id < HEARTBEAT_BASE][: len(wanted)]
        begun = follows.index(wanted[0]) if wanted[0] in follows else len(follows)
        if pdos != wanted or begun > 1:
            found.append(f"after the SYNC at {heard[place][0]} ns come {follows[:5]}...")
    beats = sum(can_id >= HEARTBEAT_BASE for can_id in ids)
    expected = len(NODE_IDS) * (SPAN_NS - 60 * MS) // (HEARTBEAT_MS * MS)
    if abs(beats - expected) > 2 * len(NODE_IDS):
        found.append(f"{beats} heartbeats and boot-ups instead of {expected}")
    return found


def main() -> int:
    """Measure and print."""
    seconds, heard = [], []
    for _ in range(RUNS):
        world = crowded(SPAN_NS)
        began = time.process_time()
        heard = listened(world, SPAN_NS)
        seconds.append(time.process_time() - began)
    middle = statistics.median(seconds)
    faults = faults_of(heard)
    rate = SPAN_NS / S / middle
    print(f"{len(NODE_IDS)} devices of an EDS, heartbeat {HEARTBEAT_MS} ms, a PDO each SYNC")
    print(f"  frames in {SPAN_NS // S} s on the bus   {len(heard)}")
    print(f"  us a frame               {middle / len(heard) * 1e6:.2f}")
    print(f"  times real time          {rate:.1f}")
    print(f"  bus hours a second       {rate / 3600:.5f}")
    print(f"  order of the frames      {'as arbitration makes it' if not faults else 'WRONG'}")
    for fault in faults[:5]:
        print(f"    {fault}")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
