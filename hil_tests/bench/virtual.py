"""The virtual stage: the bundled model on a bit-timed bus, in virtual time.

Time goes on from world to world, so that a test has one continuous trace.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache
from typing import TYPE_CHECKING, Any, Generic, TypeVar

import attrs

from hil_tests.bench.action import (
    BitRateDriver,
    FaultsDriver,
    HealthDriver,
    KeysDriver,
    LedEdges,
    LedsDriver,
    PowerDriver,
)
from hil_tests.bus.port import BURST
from hil_tests.clock import Interval, S, exactly, named
from hil_tests.trace import Burst, BusEvent, EventKind, Sighting
from node_model.controller import Controller
from node_model.devices import Blueprint
from node_model.frame import Frame
from node_model.load import Load
from node_model.node import Panel
from node_model.world import World

if TYPE_CHECKING:
    from hil_tests.config import Setup

T = TypeVar("T")

PAUSE_NS = 1 * S
"""Between two worlds."""

LOAD_DEPTH = 4
"""Mailboxes of a loading station: enough to never leave a gap."""


class VirtualPort:
    """The tester's end of the virtual wire."""

    name = "virtual bus"
    timed = True
    clock = "virtual time, exact"
    doubt_ns = 0

    def __init__(self, world: World) -> None:
        self.enter(world)

    def enter(self, world: World) -> None:
        """Sit at another wire from now on."""
        self.world = world
        self.tester = world.attach(None)
        self._held: Sighting | None = None

    def now(self) -> int:
        """Virtual time in ns."""
        return self.world.now

    def send(self, frame: Frame) -> None:
        """Queue a frame."""
        self.world.send(self.tester, frame)

    def next(self, until: int, also: Sequence[int] = ()) -> Sighting | BusEvent | None:  # noqa: ARG002
        """Run the world up to the next frame."""
        world = self.world
        if world.errors:
            return self._error()
        if self._held is not None:
            held, self._held = self._held, None
            return held
        found = world.next_frame(until)
        if found is None:
            return self._error() if world.errors else None
        frame, at, sender, _ = found
        seen = named(Sighting, (frame, at, 0, sender is self.tester))
        if world.errors:
            self._held = seen
            return self._error()
        return seen

    def burst(self, until: int, most: int = BURST) -> Burst:
        """See BurstPort."""
        world, burst = self.world, Burst()
        if world.errors or self._held is not None:
            return burst
        over = world.gather(until, most, burst, self.tester)
        if world.errors and not over:
            self._held = burst.pop()
        burst.over = over and not world.errors
        return burst

    def _error(self) -> BusEvent:
        """An error frame that went before whatever frame was seen since."""
        return BusEvent(EventKind.ERROR, self.world.errors.pop(0))

    def jam(self) -> None:
        """Put an error frame on the wire."""
        self.world.jam()

    def set_bit_rate(self, bit_rate: int) -> None:
        """The wire's bit rate; a device at another one is deaf and mute."""
        self.world.set_bit_rate(bit_rate)

    def close(self) -> None:
        """Nothing to leave."""


class Done(Generic[T]):
    """An action that is done as soon as it is started, or after a span of virtual time."""

    descriptors: Sequence[int] = ()

    def __init__(self, do: Callable[[], T], after_ns: int = 0) -> None:
        self._do = do
        self._after_ns = after_ns
        self.wake_at = 0

    def start(self, now: int) -> None:
        """Note when it is done."""
        self.wake_at = now + self._after_ns

    def poll(self, now: int) -> bool:
        """Whether its time has come."""
        return now >= self.wake_at

    def result(self) -> T:
        """Do it, now."""
        return self._do()


