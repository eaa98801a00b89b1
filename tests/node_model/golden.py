"""A fixed scenario whose every frame is the same on every machine, and its hash.

Run as a script it prints the hash; it needs nothing but the model and the standard library.
"""

from __future__ import annotations

import hashlib
import struct
import sys
from dataclasses import replace
from functools import partial

from node_model.beacon import Beacon
from node_model.frame import Frame
from node_model.keypad import Keypad, Parameters, load
from node_model.load import Load
from node_model.node import MS, Frames, Node, S
from node_model.world import World

RATE = 250_000


def golden_trace() -> str:
    """A keypad, three beacons and 30 % of load on one wire for 10 s.

    Keys are moved and NMT commands sent all the while.

    Returns:
        sha256 over end, head, number of data bytes and data of every frame, in order.
    """
    world = World(RATE)
    tester = world.attach()
    pad = Keypad(replace(load(), factory=Parameters(heartbeat_ms=100)))
    load_frames = [Frame(0x100 + n, bytes(range(n))) for n in range(9)]
    panel = world.attach(pad)
    world.act(panel, pad.power_on)
    neighbours: list[Node] = [Beacon(10 * n, 70 * n * MS + n, RATE) for n in (1, 2, 3)]
    for node in (Load(load_frames, 300_000, RATE), *neighbours):
        world.act(world.attach(node), node.power_on)

    def hold(held: frozenset[str], now: int) -> Frames:
        return pad.hold(held, now)

    def press(held: frozenset[str], _: int) -> None:
        world.act(panel, partial(hold, held))

    def command(specifier: int, _: int) -> None:
        world.send(tester, Frame(0, bytes((specifier, 1))))

    for n in range(30):
        world.at(n * 300 * MS, partial(press, frozenset(("k3", "k4", "k5")[: n % 4])))
        world.at(n * 333 * MS + 1, partial(command, (1, 1, 128, 1, 2, 1, 129)[n % 7]))
    digest = hashlib.sha256()
    while (found := world.next_frame(10 * S)) is not None:
        frame, at, _, _ = found
        digest.update(struct.pack("<QQB", at, frame.head, len(frame.data)) + frame.data)
    return digest.hexdigest()


if __name__ == "__main__":
    sys.stdout.write(golden_trace() + "\n")
