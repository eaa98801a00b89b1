"""What the benchmarks put on a bus, for the world and for SimPy alike."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, Protocol

from node_model.beacon import Beacon
from node_model.frame import Frame
from node_model.keypad import Keypad, Parameters, load
from node_model.load import Load
from node_model.nmt import NmtCommand
from node_model.node import MS, Frames, Node, S

NODE_ID = 1
SLOW, FAST = 125_000, 1_000_000
"""Bit rates of the keypad's bus and of the crowded one."""

_PROFILE = load()
_PRESS_NS = 500 * MS
"""From a key's press to its release, and on to the next press."""

LOAD_SHARE_PPM = 260_000
"""Asked for by each of four stations: together slightly more than the wire can carry."""


class Wire(Protocol):
    """What a workload needs of `World`, and of its twin in SimPy."""

    def attach(self, node: Node | None = None, *, depth: int = 256) -> Any:
        """Put a node, or with None a tester, on the wire."""

    def act(self, controller: Any, verb: Callable[[int], Frames]) -> None:
        """Tell a node something at this instant."""

    def send(self, controller: Any, frame: Frame) -> None:
        """Queue a frame."""

    def at(self, instant: int, action: Callable[[int], None]) -> None:
        """Put a stimulus on the calendar."""


Build = Callable[[Wire, Any, int], None]
"""Populates a wire; given the tester's station and the span of the run in ns."""


@dataclass(frozen=True, slots=True)
class Workload:
    """A populated bus, how long it runs, and what the project promises for it.

    Args:
        name: for people.
        build: puts nodes and stimuli on the wire.
        span_ns: bus time of one run.
        bit_rate: bit/s.
        heartbeat_ms: period of its nodes; 0 = none.
        simpy_bar: at least so many times as fast as SimPy (the world alone).
        judged_bar: at least this many times real time, with trace and monitors.
        worlds: how many fresh worlds one run goes through.
    """

    name: str
    build: Build
    span_ns: int
    bit_rate: int
    heartbeat_ms: int = 0
    simpy_bar: float | None = None
    judged_bar: float | None = None
    worlds: int = 1


def keypad(heartbeat_ms: int) -> Build:
    """One keypad that nobody touches."""
    profile = replace(_PROFILE, factory=Parameters(NODE_ID, 3, heartbeat_ms, 0, 1))

    def build(wire: Wire, tester: Any, span_ns: int) -> None:  # noqa: ARG001  as every workload
        node = Keypad(profile)
        wire.act(wire.attach(node), node.power_on)

    return build


def pressed_keypad(heartbeat_ms: int) -> Build:
    """One keypad in operational whose key is pressed, and released half a second later."""
    profile = replace(_PROFILE, factory=Parameters(NODE_ID, 3, heartbeat_ms, 0, 1))
    held = (frozenset(("k3",)), frozenset[str]())

    def build(wire: Wire, tester: Any, span_ns: int) -> None:
        node = Keypad(profile)
        station = wire.attach(node)
        wire.act(station, node.power_on)
        start = Frame(0, bytes((NmtCommand.START, NODE_ID)))
        wire.at(200 * MS, lambda _: wire.send(tester, start))
        turn = 0

        def press(now: int) -> None:
            nonlocal turn
            wire.act(station, lambda at: node.hold(held[turn % 2], at))
            turn += 1
            if now + _PRESS_NS < span_ns:
                wire.at(now + _PRESS_NS, press)

        wire.at(S, press)

    return build


def crowd(wire: Wire, tester: Any, span_ns: int) -> None:  # noqa: ARG001  as every workload
    """127 minimal nodes, each with a 10 ms heartbeat."""
    for node_id in range(1, 128):
        node = Beacon(node_id, 10 * MS, FAST)
        wire.act(wire.attach(node), node.power_on)


def full_bus(wire: Wire, tester: Any, span_ns: int) -> None:  # noqa: ARG001  as every workload
    """Four stations that together ask for more than the wire can carry, 8 bytes a frame."""
    for station in range(4):
        frames = [
            Frame(0x100 + 0x40 * i + station, bytes(i * j * 7 + station & 0xFF for j in range(8)))
            for i in range(16)
        ]
        node = Load(frames, LOAD_SHARE_PPM, FAST, seed=station + 1)
        wire.act(wire.attach(node, depth=4), node.power_on)


HOUR = 3600 * S
ALL = (
    Workload("keypad, heartbeat 100 ms", keypad(100), HOUR, SLOW, 100, 5.0, 8 * 3600),
    Workload("keypad, heartbeat 10 ms", keypad(10), HOUR // 10, SLOW, 10),
    Workload("127 nodes, heartbeat 10 ms", crowd, 3 * S, FAST, 10, 2.5, 15),
    Workload("1 Mbit/s full, 8-byte frames", full_bus, 4 * S, FAST, 0, 1.8, 15),
    Workload("fresh world and one second", keypad(100), S, SLOW, 100, worlds=500),
)
PRESSED = Workload("keypad, 100 ms, key presses", pressed_keypad(100), HOUR // 4, SLOW, 100)
FLAT = Workload("keypad, heartbeat 100 ms", keypad(100), 1000 * HOUR, SLOW, 100)
"""As long as anybody wants to look."""
