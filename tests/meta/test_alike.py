"""A model is alike only if nothing that a bench can see tells it from the right one."""

from __future__ import annotations

from typing import Any

import pytest

from node_model.devices import memory_with
from node_model.frame import Frame
from node_model.keypad import Keypad, Parameters, Parts, load
from node_model.keypad.operation import Operation
from node_model.node import NOTHING, Frames, Panel, S
from node_model.world import World
from tests.meta.alike import Asked, Make, Witness, is_alike, witnessed
from tests.meta.models import KINDS
from tests.meta.proving import Suite, collect, try_model, witness

FACTS = load()
PARAMETERS = Parameters(node_id=5, heartbeat_ms=100)
IMAGE = memory_with(PARAMETERS.encode())
START, RESET = Frame(0, b"\1\5"), Frame(0, b"\x81\5")
STRANGE = Frame(0x123, b"\1")


def right(image: bytes) -> Panel:
    """The keypad itself."""
    return Keypad(FACTS, image)


def life_of(make: Make) -> list[Asked]:
    """What is asked of a keypad that starts, is used, is reset, and runs on."""
    asked: list[Asked] = []
    device = witnessed(make(IMAGE), IMAGE, asked)
    world = World(PARAMETERS.bit_rate)
    tester, keypad = world.attach(), world.attach(device)
    world.act(keypad, device.power_on)
    world.run(1 * S)
    for frame in (STRANGE, START, Frame(0x205, b"\1\0\0\0\1\0\0\0")):
        world.send(tester, frame)
        world.run(world.now + 1 * S)
    held = frozenset(device.keys[:1])
    world.act(keypad, lambda now: device.hold(held, now))
    world.act(keypad, lambda now: device.fail(frozenset(), now))
    world.run(world.now + 1 * S)
    for led in device.leds:
        device.lit(led, world.now)
    device.lamp_change(world.now)
    device.image()
    world.send(tester, RESET)
    world.run(world.now + 3 * S)
    world.act(keypad, device.power_off)
    return asked


LIFE = life_of(right)


def operating(operation: type[Operation]) -> Make:
    """A keypad with this mode of operation."""
    return lambda image: Keypad(FACTS, image, Parts(operation=operation))


# What is written down.


def test_everything_is_asked() -> None:
    """The life below holds each verb, so that each is compared."""
    assert {each.verb for each in LIFE} == {
        *("make", "power_on", "power_off", "receive", "advance", "hold", "fail"),
        *("lit", "lamp_change", "image"),
    }


def test_a_witness_shows_what_the_contract_names_and_no_more() -> None:
    """Else a bench could see something of a device that is compared by nobody."""
    contract = {
        name
        for each in Panel.__mro__[:-1]
        for name in (*vars(each), *vars(each).get("__annotations__", ()))
        if not name.startswith("_")
    }
    shown = {name for name in dir(Witness(right(IMAGE), IMAGE, [])) if not name.startswith("_")}
    assert shown == contract


def test_a_witness_changes_nothing() -> None:
    """A keypad behind one says what it says without, at the same instants."""

    def said(device: Panel) -> list[tuple[Frame, int]]:
        world = World(PARAMETERS.bit_rate)
        world.attach()
        world.act(world.attach(device), device.power_on)
        found = []
        while (seen := world.next_frame(3 * S)) is not None:
            found.append(seen[:2])
        return found

    assert len(said(right(IMAGE))) > 20
    assert said(right(IMAGE)) == said(witnessed(right(IMAGE), IMAGE, []))


# Who is alike.


def test_the_right_one_is_alike() -> None:
    """It answers as it did before."""
    assert is_alike(right, LIFE)


def test_one_that_is_made_otherwise_and_does_the_same_is_alike() -> None:
    """It hears frames that the right one does not hear, and makes nothing of them."""

    class Attentive(Keypad):
        def __setattr__(self, name: str, value: object) -> None:
            super().__setattr__(name, None if name == "listens_to" else value)

        def receive(self, frame: Frame, now: int) -> Frames:
            return NOTHING if frame == STRANGE else super().receive(frame, now)

    assert is_alike(lambda image: Attentive(FACTS, image), LIFE)


