"""Any frames to the models: nothing breaks; and the fuzzer finds what is broken."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import pytest

from benchmarks.fuzz.frames import Input
from benchmarks.fuzz.lives import FRAMES, Lived, inputs_of, play
from benchmarks.fuzz.models import MODELS, chosen, generic
from benchmarks.fuzz.shrink import shrunk
from node_model.composition import Parts
from node_model.device import Cia301Device
from node_model.frame import Frame
from node_model.heartbeat import HeartbeatService
from node_model.lss import LssSlave
from node_model.nmt import NmtState
from node_model.node import Frames
from node_model.nonvolatile import NonVolatile
from node_model.sdo import SdoServer

SEED = 20
LIVES = 200


@pytest.mark.slow
@pytest.mark.parametrize("part", range(4))
def test_the_models_bear_any_frames(part: int) -> None:
    """200 000 of them: nothing raised, each heartbeat in time, the next request served."""
    frames = 0
    for number in range(part, LIVES, 4):
        name, wired = chosen(number)
        lived = play(MODELS[name], inputs_of(SEED, number, MODELS[name]), wired)
        assert lived.finding is None, f"{name}, life {number}, frame {lived.at}: {lived.finding}"
        frames += lived.frames
    assert frames > 0.95 * FRAMES * LIVES / 4


class Crashing(SdoServer):
    """Falls over a segment that says it is the last of a block."""

    def receive(self, frame: Frame, now: int) -> Frames:
        """Serve."""
        if frame.data[:1] == b"\x81":
            raise KeyError("no such block")
        return super().receive(frame, now)


class Deaf(SdoServer):
    """Hears nothing more after a request of three bytes."""

    deaf = False

    def receive(self, frame: Frame, now: int) -> Frames:
        """Serve."""
        self.deaf = self.deaf or len(frame.data) == 3
        return () if self.deaf else super().receive(frame, now)


class Shifting(HeartbeatService):
    """A stop shifts its schedule by a nanosecond."""

    def enter(self, state: NmtState, now: int) -> Frames:
        """Change the state."""
        if state is NmtState.STOPPED and self._producer.due_at is not None:
            self._producer.due_at += 1
        return super().enter(state, now)


class Losing(HeartbeatService):
    """There is no heartbeat in stopped."""

    def advance(self, now: int) -> Frames:
        """Beat."""
        frames = super().advance(now)
        return () if self.state is NmtState.STOPPED else frames


class Credulous(NonVolatile):
    """Stores whatever the signature is."""

    def is_signature(self, index: int, data: bytes) -> bool:  # noqa: ARG002  any is good
        """Yes."""
        return True


class Scribbling(NonVolatile):
    """Stores each time it is stopped."""

    def enter(self, state: NmtState, now: int) -> Frames:
        """Change the state."""
        if state is NmtState.STOPPED:
            self.store.save(bytes(10), now)
        return super().enter(state, now)


class Wordy(LssSlave):
    """Its answers are short of a byte."""

    def answer(self, *data: int) -> Frames:
        """Answer."""
        return tuple(Frame(frame.can_id, frame.data[:7]) for frame in super().answer(*data))


FAULTS = (
    (Parts(sdo=Crashing), "KeyError in test_fuzz.py"),
    (Parts(sdo=Deaf), "answered with nothing"),
    (Parts(heartbeat=Shifting), "due was"),
    (Parts(heartbeat=Losing), "did not come"),
    (Parts(nonvolatile=Credulous), "was accepted where"),
    (Parts(nonvolatile=Scribbling), "its memory changed"),
    (Parts(lss=Wordy), "an LSS answer is"),
)


def found(make: Callable[[], Cia301Device], wired: bool) -> tuple[list[Input], Lived]:
    """The first life that shows something."""
    for number in range(20):
        inputs = inputs_of(SEED, number, make)
        lived = play(make, inputs, wired)
        if lived.finding is not None:
            return inputs[: lived.at], lived
    pytest.fail("20 lives show nothing")


@pytest.mark.slow
@pytest.mark.parametrize(("parts", "text"), FAULTS, ids=[text for _, text in FAULTS])
def test_a_fault_is_found_and_made_small(parts: Parts, text: str) -> None:
    """Within a life or two; the few frames that are left still show it."""
    make = partial(generic, parts)
    inputs, lived = found(make, wired=False)
    assert lived.finding is not None
    assert text in lived.finding

    small = shrunk(inputs, lambda some: play(make, some).finding is not None, 150)
    assert len(small) <= 3
    assert text in str(play(make, small).finding)


@pytest.mark.slow
def test_a_fault_is_found_on_the_wire() -> None:
    """Where frames wait for the bus."""
    _, lived = found(partial(generic, Parts(heartbeat=Losing)), wired=True)
    assert "did not come" in str(lived.finding)


def test_a_life_follows_from_seed_and_number() -> None:
    """The same again is the same; another seed or number is another life."""
    lives = [
        inputs_of(seed, number, generic, 50) for seed, number in ((1, 1), (1, 1), (1, 2), (2, 1))
    ]
    assert lives[0] == lives[1]
    assert lives[0] != lives[2]
    assert lives[0] != lives[3]
