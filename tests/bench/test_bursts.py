"""In virtual time frames come in bursts; what is recorded and judged is the same as one by one."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import suppress

from hypothesis import example, given, settings
from hypothesis import strategies as st

from hil_tests.bench.keypad import KeypadBench
from hil_tests.bench.virtual import VirtualPort, VirtualStage
from hil_tests.bus.port import BURST
from hil_tests.clock import MS, US, S
from hil_tests.config import load_keypad
from hil_tests.errors import NotAcknowledged
from hil_tests.judge.causal import Seen
from hil_tests.judge.cobs import Nmt, nmt_frame
from hil_tests.judge.verdict import Verdict
from hil_tests.trace import Burst, BusEvent, Entry, EventKind, Sighting
from node_model import devices, faults
from node_model.beacon import Beacon
from node_model.frame import Frame
from node_model.world import World

PROFILE = load_keypad("keypad")
KEYPADS = [
    *(name for name, each in faults.MUTANTS.items() if each.kind == "keypad"),
    *(name for name, each in faults.VARIANTS.items() if each.kind == "keypad"),
]
NAMES = (None, *sorted(KEYPADS))
LOAD = [Frame(0x100 + n, bytes(range(n))) for n in range(9)]


class OneByOne(VirtualPort):
    """Every frame needs a closer look."""

    def burst(self, until: int, most: int = BURST) -> Burst:  # noqa: ARG002  of the contract
        """None, ever."""
        return Burst()


def bench_on(port: VirtualPort, name: str | None) -> KeypadBench:
    """A virtual bench with that device, which takes its frames from that port."""
    stage = VirtualStage(devices.read("keypad", name))
    stage.port = port
    return KeypadBench(stage, PROFILE, PROFILE.factory)


DEEDS: Mapping[str, Callable[[KeypadBench], object]] = {
    "start": lambda bench: bench.post(nmt_frame(Nmt.START, 0)),
    "stop": lambda bench: bench.post(nmt_frame(Nmt.STOP, 1)),
    "reset": lambda bench: bench.nmt(Nmt.RESET_NODE),
    "two": lambda bench: [bench.nmt(Nmt.START, n) for n in (1, 0)],
    "perhaps": lambda bench: bench.post(Frame(0, b"\x81\x01\x00")),
    "beat": lambda bench: bench.post(Frame(0x701, b"\x05")),
    "jam": lambda bench: bench.stage.disturb(),
    "late jam": lambda bench: bench.at(bench.now() + 3 * MS, bench.stage.disturb),
    "load": lambda bench: bench.load(LOAD, 300_000),
    "calm": lambda bench: bench.end_load(),
    "keys": lambda bench: bench.keys and bench.keys.press("k3"),
    "cycle": lambda bench: bench.power and bench.power.cycle(),
}
STEPS = st.lists(
    st.tuples(
        st.sampled_from((0, 1, MS, 20 * MS, 99 * MS, 340 * MS, 3 * S)),
        st.sampled_from(sorted(DEEDS)),
    ),
    min_size=2,
    max_size=12,
)


def judged(
    port: VirtualPort, name: str | None, steps: list[tuple[int, str]]
) -> tuple[list[Entry], list[Seen], list[Verdict]]:
    """The record, when each frame was asked for, and what the monitors found."""
    bench = bench_on(port, name)
    bench.begin()
    bench.fresh(heartbeat_ms=20)
    assert bench.power is not None
    bench.power.on()
    bench.wait(S)
    for wait_ns, deed in steps:
        with suppress(NotAcknowledged):  # a faulty device may run at another bit rate
            DEEDS[deed](bench)
        bench.wait(wait_ns)
    return list(bench.trace.entries()), list(bench.frames_seen()), bench.end()


@settings(max_examples=40)
@given(name=st.sampled_from(NAMES), steps=STEPS)
@example(name=None, steps=[(3 * S, "start"), (3 * S, "beat"), (3 * S, "stop")])
@example(name="heartbeat-too-slow", steps=[(3 * S, "start"), (S, "two")])
@example(name="heartbeat-uneven", steps=[(3 * S, "start"), (3 * S, "load")])
def test_bursts_are_recorded_and_judged_as_one_by_one(
    name: str | None, steps: list[tuple[int, str]]
) -> None:
    """Same entries in the same order, same intervals, same verdicts, whatever was done."""
    bursts = judged(VirtualPort(World()), name, steps)
    singles = judged(OneByOne(World()), name, steps)
    assert list(map(str, bursts[2])) == list(map(str, singles[2]))
    assert bursts == singles


def test_an_error_frame_ends_a_burst_and_stands_in_its_place() -> None:
    """Two frames, the error that destroyed a third, the third; `next` hands out both of these."""
    world = World()
    port = VirtualPort(world)
    beacon = Beacon(9, 10 * MS, world.bit_rate)
    world.act(world.attach(beacon), beacon.power_on)
    world.at(20 * MS + 100 * US, lambda _: world.jam())

    burst = port.burst(S)

    assert burst.instants == [440 * US, 10 * MS + 432 * US]
    assert len(port.burst(S)) == 0
    assert port.next(S) == BusEvent(EventKind.ERROR, 20 * MS + 100 * US)
    assert len(port.burst(S)) == 0
    again = port.next(S)
    assert isinstance(again, Sighting)
    assert again.at == 20 * MS + (100 + 23 * 8 + 432) * US
    assert port.burst(S).instants[0] == 30 * MS + 432 * US


def test_a_burst_ends_at_the_number_of_frames_that_was_asked_for() -> None:
    """Three, and the rest with the next one."""
    world = World()
    port = VirtualPort(world)
    beacon = Beacon(9, 10 * MS, world.bit_rate)
    world.act(world.attach(beacon), beacon.power_on)
    assert len(port.burst(55 * MS, 3)) == 3
    assert len(port.burst(55 * MS, 9)) == 3
    assert len(port.burst(55 * MS, 9)) == 0
    assert port.now() == 55 * MS
