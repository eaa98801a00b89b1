"""A CiA 301 device: power, NMT slave, object dictionary, and a row of services.

Laws, besides those of a node (`node_model.node`): after each initialisation the boot-up
goes first, then what the services say; nothing is heard or said before. A reset node
brings every object back to its power-on value, a reset communication the objects
1000h..1FFFh (CiA 301 4.2.0, 7.3.2.2). A device without a node id takes part in LSS alone.
What a frame or a change causes is said at that instant, in the order of the services.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping

from node_model.agenda import NEVER, Agenda
from node_model.bare import Bare
from node_model.composition import Facts, Parts, Services
from node_model.frame import Frame
from node_model.heartbeat import PRODUCER_TIME, heartbeat_frame
from node_model.line_settings import IMAGE_BYTES
from node_model.lss import NO_NODE_ID, STORED
from node_model.nmt import NMT_COB_ID, TARGETS, NmtCommand, NmtState, command_for
from node_model.node import MS, NOTHING, Frames, refuse_strangers
from node_model.nonvolatile import encode
from node_model.od import ObjectDictionary
from node_model.service import Service

COMMUNICATION = range(0x1000, 0x2000)
"""Indices of the communication profile area."""

IDENTITY = 0x1018


class Cia301Device(Bare):
    """A device that keeps the laws of a node.

    Args:
        facts: what it is.
        image: content of its memory, e.g. from an earlier life; b"" = as it left the factory.
        parts: the classes it is made of.
    """

    def __init__(self, facts: Facts, image: bytes = b"", parts: Parts | None = None) -> None:
        self.facts = facts
        self.name = facts.name
        self.parts = parts or Parts()
        self.faults = tuple(facts.faults)
        self.powered = False
        self.bit_rate = 0
        self.bit_rates = facts.bit_rates
        self.listens_to: frozenset[int] | None = frozenset()
        self.state = NmtState.INITIALISING
        self._line = self.parts.line(facts.node_id, facts.bit_rate, image[:IMAGE_BYTES])
        self._lss = self.parts.lss(self)
        self.node_id, self._line_rate = self._line.load()
        self.compose(image[IMAGE_BYTES:])
        self.agenda = Agenda()
        self.active: frozenset[str] = frozenset()
        self._boot_at: int | None = None
        self._heard_at: int | None = None
        self._wanted: NmtState | None = None
        self._retuned = False
        self._due = NEVER

    def compose(self, image: bytes) -> None:
        """Objects and services for the present node id."""
        self.od = ObjectDictionary(self.facts.entries(self.node_id))
        self.od.witness(self._configured)
        self.services = Services(
            self.parts, self.od, self.node_id, self.facts, image, self._want, self.applied
        )

    # Power.

    def power_on(self, now: int) -> Frames:
        """Start initialising."""
        if not self.powered:
            self.powered = True
            node_id, self._line_rate = self._line.load()
            self._take_node_id(node_id)
            self.services.nonvolatile.restore(lambda _: True)
            self._boot_at = self._due = now + self.start_ns()
        return NOTHING

    def power_off(self, now: int) -> Frames:  # noqa: ARG002  a verb of every node
        """Everything volatile is lost."""
        self.powered = False
        self._fall_silent()
        self._line.store.cut()
        self._lss.forget()
        self._boot_at = None
        self._due = NEVER
        return NOTHING

    def _fall_silent(self) -> None:
        for service in self.agenda.row:
            service.stop()
        self.agenda = Agenda()
        self._wanted = self._heard_at = None
        self.state = NmtState.INITIALISING
        self.bit_rate = 0
        self.listens_to = frozenset()

    def start_ns(self) -> int:
        """From power-on to the end of initialisation."""
        return 50 * MS

    def reset_ns(self) -> int:
        """How long an initialisation after an NMT reset takes."""
        return 10 * MS

    # Initialisation.

    def boot(self, now: int) -> Frames:
        """Initialisation is done: pre-operational, boot-up first."""
        self._boot_at = None
        self.bit_rate = self._line_rate
        own = (self._lss, self._line) if self.facts.lss else (self._line,)
        if self.node_id == NO_NODE_ID:
            return self._begin(own, now)
        self.state = NmtState.PRE_OPERATIONAL
        row = (*self.services.row, *own)
        return (*self.boot_frames(), *self._begin(row, now), *self.report(now))

    def boot_frames(self) -> Frames:
        """The boot-up (7.2.8.2.2.3)."""
        return (heartbeat_frame(self.node_id, NmtState.INITIALISING),)

    def _begin(self, row: tuple[Service, ...], now: int) -> Frames:
        self.services.sdo.pace(self.bit_rate)
        self.agenda = Agenda(row)
        self._retuned = True
        return gathered(service.start(now) for service in row)

    def report(self, now: int) -> Frames:
        """The errors that there are."""
        return gathered(self.occur(name, now) for name in self.faults if name in self.active)

    def reset(self, command: NmtCommand, now: int) -> Frames:
        """Initialise anew."""
        self.services.nonvolatile.finish()
        self._line.store.finish()
        self._fall_silent()
        if self._lss.pending_node_id is not None:
            self._take_node_id(self._lss.pending_node_id)
        self.services.nonvolatile.restore(self.restored_by(command))
        self._boot_at = now + self.reset_ns()
        return NOTHING

    def restored_by(self, command: NmtCommand) -> Callable[[int], bool]:
        """Which indices go back to their power-on values."""
        if command is NmtCommand.RESET_NODE:
            return lambda _: True
        return lambda index: index in COMMUNICATION

    def _take_node_id(self, node_id: int) -> None:
        """Another node id: other COB-IDs; the rest of the objects stays."""
        if node_id == self.node_id:
            return
        before, image = self.od, self.services.nonvolatile.image()
        self.node_id = node_id
        self.compose(image)
        for entry in before.entries.values():
            if entry.index not in COMMUNICATION:
                self.od.put(entry.index, entry.sub, entry.value)

    # Frames in.

    def receive(self, frame: Frame, now: int) -> Frames:
        """NMT commands in every state after initialisation; the rest is the services' affair."""
        if not self.bit_rate or frame.extended:
            return NOTHING
        self.before(now)
        frames: Frames = NOTHING
        if not frame.can_id and self.state is not NmtState.INITIALISING:
            command = self.command(frame)
            if command is not None:
                frames = self.obey(command, now)
        agenda = self.agenda
        for place, receive in agenda.listeners.get(frame.can_id, ()):
            said = receive(frame, now)
            frames = (*frames, *said) if frames else said
            agenda.acted(place)
        if now < self._due and not self.agenda.moved:
            return frames
        return self._settle(frames, now, now)

    def command(self, frame: Frame) -> NmtCommand | None:
        """The NMT command in this frame that is meant for this node."""
        return command_for(frame, self.node_id)

    def obey(self, command: NmtCommand, now: int) -> Frames:
        """Carry out an NMT command."""
        target = self.target(command)
        if target is NmtState.INITIALISING:
            return self.reset(command, now)
        return self.enter(target, now)

    def target(self, command: NmtCommand) -> NmtState:
        """The state that a command leads to."""
        return TARGETS[command]

    def enter(self, state: NmtState, now: int) -> Frames:
        """Change to an NMT state after initialisation."""
        self.state = state
        self.agenda.stir()
        return gathered(service.enter(state, now) for service in self.agenda.row)

    def _want(self, state: NmtState, now: int) -> None:  # noqa: ARG002  a request
        """1029h asks for a state: entered when what asked is through."""
        self._wanted = state

    def _configured(self, index: int, differs: bool) -> None:  # noqa: ARG002  a witness
        """A client has written an object."""
        self.agenda.write(index)

    # Time.

    def advance(self, now: int) -> Frames:
        """Everything that is due, oldest first."""
        due = self._due
        if due > now:
            return NOTHING
        said = self._fire(due)
        return self._settle(said, due, now)

    def deadline(self) -> int | None:
        """The end of initialisation, or what a service waits for."""
        return self._due if self._due < NEVER else None

    def _settle(self, frames: Frames, at: int, now: int) -> Frames:
        """All that is due by `now`, each at its instant, after what was done at `at`."""
        if not self.bit_rate:
            frames = NOTHING
        while True:
            if self._wanted is not None:
                state, self._wanted = self._wanted, None
                frames = (*frames, *self.enter(state, at))
            if self.agenda.settle() or self._retuned:
                self._retuned = False
                self._route()
            due = self._next()
            if due > now:
                self._due = due
                return frames
            at = due
            said = self._fire(due)
            if said and self.bit_rate:
                frames = (*frames, *said)

    def _fire(self, now: int) -> Frames:
        """What is due at this very instant."""
        if self._boot_at is not None:
            return self.boot(now)
        if self._heard_at is not None and self._heard_at <= now:
            self._heard_at = None
            self.bit_rate = self._line_rate
            self._retuned = True
        self.before(now)
        return self.agenda.act(now)

    def _next(self) -> int:
        if self._boot_at is not None:
            return self._boot_at
        due = self.agenda.due
        return due if self._heard_at is None else min(self._heard_at, due)

    def _route(self) -> None:
        """What passes the acceptance filter."""
        self.listens_to = self.agenda.heard | {NMT_COB_ID} if self.bit_rate else frozenset()

    def withdraws(self, frame: Frame, asked_at: int, now: int) -> bool:
        """Synchronous PDOs are not sent after their window."""
        return self.services.pdo.withdraws(frame, asked_at, now)

    def before(self, now: int) -> None:
        """The application brings its objects up to date: somebody may look at them."""

    def applied(self, index: int, sub: int, now: int) -> None:
        """An RPDO has written an object of the application."""

    # What LSS asks of its device.

    def identity(self) -> tuple[int, int, int, int]:
        """Vendor, product code, revision and serial number; 0 where it has none."""
        vendor, product, revision, serial = (self.od.number(IDENTITY, sub) for sub in range(1, 5))
        return vendor, product, revision, serial

    def keep(self, node_id: int | None, bit_rate: int | None, now: int) -> int:
        """Store node id and bit rate for the next power-on."""
        old_id, old_rate = self._line.load()
        self._line.save(old_id if node_id is None else node_id, bit_rate or old_rate, now)
        return STORED

    def switch(self, bit_rate: int | None, delay_ns: int, now: int) -> None:
        """Silent and deaf for two delays, then at the other bit rate."""
        self._line_rate = bit_rate or self._line_rate
        self._heard_at = now + 2 * delay_ns
        self.bit_rate = 0
        self._retuned = True

    def begin(self, now: int) -> None:
        """The first node id: initialise communication."""
        self.reset(NmtCommand.RESET_COMMUNICATION, now)

    # What a bench does and sees.

    def set_up(self, settings: Mapping[str, int]) -> bytes:
        """Content of the memory of such a device with these settings.

        Args:
            settings: node_id, bit_rate in bit/s, heartbeat_ms; what is not named is as the
                factory made it.

        Raises:
            ValueError: a heartbeat of a device that has none.
        """
        node_id, bit_rate = self._line.load()
        self._line.save(settings.get("node_id", node_id), settings.get("bit_rate", bit_rate), 0)
        self._line.store.finish()
        period = settings.get("heartbeat_ms")
        if period and PRODUCER_TIME not in self.od:
            raise ValueError(f"this {self.name} has no 1017h, and so no heartbeat_ms {period}")
        if period is not None and PRODUCER_TIME in self.od:
            stored = {(PRODUCER_TIME, 0): period.to_bytes(2, "little")}
            self.services.nonvolatile.store.save(encode(stored), 0)
            self.services.nonvolatile.finish()
        return self.image()

    def fail(self, active: frozenset[str], now: int) -> Frames:
        """From `now` on exactly these errors exist; power does not end them.

        Raises:
            ValueError: a name that is none of `faults`.
        """
        refuse_strangers("fault", active, self.faults, self.name)
        before, self.active = self.active, active
        self.agenda.stir()
        if self.state is NmtState.INITIALISING:
            return NOTHING
        came = gathered(self.occur(n, now) for n in self.faults if n in active - before)
        went = gathered(self.heal(n, now) for n in self.faults if n in before - active)
        return self._settle((*came, *went), now, now)

    def occur(self, name: str, now: int) -> Frames:
        """An error of the application comes."""
        return self.services.emcy.occur(name, self.facts.faults[name], now)

    def heal(self, name: str, now: int) -> Frames:
        """An error of the application goes."""
        return self.services.emcy.heal(name, now)

    def image(self) -> bytes:
        """Content of its memory: node id and bit rate, then its parameters."""
        return bytes(self._line.store.memory) + self.services.nonvolatile.image()


def gathered(said: Iterable[Frames]) -> Frames:
    """What several said, in order."""
    return tuple(frame for frames in said for frame in frames)