class VirtualStage:
    """Power, keys, LEDs and errors of a model, exact to the nanosecond.

    Args:
        blueprint: of the device, right, or with a fault or a difference.
        name: of the bench.
    """

    virtual = True
    exclusive = True
    fades = False
    writes_allowed = True
    health: HealthDriver | None = None
    timed_sequences = False
    sees_edges = True

    def __init__(self, blueprint: Blueprint[Any], name: str = "virtual") -> None:
        self._blueprint = blueprint
        self.name = name
        self.bit_rate = 0
        self._memory = lru_cache(lambda setup: blueprint.memory(attrs.asdict(setup)))
        self.port = VirtualPort(World())
        self._enter(0, blueprint.facts.factory.bit_rate, b"")
        device = self.device
        self.power: PowerDriver | None = self
        self.keys: KeysDriver | None = self if device.keys else None
        self.leds: LedsDriver | None = self if device.leds else None
        self.faults: FaultsDriver | None = self if device.faults else None
        self.bitrate: BitRateDriver | None = self

    def _enter(self, now: int, bit_rate: int, image: bytes) -> None:
        world = World(bit_rate, now)
        self.bit_rate = bit_rate
        self.port.enter(world)
        self._loads: list[tuple[Controller, Load]] = []
        self.device: Panel = self._blueprint.make(image)
        self.controller: Controller = world.attach(self.device)

    def renew(self, parameters: Setup) -> bool:
        """A new world with a device that was once set to these parameters."""
        image = self._memory(parameters)
        self._enter(self.port.now() + PAUSE_NS, parameters.bit_rate, image)
        return True

    def load(self, frames: Sequence[Frame], share_ppm: int) -> bool:
        """A loading station joins."""
        world = self.port.world
        load = Load(frames, share_ppm, world.bit_rate)
        controller = world.attach(load, depth=LOAD_DEPTH)
        world.act(controller, load.power_on)
        self._loads.append((controller, load))
        return True

    def end_load(self) -> None:
        """Every loading station falls silent."""
        for controller, load in self._loads:
            self.port.world.act(controller, load.stop)
        self._loads.clear()

    def disturb(self) -> bool:
        """An error frame, now."""
        self.port.jam()
        return True

    # Drivers.

    def switch(self, on: bool) -> Done[Interval]:
        """See PowerDriver."""
        return Done(lambda: self._act(self.device.power_on if on else self.device.power_off))

    def hold(self, held: frozenset[str]) -> Done[Interval]:
        """See KeysDriver."""
        return Done(lambda: self._act(lambda now: self.device.hold(held, now)))

    def fail(self, active: frozenset[str]) -> Done[Interval]:
        """See FaultsDriver."""
        return Done(lambda: self._act(lambda now: self.device.fail(active, now)))

    def sequence(self, steps: Sequence[tuple[int, frozenset[str]]]) -> Done[Sequence[Interval]]:
        """Not needed: the bench steps through a sequence exactly."""
        raise NotImplementedError("a virtual bench plays sequences step by step")

    def _act(self, verb: Callable[[int], Sequence[Frame]]) -> Interval:
        world = self.port.world
        world.act(self.controller, verb)
        return exactly(world.now)

    def set(self, bit_rate: int) -> Done[Interval]:
        """See BitRateDriver."""

        def change() -> Interval:
            self.port.set_bit_rate(bit_rate)
            return exactly(self.port.now())

        return Done(change)

    def read(self) -> Done[Mapping[str, str]]:
        """See LedsDriver: watches for two blink periods."""
        facts = self._blueprint.facts
        span_ns = 2 * (facts.blink_on_ns + facts.blink_off_ns)
        return Watching(self, span_ns, _as_an_eye)

    def watch(self, for_ns: int) -> Done[LedEdges]:
        """See LedsDriver."""
        return Watching(self, for_ns, lambda edges: edges)

    def check(self) -> None:
        """A virtual bench does not break."""

    def close(self) -> None:
        """Nothing to leave."""


class Watching(Done[T]):
    """Looks at the LEDs of a model for a span of virtual time, change by change.

    A lamp changes at an instant that the model has predicted, at a deadline of the model, or
    at an input. At all three the bench looks: each frame on the wire and each planned action
    interrupts its waiting. So every change is seen at its very instant.
    """

    def __init__(self, stage: VirtualStage, for_ns: int, judge: Callable[[LedEdges], T]) -> None:
        super().__init__(lambda: judge(self._edges()), for_ns)
        self._stage = stage
        self._ends_at = 0
        self._began_at = 0
        self._start: list[bool] = []
        self._last: list[bool] = []
        self._found: list[tuple[Interval, str, bool]] = []

    def start(self, now: int) -> None:
        """Begin to look."""
        self._began_at = now
        self._ends_at = now + self._after_ns
        self._start = self._lights(now)
        self._last = self._start
        self._look_again(now)

    def _lights(self, now: int) -> list[bool]:
        device = self._stage.device
        lit = device.lit
        return [lit(led, now) for led in device.leds]

    def _look_again(self, now: int) -> None:
        """At the next change by itself, or when the model does something."""
        device = self._stage.device
        events = (self._ends_at, device.lamp_change(now), device.deadline())
        later = (at for at in events if at is not None and at > now)
        self.wake_at = min(later, default=self._ends_at)

    def poll(self, now: int) -> bool:
        """Note what has changed."""
        lights = self._lights(now)
        if lights != self._last:
            when = exactly(now)
            changes = zip(self._stage.device.leds, lights, self._last, strict=True)
            self._found += [(when, led, lit) for led, lit, was in changes if lit != was]
            self._last = lights
        self._look_again(now)
        return now >= self._ends_at

    def _edges(self) -> LedEdges:
        start = dict(zip(self._stage.device.leds, self._start, strict=True))
        return LedEdges(Interval(self._began_at, self._ends_at), start, self._found)


def _as_an_eye(edges: LedEdges) -> Mapping[str, str]:
    """An LED that changes blinks; another is what it was."""
    blinking = {led for _, led, _ in edges.edges}
    return {
        led: "blink" if led in blinking else "on" if lit else "off"
        for led, lit in edges.start.items()
    }
