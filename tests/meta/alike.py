"""Whether a model does in a test just what the right one does: then it is judged just so.

A bench and its judge know of a device what its contract shows (`node_model.node.Panel`), and
nothing else. They are the same for every model, and what they do to it is the same as long as it
answers alike. So each test is run on the right model first, and everything that is asked of that
is written down with the answer. Of another model the very same is asked, without wire, bench and
judge: where it gives the same answers to the end, the whole test would go the same way, to the
same verdicts. At its first other answer it is no longer alike, and the test must be run on it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

from node_model.frame import Frame
from node_model.node import NOTHING, Frames, Panel

Names = tuple[str, ...]

Make = Callable[[bytes], Panel]
"""Makes a model from the content of its memory."""


class Asked(NamedTuple):
    """Something that was asked of a device.

    Args:
        verb: of `Panel`; "make" = there is another device from now on.
        arguments: of the verb.
        answer: to it; frames as a tuple.
        standing: what is to be seen of the device from then on.
    """

    verb: str
    arguments: tuple[Any, ...]
    answer: object
    standing: tuple[object, ...]


def _standing(device: Panel) -> tuple[int | None, int, bool]:
    """What is read of a device at any time; it changes inside of verbs alone."""
    return device.deadline(), device.bit_rate, device.powered


def _fittings(device: Panel) -> tuple[Names, Names, Names, bool]:
    """What never changes."""
    return device.keys, device.leds, device.faults, hasattr(device, "withdraws")


def _hears(device: Panel, frame: Frame) -> bool:
    """Whether its acceptance filter lets a frame through."""
    ids = device.listens_to
    return ids is None or (-1 if frame.extended else frame.can_id) in ids


class Witness:
    """A device, and everything that is asked of it; nothing else of it is to be seen.

    It lets every frame in, and passes on what the device would hear: another one may hear more.
    It does not tell at once when it repeats a beat, which not every model can.

    Args:
        device: the right model.
        image: content of the memory that it was made with.
        asked: what is asked of it is added.
    """

    listens_to: frozenset[int] | None = None

    def __init__(self, device: Panel, image: bytes, asked: list[Asked]) -> None:
        self._device, self._asked = device, asked
        self.name = device.name
        self.keys, self.leds, self.faults, _ = fittings = _fittings(device)
        if asked and asked[-1].verb == "make":
            asked.pop()  # nobody has asked anything of the one before
        self._note("make", (image,), fittings)

    def _note(self, verb: str, arguments: tuple[Any, ...], answer: object) -> None:
        standing = self._due, self.bit_rate, self.powered = _standing(self._device)
        self._asked.append(Asked(verb, arguments, answer, standing))

    def _frames(self, verb: str, arguments: tuple[Any, ...], frames: Frames) -> Frames:
        answer = tuple(frames)
        self._note(verb, arguments, answer)
        return answer

    # As of any panel.

    def power_on(self, now: int) -> Frames:
        """Supply is applied."""
        return self._frames("power_on", (now,), self._device.power_on(now))

    def power_off(self, now: int) -> Frames:
        """Supply is cut."""
        return self._frames("power_off", (now,), self._device.power_off(now))

    def receive(self, frame: Frame, now: int) -> Frames:
        """A frame has ended on the wire."""
        device = self._device
        frames = device.receive(frame, now) if _hears(device, frame) else NOTHING
        return self._frames("receive", (frame, now), frames)

    def advance(self, now: int) -> Frames:
        """Time has come to `now`."""
        return self._frames("advance", (now,), self._device.advance(now))

    def hold(self, held: frozenset[str], now: int) -> Frames:
        """Exactly these keys are held."""
        return self._frames("hold", (held, now), self._device.hold(held, now))

    def fail(self, active: frozenset[str], now: int) -> Frames:
        """Exactly these errors exist."""
        return self._frames("fail", (active, now), self._device.fail(active, now))

    def deadline(self) -> int | None:
        """When `advance` must be called next."""
        return self._due

    def lit(self, led: str, now: int) -> bool:
        """Whether that LED shines."""
        answer = self._device.lit(led, now)
        self._note("lit", (led, now), answer)
        return answer

    def lamp_change(self, now: int) -> int | None:
        """When a lamp next changes by itself."""
        answer = self._device.lamp_change(now)
        self._note("lamp_change", (now,), answer)
        return answer

    def image(self) -> bytes:
        """Content of the memory."""
        answer = self._device.image()
        self._note("image", (), answer)
        return answer


class WithdrawingWitness(Witness):
    """The same of a device that takes frames back; the wire asks it about each."""

    def withdraws(self, frame: Frame, asked_at: int, now: int) -> bool:
        """See `Withdrawing`."""
        answer: bool = self._device.withdraws(frame, asked_at, now)  # type: ignore[attr-defined]
        self._note("withdraws", (frame, asked_at, now), answer)
        return answer


def witnessed(device: Panel, image: bytes, asked: list[Asked]) -> Panel:
    """A device behind a witness, see there."""
    witness = WithdrawingWitness if hasattr(device, "withdraws") else Witness
    return witness(device, image, asked)


def is_alike(make: Make, asked: Sequence[Asked]) -> bool:
    """Whether models that are made so answer alike to all that was asked of the right one."""
    try:
        return _answers(make, asked)
    except Exception:  # noqa: BLE001 - one that breaks is not alike; the test says what it is
        return False


def _answers(make: Make, asked: Sequence[Asked]) -> bool:
    device: Any = None  # a life begins with "make"
    stands: tuple[object, ...] = ()
    for verb, arguments, answer, standing in asked:
        found: Any
        if verb == "make":
            device = make(*arguments)
            found = _fittings(device)
        elif verb != "receive" or _hears(device, arguments[0]):
            found = getattr(device, verb)(*arguments)
            if isinstance(answer, tuple):
                found = tuple(found)
        else:  # most frames are for others: it does not so much as see them
            if answer or stands != standing:
                return False
            continue
        stands = _standing(device)
        if found != answer or stands != standing:
            return False
    return True
