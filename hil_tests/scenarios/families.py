"""The families of scenarios: which actions, at which spans, near which limits. Data only."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cache
from typing import NamedTuple

from hil_tests.clock import MS, US
from hil_tests.scenarios.noise import NOISE
from hil_tests.scenarios.values import LSS, TALLIES, VALUES

Given = tuple[tuple[str, int], ...]

SCAN_MS = 10
KEY_FRAME_MS = 20
"""Limits of the default profile; with others the spans are less telling, never wrong."""


class Family(NamedTuple):
    """A kind of scenario.

    Args:
        about: what happens in its scenarios, for people.
        begin: where its scenarios begin.
        givens: what the device is commissioned to, one of these.
        actions: what may be done, see `grammar.Teller`.
        spans: times between the steps in ns, by what the device is commissioned to.
        weight: how often it is walked.
        opening: actions that come before all others.
        closing: actions that come after all others: what shows what was done to the device.
        walk: how many actions a walk has in between.
        sweeps: walks take each of its actions in turn, before they draw some.
    """

    about: str
    begin: str
    givens: tuple[Given, ...]
    actions: tuple[str, ...]
    spans: Callable[[Mapping[str, int]], tuple[int, ...]]
    weight: int = 1
    opening: tuple[str, ...] = ()
    closing: tuple[str, ...] = ()
    walk: int = 20
    sweeps: bool = False

    def codes(self, given: Given) -> int:
        """How many numbers mean something to it."""
        return len(self.actions) * len(self.spans(dict(given)))


def _fixed(*spans_ms: float) -> Callable[[Mapping[str, int]], tuple[int, ...]]:
    spans = tuple(round(span * MS) for span in spans_ms)
    return lambda _: spans


@cache
def _near(debounce: int) -> tuple[int, ...]:
    """Spans on either side of each limit of a key: bounce, scan, debounce time, key frame."""
    time_ms = 100 * debounce
    near = (-SCAN_MS - 2, -SCAN_MS + 2, -2, 2, SCAN_MS - 2, SCAN_MS + 2, SCAN_MS + KEY_FRAME_MS)
    wanted = {1, 3, SCAN_MS - 2, SCAN_MS + 2, 2 * time_ms + 50, 60, *(time_ms + by for by in near)}
    return tuple(sorted(span * MS for span in wanted if span > 0))


def near_limits(given: Mapping[str, int]) -> tuple[int, ...]:
    """Spans near the limits of the keys of a device with that debounce time."""
    return _near(given.get("debounce", 1))


def _givens(**values: Sequence[int]) -> tuple[Given, ...]:
    """One after the other from each list, as often as the longest list is."""
    count = max(map(len, values.values()))
    return tuple(
        tuple((name, row[index % len(row)]) for name, row in values.items())
        for index in range(count)
    )


FLIPS = tuple(f"flip {mask:b}" for mask in (1, 2, 4, 8, 3, 5, 6, 7))
WAYS = ("nmt start", "nmt stop", "nmt pre-operational", "nmt start all", "nmt stop all")
_RESETS = ("nmt reset-node", "nmt reset-communication", "nmt reset-node all")
STRANGE_NMT = (
    "nmt start other",
    "nmt stop other",
    "nmt reset-node other",
    "nmt stop alike",
    "nmt reset-node alike",
    "nmt 04",
    "nmt 05",
    "nmt 40",
    "nmt 84",
    "nmt C1",
    "nmt FF",
    "nmt 00",
    "nmt 03",
    "nmt 7F",
    "nmt 83",
    "nmt 83 all",
    "send 000#01",
    "send 000#02",
    "send 000#81",
    "send 000#",
    "send 000#R2",
    "send 00000000#0200",
    "send 00000000#8100",
)
LED_MAPS = tuple(
    f"{verb} {data}"
    for verb in ("led", "blink")
    for data in ("00", "01", "02", "0F", "55", "AA", "80", "FF")
)
_WATCHES = ("watch 2500ms",) * 8
"""After half of the actions: two blink periods, and what a late light needs."""

_STRANGE_MAPS = (
    *(f"{verb} {data}" for verb in ("led", "blink") for data in ("-", "0F00", "5500000000000000")),
    "send +200#R1",
    "send +300#R1",
    "send +280#FF",
    "send 00000206#FF",
    "send 200#FF",
    "send 300#FF",
)
REQUESTS = tuple(
    f"request {data}"
    for data in (
        "060200320001",
        "0F0200640002",
        "010200C80105",
        "0A0100640A00",
        "070300320001",
        "0B04006400FF",
        "020500640001",
        "030600640001",
        "040001000001",
        "05FF00140000",
        "0907000A0003",
        "0C0200640002AA55",
        "0D0200FF0001",
        "0E02010000FE",
        "080203E80002",
        "06020000FF01",
        "090281000001",
        "040200640050",
    )
)
LONG_SPANS = tuple(
    f"commission {number}"
    for number, request in enumerate(REQUESTS)
    if request[12:16] >= "2000" or request[18:20] >= "20"
)
"""Heartbeats of 8 s and more, debounce times of 3.2 s and more."""

_BAD_REQUESTS = (
    *(
        f"request {data}"
        for data in ("000200320001", "100200320001", "FF0200320001", "0602003200", "06", "-")
    ),
    "send 4F8#R6",
    "send 000004F8#060200320001",
    "send 13E00000#060200320001",
)


_BUSY = (
    *(f"nmt {name}" for name in ("start", "stop", "pre-operational", "reset-node all")),
    "nmt reset-communication",
    "nmt stop all",
    "send 080#",
    "send 080#01",
    "send 100#000000000000",
    "send +600#4000100000000000",
    "send +600#2F171000000A0000",
    "send +600#2B17100014000000",
    "send 601#4018100000000000",
    "send 601#060200320001",
    "send +600#0702003200010000",
    "send 7E5#0401000000000000",
    "send 7E5#1105000000000000",
    "send 7E5#5E00000000000000",
    "send +700#R1",
    "send +180#R1",
    "send +080#R8",
    "send 3F8#R6",
    "send +200#0F",
    "send +300#F0",
    "send +701#00",
    "send 77F#00",
    "send +701#04",
    "send 123#060200320001",
    "send 3F8#060200320001",
    "send 4F9#060200320001",
    "send 1F8#060200320001",
)
"""What may be sent to a node that is about something else."""

_REVEALS = ("cycle", "flip 1", "nmt start", "wait", "flip 1")
"""A regular start, its state and its keys: shows what the node has stored."""

_LOADS = ("load 60% high", "load 90% high", "load 100% high", "load 60% low", "load 100% low")

_PANEL = _givens(debounce=(1, 0, 2, 5, 1, 3), node_id=(6, 1, 15, 6, 10, 8), heartbeat_ms=(1000, 0))
_QUICK = _givens(heartbeat_ms=(50, 20, 100, 30), node_id=(6, 15, 1), debounce=(1, 0, 2))
_SHORT = _givens(heartbeat_ms=(10, 20, 10), node_id=(6, 15), debounce=(0, 1))
_STRANGE = _givens(debounce=(7, 13, 23), heartbeat_ms=(70, 130), node_id=(14, 3))
"""Nobody would take another debounce time for one of these: what was kept shows."""

_TALLY = _givens(heartbeat_ms=(50, 100), debounce=(0, 1))
_CALM = _givens(heartbeat_ms=(200, 100, 500), node_id=(6, 15, 1), debounce=(1, 0, 2))
"""Where seconds are spent on looking at LEDs, beats tell nothing new and cost most."""

FAMILIES: Mapping[str, Family] = {
    "keys": Family(
        "keys that bounce near the debounce time",
        "operational", _PANEL, FLIPS, near_limits, 8),
    "comings": Family(
        "the same, while the node leaves and enters operational",
        "operational", _PANEL, (*FLIPS, *WAYS, *WAYS[:2], _RESETS[0]), near_limits, 8
    ),
    "commands": Family(
        "NMT commands to anybody, and frames that look like some",
        "pre-operational",
        _QUICK,
        (*WAYS, *WAYS, *_RESETS, *STRANGE_NMT, "flip 1"),
        _fixed(0, 1, 15, 45, 55, 110, 160),
        8,
    ),
    "starts": Family(
        "power cycles and resets, keys held or not",
        "off",
        _CALM,
        ("cycle", *WAYS[:3], *_RESETS, *FLIPS[:5], "led FF", "look"),
        _fixed(1, 20, 60, 120, 400),
        3,
        ("cycle",),
    ),
    "lights": Family(
        "LED frames of every kind, and looks at the LEDs",
        "operational",
        _CALM,
        (*LED_MAPS, *_STRANGE_MAPS, *WAYS[:3], *_RESETS[:2], "look", "look", "look", "flip 1"),
        _fixed(0, 5, 60, 700),
        3,
    ),
    "glows": Family(
        "LED frames, and every change of light after them",
        "operational",
        _CALM,
        (*LED_MAPS, *_WATCHES),
        _fixed(0, 5, 430),
        2,
        walk=6,
    ),
    "waits": Family(
        "everything but a valid request to a node that waits to be commissioned",
        "off",
        _QUICK,
        (*_BAD_REQUESTS, *_BAD_REQUESTS, *_BUSY, *LSS, *NOISE, *FLIPS[2:4], "flip 1",
         *REQUESTS[:3], "shine"),
        _fixed(0, 1, 20, 150),
        4,
        ("wait-mode",),
        _REVEALS,
    ),
    "echoes": Family(
        "one request, and everything else while it is echoed",
        "off",
        _QUICK,
        (*REQUESTS, *_BAD_REQUESTS, *_BUSY, *_BUSY, *NOISE[:32], *FLIPS[:4], "wait",
         "shine", "shine"),
        _fixed(0, 1, 20, 101, 350, 2500),
        4,
        ("wait-mode", "any-request"),
        _REVEALS,
    ),
    "memories": Family(
        "commissioned again and again, cut off while it stores",
        "off",
        (*_QUICK, *_PANEL[:2]),
        (
            *(f"commission {number}" for number in range(len(REQUESTS))),
            *(f"cut {number}" for number in (3, 5, 11, 12)),
            *(f"cut {number}" for number in (3, 5, 11, 12)),
            "cycle", "wait-mode", "flip 1", "nmt start", "nmt start", "nmt reset-node", "wait",
            "linger", "linger",
        ),
        lambda _: tuple(
            span * US for span in (0, 300, 1_000, 2_200, 5_000, 7_000, 20_000, 50_000, 600_000)
        ),
        3,
        ("cycle",),
        _REVEALS,
    ),
    "spans": Family(
        "the longest heartbeats and debounce times",
        "off",
        _STRANGE,
        ("linger", "flip 1", "nmt start", "flip 10", "wait", *LONG_SPANS),
        _fixed(60, 150, 300),
        1,
        ("cycle", "any-long-span", "nmt start"),
        ("flip 1", "linger", "flip 1", "linger"),
        walk=8,
    ),
    "values": Family(
        "parameters of special values, and every value of each of their bytes",
        "off",
        _STRANGE,
        tuple(f"value {number}" for number in range(VALUES)),
        _fixed(20),
        4,
        walk=2,
        sweeps=True,
    ),
    "tallies": Family(
        "one thing, hundreds of times",
        "operational",
        _TALLY,
        tuple(f"again {number}" for number in range(len(TALLIES))),
        lambda given: tuple((100 * given["debounce"] + by) * MS for by in (35, 60, 110)),
        1,
        closing=("led 5A", "look", *_REVEALS[1:]),
        walk=1,
        sweeps=True,
    ),
    "noise": Family(
        "garbage of every identifier, length and type",
        "operational",
        _QUICK,
        (*NOISE, *_BUSY, *LSS, *WAYS[:3], *FLIPS[:3], *REQUESTS, "cycle", *(("flood",) * 6)),
        _fixed(0, 0.2, 3, 55),
        6,
        closing=_REVEALS,
    ),
    "loads": Family(
        "a busy bus",
        "operational",
        _QUICK,
        (*_LOADS, "load off", "load off", *FLIPS[:5], *WAYS[:3]),
        _fixed(1, 12, 60, 130),
        1,
    ),
    "long": Family(
        "little happens for a long time",
        "operational",
        _SHORT,
        ("wait", "wait", *FLIPS[:2], "flip 11", "nmt stop", "nmt start", "led 01", "look"),
        _fixed(110, 700, 3_000, 12_000),
        1,
        walk=6,
    ),
    "rates": Family(
        "the tester at other bit rates",
        "operational",
        _QUICK,
        ("rate 500000", "rate 20000", "rate own", "rate own", *FLIPS[:3], *WAYS[:3], "cycle"),
        _fixed(5, 60, 300),
        2,
    ),
    "everything": Family(
        "all of these",
        "operational",
        (*_QUICK, *_PANEL),
        (
            *FLIPS, *FLIPS, *WAYS, *WAYS, *_RESETS, *STRANGE_NMT, *LED_MAPS, *_STRANGE_MAPS,
            *NOISE[:24], "look", "look", "look", "look", "cycle", "cycle",
            *(f"commission {number}" for number in range(4)),
        ),
        near_limits,
        5,
        closing=_REVEALS,
    ),
}  # fmt: skip


@cache
def turns() -> tuple[str, ...]:
    """Families in the order in which walks take them, each as often as it weighs."""
    most = max(family.weight for family in FAMILIES.values())
    return tuple(
        name for turn in range(most) for name, family in FAMILIES.items() if family.weight > turn
    )
