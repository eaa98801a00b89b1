"""Steps that the tests of robustness share: garbage; it obeys, it says nothing but heartbeats."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from itertools import islice

from hil_tests.api import (
    MS,
    Frame,
    Interval,
    KeypadBench,
    Nmt,
    Seen,
    State,
    cobs,
    exactly,
    matchers,
)

LINGER_NS = 50 * MS
"""A frame that is late by its host is no surplus one."""

MULTIPLIER, INCREMENT, MODULUS = 1103515245, 12345, 1 << 31
"""A plain linear congruential sequence (ISO C's example): the same garbage on every bench."""


def services(node_id: int) -> frozenset[int]:
    """Identifiers under which the node is addressed; 4F8h has a test of its own."""
    leds, sdo = (cobs.LED_STEADY + node_id, cobs.LED_BLINK + node_id), 0x600 + node_id
    return frozenset((cobs.NMT, cobs.COMMISSION, *leds, sdo))


def noise() -> Iterator[int]:
    """Numbers without pattern, 0..32767."""
    state = 1
    while True:
        state = (state * MULTIPLIER + INCREMENT) % MODULUS
        yield state >> 16


@cache
def garbage(node_id: int, count: int) -> tuple[Frame, ...]:
    """Data and remote frames of any identifier and length, none addressed to the node.

    An identifier of the device itself is left out, too: two stations that send the same
    one at once are a fault of the bus, not of the device.
    """
    return tuple(islice(_garbage(services(node_id) | cobs.device_ids(node_id)), count))


def _garbage(spared: frozenset[int]) -> Iterator[Frame]:
    numbers = noise()
    while True:
        can_id, kind, length = (next(numbers) for _ in range(3))
        can_id &= 0x7FF
        if can_id in spared:
            continue
        data = bytes(next(numbers) & 0xFF for _ in range(length % 9))
        if kind % 8 == 0:
            yield Frame(can_id, remote=True, dlc=length % 9)
        elif kind % 8 == 1:
            yield Frame(can_id << 18 | kind, data, extended=True)
        elif kind % 8 == 2 and len(data) == 8:
            yield Frame(can_id, data, dlc=8 + length % 8)
        else:
            yield Frame(can_id, data)


def expect_obeys(bench: KeypadBench, requirement: str, reset_by: str = "") -> None:
    """The node obeys NMT.

    Args:
        bench: the bench.
        requirement: that this is, now.
        reset_by: that a reset is answered by boot-up; left out, the same.
    """
    for command, state in ((Nmt.START, State.OPERATIONAL), (Nmt.STOP, State.STOPPED)):
        sent = bench.nmt(command)
        if bench.watch.expected.heartbeat_ns:
            bench.expect_state(state, after=sent, requirement=requirement)
    reset = bench.nmt(Nmt.RESET_NODE)
    bench.expect(
        matchers.boot_up(bench.node_id),
        after=reset,
        within=bench.profile.limits.boot_up_ns,
        requirement=reset_by or requirement,
    )


def obeying(bench: KeypadBench, state: Nmt = Nmt.PRE_OPERATIONAL) -> int:
    """The node obeys before anything is done to it: how many boot-ups that has brought.

    Args:
        bench: the bench.
        state: where a command leads from which it must do so.
    """
    began = bench.now()
    bench.nmt(state)
    expect_obeys(bench, "NMT-04", "NMT-06")
    bench.wait(bench.profile.limits.emcy_ns)
    return len(bench.collect(matchers.boot_up(bench.node_id), after=began, until=bench.now()))


def expect_beats_only(bench: KeypadBench, after: Interval | Seen, spared: int = -1) -> None:
    """Since `after` the node has sent heartbeats and nothing else.

    Where others are on the bus, its own identifiers are looked at.

    Args:
        bench: the bench.
        after: when nothing more was due that had been asked for.
        spared: an identifier of which nothing is said here.
    """
    node_id = bench.node_id
    beat, boot_up = matchers.heartbeat(node_id), matchers.boot_up(node_id)
    who = matchers.any_of(cobs.device_ids(node_id), "frame of the node")
    if bench.stage.exclusive:
        who = matchers.anything()
    found = [
        seen.frame
        for seen in bench.collect(who, after=after, until=bench.now())
        if not beat.accepts(seen.frame) and seen.frame.can_id != spared
    ]
    restarted = any(map(boot_up.accepts, found))
    bench.check(not restarted, "nothing restarts it", requirement="ROB-01", since=after)
    text = "nothing but heartbeats comes" + "".join(f"; {frame} came" for frame in found[:1])
    bench.check(not found, text, requirement="ROB-02", since=after)


def settled(bench: KeypadBench, state: Nmt) -> Interval:
    """The node is in a state, and has said what it says on the way there: since when."""
    bench.nmt(state)
    bench.wait(bench.profile.limits.command_ns + LINGER_NS)
    return exactly(bench.now())
