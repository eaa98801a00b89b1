"""The keypad as a whole: power, the choice between its two modes, and its memory."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from node_model.frame import Frame
from node_model.keypad.commissioning import Commissioning
from node_model.keypad.operation import Operation
from node_model.keypad.parameters import SIZE, Parameters
from node_model.keypad.profile import Profile
from node_model.node import MS, NOTHING, Frames, refuse_strangers
from node_model.storage import RecordStore


@dataclass(frozen=True, slots=True)
class Parts:
    """The classes a keypad is made of: where a faulty or different device differs."""

    commissioning: type[Commissioning] = Commissioning
    operation: type[Operation] = Operation
    store: type[RecordStore] = RecordStore


class Keypad:
    """A keypad that keeps the laws of a node.

    Args:
        profile: facts of the hardware.
        image: content of its memory, e.g. from an earlier life; b"" = never commissioned.
        parts: the classes it is made of.
    """

    faults: tuple[str, ...] = ()

    def __init__(self, profile: Profile, image: bytes = b"", parts: Parts | None = None) -> None:
        self.name = profile.name
        self.profile = profile
        self.parts = parts or Parts()
        self.store = self.parts.store(SIZE, image)
        self.keys = tuple(sorted(profile.keys, key=profile.keys.__getitem__))
        self.leds = tuple(sorted(profile.leds, key=profile.leds.__getitem__))
        self.powered = False
        self.bit_rate = 0
        self.listens_to: frozenset[int] | None = frozenset()
        self._held: frozenset[str] = frozenset()
        self._decide_at: int | None = None
        self._mode: Commissioning | Operation | None = None

    # What it does.

    def power_on(self, now: int) -> Frames:
        """Start initialising; the keys are looked at when that is done."""
        if not self.powered:
            self.powered = True
            self._decide_at = now + self.start_ns()
        return NOTHING

    def power_off(self, now: int) -> Frames:  # noqa: ARG002  a verb of every node
        """Everything volatile is lost, and so is what was not yet stored."""
        self.powered = False
        self.store.cut()
        self._decide_at = self._mode = None
        self.bit_rate = 0
        self.listens_to = frozenset()
        return NOTHING

    def receive(self, frame: Frame, now: int) -> Frames:
        """A frame from the bus."""
        mode = self._mode
        if mode is None:
            return NOTHING
        frames = mode.receive(frame, now)
        self.bit_rate = mode.bit_rate
        return frames

    def hold(self, held: frozenset[str], now: int) -> Frames:
        """From `now` on exactly these keys are held."""
        mask = self.mask(held)
        self._held = held
        return self._mode.hold(mask, now) if self._mode else NOTHING

    def fail(self, active: frozenset[str], now: int) -> Frames:  # noqa: ARG002  a verb of every panel
        """It has no errors that could be raised.

        Raises:
            ValueError: a name.
        """
        refuse_strangers("fault", active, self.faults, self.name)
        return NOTHING

    def advance(self, now: int) -> Frames:
        """Whatever is due by now."""
        mode = self._mode
        if mode is None:
            if self._decide_at is None or self._decide_at > now:
                return NOTHING
            mode = self._decide(self._decide_at)
        frames = mode.advance(now)
        self.bit_rate = mode.bit_rate
        return frames

    def deadline(self) -> int | None:
        """The end of initialisation, or what the present mode waits for."""
        mode = self._mode
        return self._decide_at if mode is None else mode.deadline()

    def repeats(self, frame: Frame, until: int, gap_ns: int, most: int) -> Sequence[int]:
        """Heartbeats; see `Repeating`. A keypad that is made differently is asked each time."""
        if type(self) is not Keypad or not isinstance(self._mode, Operation):
            return ()
        return self._mode.repeats(frame, until, gap_ns, most)

    # How it is seen.

    def lit(self, led: str, now: int) -> bool:
        """Whether that LED shines; dark without power and in commissioning."""
        return isinstance(self._mode, Operation) and self._mode.lamps.lit(led, now)

    def lamp_change(self, now: int) -> int | None:
        """When the light of some LED next changes by itself."""
        return self._mode.lamps.change(now) if isinstance(self._mode, Operation) else None

    def image(self) -> bytes:
        """Content of the memory."""
        return bytes(self.store.memory)

    # What decides.

    def start_ns(self) -> int:
        """From power-on to the end of initialisation."""
        return 50 * MS

    def mask(self, held: frozenset[str]) -> int:
        """The held keys as bits of the key frame.

        Raises:
            ValueError: names that this keypad has not.
        """
        bits = self.profile.keys
        if not held <= bits.keys():
            refuse_strangers("key", held, self.keys, self.name)
        return sum([1 << bits[name] for name in held])

    def stored(self) -> Parameters:
        """What it was commissioned to, or the factory's parameters."""
        record = self.store.load()
        found = Parameters.decode(record) if record else None
        return found or self.profile.factory

    def wants_commissioning(self) -> bool:
        """Exactly the commissioning keys are held."""
        return self._held == self.profile.commissioning_keys

    def _decide(self, now: int) -> Commissioning | Operation:
        """Initialisation is done: choose the mode."""
        self._decide_at = None
        mode: Commissioning | Operation
        if self.wants_commissioning():
            mode = self.parts.commissioning(self.store, now)
        else:
            mode = self.parts.operation(self.profile, self.stored(), self.mask(self._held), now)
        self._mode = mode
        self.bit_rate = mode.bit_rate
        self.listens_to = mode.listens_to
        return mode
