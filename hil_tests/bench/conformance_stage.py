"""Checks of a stage: its port, and the drivers that move the device, whatever stands behind.

Each check is a generator of sentences: what is wrong, and what to do. They look at the
bench alone, and send nothing but frames with an identifier that no node listens to.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from itertools import pairwise
from typing import TYPE_CHECKING, TypeVar

from hil_tests.clock import MS, Interval, S, show_span
from hil_tests.errors import BenchError
from hil_tests.trace import Sighting
from node_model.frame import Frame

if TYPE_CHECKING:
    from hil_tests.bench.action import Action
    from hil_tests.bench.stage import Stage
    from hil_tests.config import DeviceProfile

T = TypeVar("T")

UNUSED_ID = 0x6FE
"""An identifier that no service of CiA 301 has, and that no node listens to."""

PATIENCE_NS = 2 * S
"""How long an own frame may take to the bus."""

_OVERDUE_NS = 250 * MS
"""How late `next` may come back on a busy host."""

_FRAMES = 20
_QUIET_NS = 1500 * MS
_WAIT_NS = 50 * MS


class Tester:
    """Works a stage as a bench does: everything is awaited in `Port.next`."""

    def __init__(self, stage: Stage) -> None:
        self.stage = stage
        self.seen: list[Sighting] = []

    def pump(self, until: int, also: Sequence[int] = ()) -> bool:
        """Wait for the next thing on the bus; False when `until` has come."""
        item = self.stage.port.next(until, also)
        if isinstance(item, Sighting):
            self.seen.append(item)
        return item is not None

    def wait(self, span_ns: int) -> None:
        """Let time pass."""
        until = self.stage.port.now() + span_ns
        while self.pump(until):
            pass

    def carry_out(self, action: Action[T]) -> T:
        """Start an action and wait for it."""
        port = self.stage.port
        action.start(port.now())
        while not action.poll(port.now()):
            self.pump(action.wake_at, action.descriptors)
        return action.result()

    def send(self, frame: Frame) -> Sighting:
        """Send a frame and wait until it is seen.

        Raises:
            BenchError: it was not.
        """
        start = len(self.seen)
        self.stage.port.send(frame)
        give_up_at = self.stage.port.now() + PATIENCE_NS
        while self.pump(give_up_at) or self.stage.port.now() < give_up_at:
            for sighting in self.seen[start:]:
                if sighting.own and sighting.frame == frame:
                    return sighting
        raise BenchError(
            f"{frame} was not seen within {show_span(PATIENCE_NS)}: does anything acknowledge, at"
            " this bit rate?"
        )


def own_frames(tester: Tester, _: DeviceProfile) -> Iterator[str]:
    """Own frames come back once and in order, with stamps that rise, on the clock of now."""
    port = tester.stage.port
    tester.wait(_WAIT_NS)
    start, began_at = len(tester.seen), port.now()
    frames = [Frame(UNUSED_ID, bytes((number,))) for number in range(_FRAMES)]
    for frame in frames:
        port.send(frame)
    tester.wait(PATIENCE_NS)
    ended_at = port.now()
    seen = tester.seen[start:]
    own = [each.frame for each in seen if each.own]
    if own != frames:
        yield (
            f"{len(frames)} frames were sent, {len(own)} came back as own"
            f"{'' if len(own) != len(frames) else ', in another order'}; does anything"
            " acknowledge, and is no filter or second tester at work?"
        )
    if any(each.frame in frames for each in seen if not each.own):
        yield "own frames came back as somebody else's"
    for earlier, later in pairwise(seen):
        if later.at < earlier.at - earlier.doubt_ns - later.doubt_ns:
            off = show_span(earlier.at - later.at)
            yield f"the stamp of {later.frame} lies {off} before that of {earlier.frame}"
    for each in (each for each in seen if each.own):
        if not began_at <= each.at + each.doubt_ns or each.at - each.doubt_ns > ended_at:
            off = show_span(each.at - began_at)
            yield f"{each.frame} is stamped {off} after it was sent; stamps are on another clock"
            return


def waiting(tester: Tester, _: DeviceProfile) -> Iterator[str]:
    """Waiting ends by the instant that was asked for, and not long after it."""
    port = tester.stage.port
    until = port.now() + _WAIT_NS
    while tester.pump(until):
        pass
    off = port.now() - until
    if off < 0:
        yield f"next came back {show_span(-off)} before its time, with nothing"
    if off > _OVERDUE_NS:
        yield f"next came back {show_span(off)} late; is this host overloaded?"
    tester.pump(port.now() - 1 * S)
    if port.now() - until > off + _OVERDUE_NS:
        yield "next waited for an instant that was past already"


def supply(tester: Tester, _: DeviceProfile) -> Iterator[str]:
    """Switching says when it happened; off when off is harmless, and off means silence."""
    power = tester.stage.power
    assert power is not None
    for on in (True, True, False, False):
        yield from _took_effect(tester, partial(power.switch, on), f"power {on}")
    start = len(tester.seen)
    tester.wait(_WAIT_NS)
    start = len(tester.seen)
    tester.wait(_QUIET_NS)
    heard = [each for each in tester.seen[start:] if not each.own]
    if heard and tester.stage.exclusive:
        yield (
            f"{heard[0].frame} was heard with the supply off: is it the device's supply that is"
            " switched, and is the bus exclusive as the bench file says?"
        )
    tester.carry_out(power.switch(on=True))
    tester.wait(_QUIET_NS)
    # Own frames on both sides tell whether stimuli and frames share a clock.
    before = tester.send(Frame(UNUSED_ID, b"\x01"))
    when = tester.carry_out(power.switch(on=True))
    after = tester.send(Frame(UNUSED_ID, b"\x02"))
    if when.latest < before.at - before.doubt_ns or when.earliest > after.at:
        yield "the supply was switched outside the two frames sent around it: two clocks are mixed"


def held_keys(tester: Tester, profile: DeviceProfile) -> Iterator[str]:
    """Every key of the profile can be held, and the bench says when."""
    keys = tester.stage.keys
    assert keys is not None
    for held in (*({name} for name in profile.key_bits), set(profile.key_bits), set()):
        name = f"keys {', '.join(sorted(held)) or 'released'}"
        yield from _took_effect(tester, partial(keys.hold, frozenset(held)), name)
    if not keys.timed_sequences:
        return
    key = frozenset((next(iter(profile.key_bits)),))
    steps = [(0, key), (30 * MS, frozenset[str]()), (60 * MS, key), (90 * MS, frozenset[str]())]
    found = tester.carry_out(keys.sequence(steps))
    if len(found) != len(steps):
        yield f"a sequence of {len(steps)} steps gave {len(found)} intervals"
    if any(later.earliest < earlier.earliest for earlier, later in pairwise(found)):
        yield "the steps of a sequence go back in time"


def raised_errors(tester: Tester, profile: DeviceProfile) -> Iterator[str]:
    """Every error of the profile can be raised and healed, and the bench says when."""
    faults = tester.stage.faults
    assert faults is not None
    for active in (*({name} for name in profile.faults), set(profile.faults), set()):
        name = f"errors {', '.join(sorted(active)) or 'healed'}"
        yield from _took_effect(tester, partial(faults.fail, frozenset(active)), name)


def lights(tester: Tester, profile: DeviceProfile) -> Iterator[str]:
    """Every LED of the profile is read as off, on or blink."""
    leds = tester.stage.leds
    assert leds is not None
    found = tester.carry_out(leds.read())
    if set(found) != set(profile.led_bits):
        yield f"LEDs {sorted(found)} were read; the profile has {sorted(profile.led_bits)}"
    if set(found.values()) - {"off", "on", "blink"}:
        yield f"LEDs were read as {dict(found)}; an LED is off, on or blink"


def light_edges(tester: Tester, profile: DeviceProfile) -> Iterator[str]:
    """Where the bench sees edges of light, it tells them in order, inside the time watched."""
    leds = tester.stage.leds
    if leds is None or not leds.sees_edges:
        return
    began_at = tester.stage.port.now()
    found = tester.carry_out(leds.watch(10 * _WAIT_NS))
    whole = Interval(began_at - 10 * MS, tester.stage.port.now() + 10 * MS)
    if set(found.start) != set(profile.led_bits):
        yield f"the watch began with LEDs {sorted(found.start)}"
    for when, name, _ in found.edges:
        if when.latest < whole.earliest or when.earliest > whole.latest:
            yield f"an edge of {name} lies outside the time that was watched"
    if any(later[0].earliest < earlier[0].earliest for earlier, later in pairwise(found.edges)):
        yield "the edges are not in order of time"


def _took_effect(
    tester: Tester, start: Callable[[], Action[Interval]], name: str
) -> Iterator[str]:
    """An action took effect between its start and its end."""
    port = tester.stage.port
    began_at = port.now()
    when = tester.carry_out(start())
    ended_at = port.now()
    if when.latest < when.earliest:
        yield f"{name}: its interval ends before it begins"
    if when.earliest < began_at - 10 * MS or when.latest > ended_at + 10 * MS:
        yield f"{name}: it took effect outside the time in which it was asked for"