class AnswersStrangers(Keypad):
    """It hears a frame that is none of its own."""

    def __setattr__(self, name: str, value: object) -> None:
        """Nothing is filtered out."""
        super().__setattr__(name, None if name == "listens_to" else value)

    def receive(self, frame: Frame, now: int) -> Frames:
        """An answer to it."""
        return (frame,) if frame == STRANGE else super().receive(frame, now)


class Deaf(Keypad):
    """It does not hear what the right one hears."""

    def __setattr__(self, name: str, value: object) -> None:
        """Nothing passes."""
        super().__setattr__(name, frozenset() if name == "listens_to" else value)


class StartsLate(Keypad):
    """One nanosecond."""

    def start_ns(self) -> int:
        """From power-on to the end of initialisation."""
        return super().start_ns() + 1


class AtAnotherRate(Keypad):
    """Half of what is right."""

    def __setattr__(self, name: str, value: object) -> None:
        """As it is set."""
        super().__setattr__(name, value // 2 if name == "bit_rate" else value)  # type: ignore[operator]


class NeverOff(Keypad):
    """It says that it has power."""

    def __setattr__(self, name: str, value: object) -> None:
        """As it is set."""
        super().__setattr__(name, value or name == "powered")


class Darkens(Keypad):
    """The first LED shines no more."""

    def lit(self, led: str, now: int) -> bool:
        """Whether that LED shines."""
        return led != self.leds[0] and super().lit(led, now)


class BlinksOn(Keypad):
    """A lamp will change that will not."""

    def lamp_change(self, now: int) -> int | None:
        """Soon."""
        return now + 7


class Forgets(Keypad):
    """Its memory holds something else."""

    def image(self) -> bytes:
        """Nothing."""
        return b""


class WithFewerKeys(Keypad):
    """The last key is missing."""

    def __init__(self, *arguments: Any) -> None:
        super().__init__(*arguments)
        self.keys = self.keys[:-1]


class Withdraws(Keypad):
    """It may take frames back."""

    def withdraws(self, *_: object) -> bool:
        """It does not, as it happens."""
        return False


class Breaks(Keypad):
    """It is a program with an error."""

    def hold(self, *_: object) -> Frames:
        """No."""
        raise IndexError


class SaysNothing(Keypad):
    """It returns what is no frames."""

    def hold(self, *_: object) -> Frames:
        """None at all."""
        return None  # type: ignore[return-value]


@pytest.mark.parametrize(
    "kind",
    [
        *(AnswersStrangers, Deaf, StartsLate, AtAnotherRate, NeverOff, Darkens, BlinksOn),
        *(Forgets, WithFewerKeys, Withdraws, Breaks, SaysNothing),
    ],
)
def test_one_that_differs_in_anything_is_not(kind: type[Keypad]) -> None:
    """In a frame, an instant, a rate, a lamp, its memory, its fittings; or it breaks."""
    assert not is_alike(lambda image: kind(FACTS, image), LIFE)


class LosesABeat(Operation):
    """The twentieth is missing."""

    def beat_frames(self) -> Frames:
        """Counted."""
        self.count = getattr(self, "count", 0) + 1
        return NOTHING if self.count == 20 else super().beat_frames()


class DoublesABeat(Operation):
    """The twentieth comes twice."""

    def beat_frames(self) -> Frames:
        """Counted."""
        self.count = getattr(self, "count", 0) + 1
        return (*super().beat_frames(),) * (2 if self.count == 20 else 1)


@pytest.mark.parametrize("kind", [LosesABeat, DoublesABeat])
def test_a_beat_among_many_is_looked_at(kind: type[Operation]) -> None:
    """Not only what a model answers to a frame or to a hand."""
    assert not is_alike(operating(kind), LIFE)
    assert is_alike(operating(type("Same", (Operation,), {})), LIFE)


def test_beats_at_another_period_are_noticed() -> None:
    """By the instant at which the model wants to be asked next."""
    other = memory_with(Parameters(node_id=5, heartbeat_ms=101).encode())
    assert not is_alike(lambda _: right(other), LIFE)


# What it is good for.


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["keypad", "drive"])
def test_results_are_those_of_a_run_in_full(kind: str) -> None:
    """Every model gets the same results, whether tests in which it is alike are run or not."""
    suite = collect(f"--can-profile={kind}")
    suite = Suite(suite.plan, suite.cases[::30])
    known = witness(suite)
    for name in KINDS[kind].everybody[::50]:
        assert try_model(suite, name, known).results == try_model(suite, name).results, name
