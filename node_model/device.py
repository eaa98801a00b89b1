"""A CiA 301 device: power, NMT slave, object dictionary, and a row of services.

Laws, besides those of a node (`node_model.node`): after each initialisation the boot-up
goes first, then what the services say; nothing is heard or said before. A reset node
brings every object back to its power-on value, a reset communication the objects
1000h..1FFFh (CiA 301 4.2.0, 7.3.2.2).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable
from dataclasses import dataclass

from node_model.frame import Frame
from node_model.heartbeat import HeartbeatProducer, heartbeat_frame
from node_model.nmt import NMT_COB_ID, TARGETS, NmtCommand, NmtState, command_for
from node_model.node import MS, NOTHING, Frames, refuse_strangers
from node_model.od import Entry, ObjectDictionary

COMMUNICATION = range(0x1000, 0x2000)
"""Indices of the communication profile area."""

HEARTBEAT_TIME = 0x1017


@dataclass(frozen=True, slots=True)
class Parts:
    """The classes a device is made of: where a faulty or different device differs."""

    heartbeat: Callable[[int], HeartbeatProducer] = HeartbeatProducer


class Cia301Device(ABC):
    """A device that keeps the laws of a node.

    Args:
        name: for people.
        node_id: 1..127.
        bit_rate: bit/s.
        parts: the classes it is made of.
    """

    keys: tuple[str, ...] = ()
    leds: tuple[str, ...] = ()
    faults: tuple[str, ...] = ()

    def __init__(
        self,
        name: str,
        node_id: int,
        bit_rate: int,
        parts: Parts | None = None,
    ) -> None:
        self.name = name
        self.node_id = node_id
        self.parts = parts or Parts()
        self.powered = False
        self.bit_rate = 0
        self.listens_to: frozenset[int] | None = frozenset()
        self.state = NmtState.INITIALISING
        self.od = ObjectDictionary(self.entries(node_id))
        self._line_rate = bit_rate
        self._boot_at: int | None = None
        self._beat = self.parts.heartbeat(0)

    @abstractmethod
    def entries(self, node_id: int) -> Iterable[Entry]:
        """Its objects, as it leaves the factory with that node id."""

    # Power.

    def power_on(self, now: int) -> Frames:
        """Start initialising."""
        if not self.powered:
            self.powered = True
            self._restore(lambda _: True)
            self._boot_at = now + self.start_ns()
        return NOTHING

    def power_off(self, now: int) -> Frames:  # noqa: ARG002  a verb of every node
        """Everything volatile is lost."""
        self.powered = False
        self._boot_at = None
        self._fall_silent()
        return NOTHING

    def _fall_silent(self) -> None:
        self.state = NmtState.INITIALISING
        self.bit_rate = 0
        self.listens_to = frozenset()
        self._beat.stop()

    def start_ns(self) -> int:
        """From power-on to the end of initialisation."""
        return 50 * MS

    def reset_ns(self) -> int:
        """How long an initialisation after an NMT reset takes."""
        return 10 * MS

    # Initialisation.

    def _restore(self, concerned: Callable[[int], bool]) -> None:
        """Objects go back to their power-on values."""
        for entry in self.od.entries.values():
            if concerned(entry.index):
                entry.value = entry.default

    def boot(self, now: int) -> Frames:
        """Initialisation is done: pre-operational, boot-up first."""
        self._boot_at = None
        self.bit_rate = self._line_rate
        self.listens_to = frozenset((NMT_COB_ID,))
        self.state = NmtState.PRE_OPERATIONAL
        self._beat = self.parts.heartbeat(self.od.number(HEARTBEAT_TIME) * MS)
        self._beat.start(now)
        return (heartbeat_frame(self.node_id, NmtState.INITIALISING),)

    def reset(self, command: NmtCommand, now: int) -> Frames:
        """Initialise anew."""
        self._fall_silent()
        everything = command is NmtCommand.RESET_NODE
        self._restore(lambda index: everything or index in COMMUNICATION)
        self._boot_at = now + self.reset_ns()
        return NOTHING

    # Frames in.

    def receive(self, frame: Frame, now: int) -> Frames:
        """NMT commands in every state after initialisation."""
        if self.state is NmtState.INITIALISING:
            return NOTHING
        command = self.command(frame)
        return NOTHING if command is None else self.obey(command, now)

    def command(self, frame: Frame) -> NmtCommand | None:
        """The NMT command in this frame that is meant for this node."""
        return command_for(frame, self.node_id)

    def obey(self, command: NmtCommand, now: int) -> Frames:
        """Carry out an NMT command."""
        target = TARGETS[command]
        if target is NmtState.INITIALISING:
            return self.reset(command, now)
        self.state = target
        return NOTHING

    # Time.

    def advance(self, now: int) -> Frames:
        """Everything that is due, oldest first."""
        frames = NOTHING
        while (due := self.deadline()) is not None and due <= now:
            frames = (*frames, *self.fire(due))
        return frames

    def fire(self, now: int) -> Frames:
        """What is due at this very instant."""
        if self._boot_at is not None:
            return self.boot(now)
        self._beat.beat()
        return (heartbeat_frame(self.node_id, self.state),)

    def deadline(self) -> int | None:
        """The end of initialisation, or what a service waits for."""
        return self._beat.due_at if self._boot_at is None else self._boot_at

    # What a bench does and sees.

    def hold(self, held: frozenset[str], now: int) -> Frames:  # noqa: ARG002  a verb of every panel
        """It has no keys.

        Raises:
            ValueError: a name.
        """
        refuse_strangers("key", held, self.keys, self.name)
        return NOTHING

    def lit(self, led: str, now: int) -> bool:  # noqa: ARG002  a verb of every panel
        """It has no LEDs.

        Raises:
            ValueError: always.
        """
        refuse_strangers("LED", frozenset((led,)), self.leds, self.name)
        return False

    def lamp_change(self, now: int) -> int | None:  # noqa: ARG002  a verb of every panel
        """It has no LEDs."""
        return None

    @abstractmethod
    def fail(self, active: frozenset[str], now: int) -> Frames:
        """From `now` on exactly these errors exist.

        Raises:
            ValueError: a name that is none of `faults`.
        """

    @abstractmethod
    def image(self) -> bytes:
        """Content of its memory."""
