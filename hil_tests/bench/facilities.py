"""The facilities that tests ask for by name: power, keys, leds, faults, bitrate.

Each carries out an action through its driver while the bus is read on, and puts what was
done into the trace as a moment: the interval in which it took effect.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from hil_tests.bench import chronicle
from hil_tests.bench.action import (
    BitRateDriver,
    FaultsDriver,
    KeysDriver,
    LedEdges,
    LedsDriver,
    PowerDriver,
)
from hil_tests.trace import Moment

if TYPE_CHECKING:
    from hil_tests.bench.core import BenchCore
    from hil_tests.config import DeviceFault


class Power:
    """The supply of the device."""

    def __init__(self, bench: BenchCore, driver: PowerDriver) -> None:
        self._bench = bench
        self._driver = driver
        self.is_on: bool | None = None
        self._off_since: int | None = None

    def on(self) -> Moment:
        """Supply on; the keys held now decide how the device starts."""
        bench = self._bench
        if self._off_since is not None:
            bench.wait_until(self._off_since + bench.profile.limits.power_off_ns)
        # The device may have booted long before the driver says that it is on.
        when = bench.carry_out(self._driver.switch(on=True), withhold=True)
        self.is_on = True
        held = sorted(bench.held)
        detail = {"on": True, "mode": bench.start_mode(), "held": held}
        return bench.note(Moment("power", when.earliest, when.latest, detail))

    def off(self) -> Moment:
        """Supply off; a board that lives on for a while is given the time to die."""
        bench = self._bench
        when = bench.carry_out(self._driver.switch(on=False))
        self.is_on = False
        self._off_since = when.latest
        moment = bench.note(Moment("power", when.earliest, when.latest, {"on": False}))
        bench.wait(bench.watch.expected.fade_ns)
        return moment

    def standing(self) -> dict[str, object]:
        """Whether it is on, and since when it is off; None = not known."""
        return {"on": self.is_on, "off_since": self._off_since}

    def stand(self, is_on: bool | None, off_since: int | None) -> None:
        """A recording begins here: so it stood."""
        self.is_on = is_on
        self._off_since = off_since

    def forget(self) -> None:
        """Another device is there now, without power and free to be switched on."""
        self.is_on = False
        self._off_since = None

    def cycle(self) -> Moment:
        """Off, for at least the time that the profile asks for, and on again."""
        self.off()
        return self.on()


class Keys:
    """The keys of the device."""

    def __init__(self, bench: BenchCore, driver: KeysDriver, bits: Mapping[str, int]) -> None:
        self._bench = bench
        self._driver = driver
        self._bits = bits
        self.held: frozenset[str] = frozenset()
        self.names: tuple[str, ...] = tuple(sorted(bits, key=bits.__getitem__))
        """All keys of the profile, in bit order."""

    @property
    def mask(self) -> int:
        """The keys held now, as bits of the key frame."""
        return sum(1 << self._bits[name] for name in self.held)

    def hold(self, *names: str) -> Moment:
        """From now on exactly these keys are held."""
        held = frozenset(names)
        bench = self._bench
        when = bench.carry_out(self._driver.hold(held))
        self.held = held
        detail = {"held": sorted(held)}
        return bench.note(Moment("keys", when.earliest, when.latest, detail))

    def press(self, *names: str) -> Moment:
        """Hold these keys besides those that are held."""
        return self.hold(*(self.held | set(names)))

    def release(self, *names: str) -> Moment:
        """Let go of these keys; of all, where none is named."""
        return self.hold(*(self.held - set(names) if names else ()))

    def sequence(self, steps: Sequence[tuple[int, frozenset[str]]]) -> list[Moment]:
        """Play sets of held keys at spans in ns from the first step.

        Where the bench cannot play it by itself each step is an action of its own, at the
        earliest at its instant.
        """
        bench = self._bench
        if not self._driver.timed_sequences:
            return self._step_by_step(steps)
        moments = []
        intervals = bench.carry_out(self._driver.sequence(steps))
        for when, (_, held) in zip(intervals, steps, strict=True):
            detail = {"held": sorted(held)}
            moments.append(bench.note(Moment("keys", when.earliest, when.latest, detail)))
            self.held = held
        return moments

    def _step_by_step(self, steps: Sequence[tuple[int, frozenset[str]]]) -> list[Moment]:
        start = self._bench.now()
        moments = []
        for span_ns, held in steps:
            self._bench.wait_until(start + span_ns)
            moments.append(self.hold(*held))
        return moments


class Faults:
    """Errors in the device: what a bench can make fail, and make whole again."""

    def __init__(
        self, bench: BenchCore, driver: FaultsDriver, known: Mapping[str, DeviceFault]
    ) -> None:
        self._bench = bench
        self._driver = driver
        self.known = known
        """Every error that can be raised, by name."""
        self.active: frozenset[str] = frozenset()

    @property
    def names(self) -> tuple[str, ...]:
        """All errors of the profile, in its order."""
        return tuple(self.known)

    def exactly(self, *names: str) -> Moment:
        """From now on exactly these errors exist; all changes happen together."""
        active = frozenset(names)
        bench = self._bench
        when = bench.carry_out(self._driver.fail(active))
        self.active = active
        detail = {"active": sorted(active)}
        return bench.note(Moment("faults", when.earliest, when.latest, detail))

    def occur(self, *names: str) -> Moment:
        """These errors occur besides those that exist."""
        return self.exactly(*(self.active | set(names)))

    def heal(self, *names: str) -> Moment:
        """These errors go; all, where none is named."""
        return self.exactly(*(self.active - set(names) if names else ()))

    def forget(self) -> None:
        """Another device is there now, without an error."""
        self.active = frozenset()


class Leds:
    """The LEDs of the device."""

    def __init__(self, bench: BenchCore, driver: LedsDriver, bits: Mapping[str, int]) -> None:
        self._bench = bench
        self._driver = driver
        self._bits = bits

    @property
    def names(self) -> tuple[str, ...]:
        """All LEDs of the profile, in bit order."""
        return tuple(sorted(self._bits, key=self._bits.__getitem__))

    @property
    def sees_edges(self) -> bool:
        """The bench can report every change of light with its instant."""
        return self._driver.sees_edges

    def read(self) -> Mapping[str, str]:
        """Each LED: "off", "on" or "blink", as an eye judges it over a blink period."""
        bench = self._bench
        began_at = bench.now()
        lights = bench.carry_out(self._driver.read())
        bench.note(Moment("leds", began_at, bench.now(), {"leds": dict(lights)}))
        return lights

    def watch(self, for_ns: int) -> LedEdges:
        """Every change of light in the coming span."""
        edges = self._bench.carry_out(self._driver.watch(for_ns))
        self._bench.note(chronicle.lights(edges))
        return edges


class BitRate:
    """The bit rate of the tester's end of the bus."""

    def __init__(self, bench: BenchCore, driver: BitRateDriver) -> None:
        self._bench = bench
        self._driver = driver

    def set(self, bit_rate: int) -> Moment:
        """Run the tester's end at `bit_rate` bit/s from now on."""
        bench = self._bench
        when = bench.carry_out(self._driver.set(bit_rate))
        bench.stage.bit_rate = bit_rate
        detail = {"bit_rate": bit_rate}
        return bench.note(Moment("bitrate", when.earliest, when.latest, detail))
