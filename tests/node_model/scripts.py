"""Scripts that together touch every seam of the keypad: a fault that none shows is none."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace

from node_model.frame import Frame
from node_model.keypad import Parameters, Profile, load
from node_model.node import MS, US
from tests.node_model.driving import Step

PROFILE = load()
BOTH = frozenset(("on_off", "aut"))
NONE: frozenset[str] = frozenset()

Input = frozenset[str] | Frame | bool | None
Script = tuple[Profile, tuple[Step, ...]]


def held(*names: str) -> frozenset[str]:
    """A set of held keys."""
    return frozenset(names)


def nmt(*data: int) -> Frame:
    """A frame with COB-ID 0."""
    return Frame(0, bytes(data))


START, STOP, PRE = nmt(1, 1), nmt(2, 1), nmt(128, 1)


def steps(*timed: tuple[int, Input]) -> tuple[Step, ...]:
    """Waiting times in ms and inputs; at the end two seconds pass."""
    return (*(Step(ms * MS, what) for ms, what in timed), Step(2000 * MS, None))


def factory(**parameters: int) -> Profile:
    """The keypad with other factory parameters."""
    return replace(PROFILE, factory=replace(PROFILE.factory, **parameters))


RUNNING: tuple[tuple[int, Input], ...] = ((0, True), (60, None))
STARTED: tuple[tuple[int, Input], ...] = (*RUNNING, (1100, START))


def commands() -> Iterator[Script]:
    """Every command from every state, well and badly addressed."""
    every = [nmt(c, a) for c in (1, 2, 128, 129, 130) for a in (1, 0, 2, 17)]
    odd = [nmt(1), nmt(5, 1), nmt(1, 1, 0), Frame(0, remote=True, dlc=2), nmt()]
    odd.append(Frame(0, b"\1\1", extended=True))
    for state in (PRE, START, STOP):
        for command in (*every, *odd):
            yield (
                factory(heartbeat_ms=100),
                steps(*RUNNING, (150, state), (150, command), (250, STOP), (50, command)),
            )


def key_moves() -> Script:
    """Presses, releases, pulses and bounces, alone and together, in every state."""
    a, b, ab, last = held("on_off"), held("aut"), BOTH, held("k8")
    return PROFILE, steps(
        (0, a),
        *STARTED,
        (150, NONE),
        (150, a),
        (50, ab),
        (150, b),
        (150, NONE),
        (150, ab),
        (150, NONE),
        (150, a),
        (60, NONE),
        (60, a),
        (60, NONE),
        (150, last),
        (130, held("k8", "k3")),
        (5, last),
        (5, held("k8", "k3")),
        (200, STOP),
        (150, a),
        (150, NONE),
        (150, START),
        (150, a),
        (50, PRE),
        (150, ab),
        (150, START),
        (50, START),
        (20, NONE),
        (30, STOP),
        (5, START),
    )


def led_frames() -> Script:
    """Maps of both kinds in every state, of every length and format."""

    def leds(base: int, *data: int) -> Frame:
        return Frame(base + 1, bytes(data))

    return PROFILE, steps(
        *RUNNING,
        (10, leds(0x200, 0xF1)),
        (10, START),
        (10, leds(0x200, 0x31)),
        (70, leds(0x300, 0x2C)),
        (130, leds(0x300, 0xC3)),
        (130, leds(0x200, 0x00)),
        (250, None),
        (350, leds(0x200, 0x51)),
        (10, leds(0x200, 0x00)),
        (300, None),
        (400, None),
        (10, leds(0x200, 0x05)),
        (10, leds(0x200)),
        (10, leds(0x300, 0x11, 0x22)),
        (10, leds(0x200, 0x04, 0x08)),
        (10, Frame(0x201, remote=True, dlc=1)),
        (10, Frame(0x201, b"\x77", extended=True)),
        (10, Frame(0x202, b"\x12")),
        (10, STOP),
        (10, leds(0x200, 0xAA)),
        (10, START),
        (100, PRE),
        (10, leds(0x300, 0xAA)),
        (100, START),
        (100, nmt(130, 1)),
    )


def foreign_traffic() -> Script:
    """Frames for nobody here, single and in a flood, then keys and commands again."""
    others = (
        Frame(0x080),
        Frame(0x601, bytes(8)),
        Frame(0x702, b"\0"),
        Frame(0x181, remote=True, dlc=1),
        Frame(0x701, remote=True, dlc=1),
        Frame(0x7FF, bytes(8), dlc=15),
        Frame(0x456),
        Frame(0x1ABC, b"\0", extended=True),
        Frame(0x4F8, Parameters(9).encode()),
        *(Frame(0x7E5, bytes((request, *bytes(7)))) for request in (0x04, 0x4C, 0x5E)),
    )
    flood = [Step(900 * US, Frame(0x401, b"\1")) for _ in range(1100)]
    before = steps(
        *RUNNING,
        *((30, frame) for frame in others),
        (500, START),
        *((30, frame) for frame in others),
        (500, held("k3")),
    )
    after = steps((0, held("k4")), (500, STOP), (500, False), (500, True))
    return factory(heartbeat_ms=100), (*before[:-1], *flood[:9], after[0], *flood, *after[1:])


REQUEST = Frame(0x4F8, b"\x0f\x07\x03\xe8\x14\x02")


def commissionings() -> Iterator[Script]:
    """Into commissioning, one message after many others, and out again."""
    into: tuple[tuple[int, Input], ...] = ((0, BOTH), *RUNNING)
    out: tuple[tuple[int, Input], ...] = (
        *((1500, NONE), (0, False), (300, True), (1200, nmt(1, 0))),
        *((300, held("k3")), (1000, nmt(129, 0))),
    )
    before: tuple[Input, ...] = (
        held("on_off"),
        Frame(0x4F9, REQUEST.data),
        Frame(0x601, REQUEST.data),
        Frame(0x080),
        Frame(0x7E5, bytes(8)),
        Frame(0x20F, b"\x05"),
        Frame(0x3F8, remote=True, dlc=6),
        nmt(2, 0),
        nmt(129, 0),
        Frame(0x4F8, remote=True, dlc=6),
        Frame(0x4F8, REQUEST.data, extended=True),
        Frame(0x4F8, REQUEST.data[:5]),
        Frame(0x4F8, b"\x00" + REQUEST.data[1:]),
        Frame(0x4F8, b"\x10" + REQUEST.data[1:]),
        Frame(0x4F8, b"\x11" + REQUEST.data[1:]),
    )
    for what in before:
        yield PROFILE, steps(*into, (20, what), (20, REQUEST), (330, what), (200, what), *out)
    yield PROFILE, steps(*into, (2000, None), *out)
    for data in (b"\x05\x03\x00\x64\x93\x01", b"\x05\x03\x00\x64\x55\x01"):  # the sum is 0
        yield PROFILE, steps(*into, (20, Frame(0x4F8, data)), *out)
    for data in (b"\x01\x01\1\0\0\0\0\0", b"\x0a\x06\x00\x14\x00\x05", b"\x0f\3\0\0\1\1"):
        again = Frame(0x4F8, bytes((3, *data[1:])))
        yield PROFILE, steps(*into, (20, Frame(0x4F8, data)), (300, again), *out)
        cut: tuple[tuple[int, Input], ...] = ((0, False), (0, BOTH), (300, True), (60, again))
        yield PROFILE, steps(*into, (20, REQUEST), (600, None), *cut, (90, False), (0, NONE), *out)
    for keys in (held("on_off"), held("k3", "k4"), held("on_off", "aut", "k3")):
        yield PROFILE, steps((0, keys), *RUNNING, (300, nmt(129, 0)))
    yield PROFILE, steps(*RUNNING, (0, BOTH), (300, nmt(129, 0)))


def parameters() -> Iterator[Script]:
    """Every bit-rate code, and times that are read wrongly somewhere."""
    for code in (0, 1, 2, 3, 4, 5, 6, 7, 200, 255):
        yield factory(bit_rate_code=code), steps(*STARTED)
    for node_id in (9, 15):
        yield factory(node_id=node_id), steps(*RUNNING, (10, nmt(1, 0)), (300, nmt(129, 0)))
        yield factory(node_id=node_id), steps(*RUNNING, (10, nmt(1, node_id)))
    for heartbeat_ms in (0, 1, 10, 15, 256, 1000, 0x10FF, 0x1234, 0xFFFF):
        profile = factory(heartbeat_ms=heartbeat_ms, sync_time=1)
        moves: list[tuple[int, Input]] = [(300, held("k3")), (333, Frame(0x201, b"\1"))]
        long_ms = 70 * min(heartbeat_ms, 1000)
        yield profile, steps(*STARTED, *moves * 4, (200, None), (long_ms, nmt(129, 0)))
    yield factory(sync_time=77), steps(*STARTED)
    for debounce in (0, 12):
        moves = [(2000, held("k3")), (2000, held("k3", "k4")), (1000, NONE)]
        yield factory(debounce=debounce, sync_time=7), steps(*STARTED, *moves)


def long_lives() -> Iterator[Script]:
    """What comes late: the third time, a full counter, the last value of a range."""
    yield factory(heartbeat_ms=10), steps(*STARTED, (12_000, None))
    yield PROFILE, steps(*STARTED, (70_000, None))
    presses: list[tuple[int, Input]] = [(20, held("k3")), (20, NONE)]
    yield factory(debounce=0), steps(*STARTED, *presses * 130)
    yield PROFILE, steps(*RUNNING, *((100, nmt(129 + n % 2, 0)) for n in range(4)))
    yield PROFILE, steps(*STARTED, (100, False), (150, True), (100, START))
    yield PROFILE, steps(*RUNNING, *((2, STOP) for _ in range(201)), (2, PRE))
    flicker = ((2, Frame(0x201, bytes((n & 1,)))) for n in range(210))
    yield PROFILE, steps(*STARTED, *flicker, (20, Frame(0x201, b"\x0f")))
    light: tuple[tuple[int, Input], ...] = ((10, Frame(0x301, b"\x84")), *((45, None),) * 30)
    yield PROFILE, steps(*STARTED, *light)
    for debounce in (130, 255):
        yield factory(debounce=debounce), steps(*STARTED, (100, held("k3")), (30_000, None))
        data = bytes((3, 2, 1, 0, 0, debounce))
        again = ((200, Frame(0x4F8, bytes((n, *data[1:])))) for n in (4, 5, 6))
        begin: tuple[tuple[int, Input], ...] = ((0, BOTH), *RUNNING, (20, Frame(0x4F8, data)))
        yield PROFILE, steps(*begin, *again, (6000, None))


def scripts() -> Iterable[Script]:
    """All of them."""
    return (
        key_moves(),
        led_frames(),
        *parameters(),
        *commissionings(),
        *commands(),
        *long_lives(),
        foreign_traffic(),
    )
