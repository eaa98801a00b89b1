"""The master's side of NMT, node guarding and heartbeat: one manager for each node.

It keeps the laws of a node: it is told the time, its verbs return the frames to send,
`deadline` says when `advance` wants to be called next. The state of the node comes from what
the node sent, never from what it was told to do. Source: the NMT class of a driver for robot
hands; CiA 301 4.2.0, 7.2.8.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum

from hil_tests.clock import show_span
from hil_tests.judge.cobs import EMCY, ERROR_CONTROL, LEADS_TO, SHOWN, Nmt, State, nmt_frame
from node_model.frame import Frame

LIFE_GUARD_CODE = 0x8130
"""EMCY of a device that misses its guarding master or a heartbeat (CiA 301, table 26)."""

EVERY_NODE = 0
NODE_IDS = range(1, 128)

SETTLE_NS = 50_000_000
"""How long after a command a node may still show its old state."""

Frames = Sequence[Frame]
NOTHING: Frames = ()


class What(Enum):
    """What can happen to a node that is managed."""

    NODE_GUARDING = "node guarding event"
    """No reply within the life time, a wrong toggle bit, or another state than expected."""
    LIFE_GUARDING = "life guarding event"
    """The device itself missed its master, and says so in an EMCY."""
    HEARTBEAT = "heartbeat event"
    """No heartbeat within the consumer time, or one with bit 7 set."""
    RESTART = "restart"
    """A boot-up of a node that was there already."""


SILENT, STATE, BEAT, BIT_7, LIFE = "silent", "state", "beat", "bit 7", "life"
CAUSES = {
    SILENT: What.NODE_GUARDING,
    STATE: What.NODE_GUARDING,
    BEAT: What.HEARTBEAT,
    BIT_7: What.HEARTBEAT,
    LIFE: What.LIFE_GUARDING,
}
"""What begins and ends, by its cause."""


@dataclass(frozen=True, slots=True)
class Event:
    """Something that happened to a node.

    Args:
        what: see there.
        node_id: to whom.
        at: instant of the frame, or at which the time was over.
        text: for people.
        over: it has ended, rather than begun.
        asked: a restart that the manager itself commanded.
    """

    what: What
    node_id: int
    at: int
    text: str
    over: bool = False
    asked: bool = False


class Manager:
    """Manages one node.

    Args:
        node_id: 1..127.
        settle_ns: how long after a command the node may still show its old state.

    Raises:
        ValueError: that is no node id.
    """

    def __init__(self, node_id: int, settle_ns: int = SETTLE_NS) -> None:
        if node_id not in NODE_IDS:
            raise ValueError(f"node id {node_id}: write 1..127")
        self.node_id = node_id
        self.state: State | None = None
        """As the node last showed it; None = it never did, or showed none that there is."""
        self.expected: State | None = None
        """Where the last command or boot-up leads; None = not known."""
        self.events: list[Event] = []
        """What happened, oldest first; `take_events` empties it."""
        self._open: dict[str, What] = {}
        """Events that have begun and not ended, by their causes."""
        self._settle_ns = settle_ns
        self._settled_at = 0
        self._unsettled: frozenset[State | None] = frozenset()
        """What else than `expected` it may show until then; None = anything."""
        self._reset_asked = False
        self._replied_since_boot = False
        self._guard_ns = self._life_ns = 0
        self._poll_at: int | None = None
        self._life_at: int | None = None
        self._toggle: int | None = None
        self._consumer_ns = 0
        self._beats_stored = False
        self._beat_at: int | None = None
        self._poll = Frame(ERROR_CONTROL + node_id, remote=True, dlc=1)

    def take_events(self) -> list[Event]:
        """What has happened since this was last asked."""
        taken, self.events = self.events, []
        return taken

    @property
    def lost(self) -> frozenset[What]:
        """Events that have begun and not ended."""
        return frozenset(self._open.values())

    # Commands: each gives the frame to send.

    def start(self, now: int) -> Frame:
        """To operational."""
        return self._command(Nmt.START, now)

    def stop(self, now: int) -> Frame:
        """To stopped."""
        return self._command(Nmt.STOP, now)

    def pre_operational(self, now: int) -> Frame:
        """Back to pre-operational, where the node can be set up."""
        return self._command(Nmt.PRE_OPERATIONAL, now)

    def reset(self, now: int) -> Frame:
        """Reset of the whole node: it starts anew."""
        return self._command(Nmt.RESET_NODE, now)

    def reset_communication(self, now: int) -> Frame:
        """Reset of its communication: settings of 1000h to 1FFFh as after power-on."""
        return self._command(Nmt.RESET_COMMUNICATION, now)

    def _command(self, command: Nmt, now: int) -> Frame:
        self.told(command, now)
        return nmt_frame(command, self.node_id)

    def told(self, command: Nmt, now: int) -> None:
        """The node was given a command, by whomever: what it should show from now on."""
        leads_to = LEADS_TO[command]
        still = self._unsettled if now < self._settled_at else frozenset()
        self._unsettled = still | {self.expected}
        self._reset_asked = leads_to is State.STARTING
        self.expected = None if self._reset_asked else leads_to
        self._settled_at = now + self._settle_ns

    # Error control.

    def guard(self, guard_ns: int, factor: int, now: int) -> None:
        """Poll the node from now on; the first poll is due at once.

        Args:
            guard_ns: time from poll to poll (100Ch); 0 ends guarding.
            factor: life time factor (100Dh); with 0 no life time is watched.
            now: the present instant.
        """
        self._guard_ns, self._life_ns = guard_ns, guard_ns * factor
        self._poll_at = now if guard_ns else None
        self._life_at = None
        if self._replied_since_boot:
            self._toggle = None  # a pause in guarding may have reset it, or not
        self._open.pop(SILENT, None)
        self._open.pop(STATE, None)
        if guard_ns:
            self.heartbeat(0, now)

    @property
    def guarding(self) -> bool:
        """The node is polled."""
        return self._poll_at is not None

    def heartbeat(self, consumer_ns: int, now: int, *, written: bool = False) -> None:
        """Watch the heartbeat of the node from its next beat on.

        Heartbeat and guarding exclude each other: watching ends guarding.

        Args:
            consumer_ns: longest time from beat to beat (1016h); 0 ends watching.
            now: the present instant.
            written: the producer time (1017h) was written just now: the heartbeat begins at
                once. Else it is stored in the node: the boot-up is its first beat.
        """
        self._consumer_ns = consumer_ns
        self._beats_stored = not written
        self._beat_at = now + consumer_ns if consumer_ns and written else None
        self._open.pop(BEAT, None)
        self._open.pop(BIT_7, None)
        if consumer_ns:
            self.guard(0, 0, now)

    # What the node sent.

    def update(self, frame: Frame, at: int) -> None:
        """A frame was on the bus at `at`; whatever is not the node's is passed over.

        A command (COB-ID 0) means something to slaves only.
        """
        if frame.extended or frame.remote:
            return
        if frame.can_id == self._poll.can_id and len(frame.data) == 1:
            self._error_control(frame.data[0], at)
        elif frame.can_id == EMCY + self.node_id and len(frame.data) == 8:
            self._emcy(frame.data[0] | frame.data[1] << 8, at)

    def _error_control(self, byte: int, at: int) -> None:
        if byte == 0:
            self._booted(at)
            return
        self.state = SHOWN.get(byte & 0x7F)
        if self.guarding:
            self._replied(byte >> 7, at)
        elif byte >> 7 and self._consumer_ns:
            self._begin(BIT_7, at, f"bit 7 is set in the heartbeat {byte:02X}h")
        elif not byte >> 7:
            self._beat(at)

    def _booted(self, at: int) -> None:
        asked, self._reset_asked = self._reset_asked, False
        if asked or self.state is not None:
            text = "as commanded" if asked else "by itself"
            self.events.append(Event(What.RESTART, self.node_id, at, text, asked=asked))
        self.state = self.expected = State.PRE_OPERATIONAL
        self._settled_at = at
        self._toggle = 0
        self._replied_since_boot = False
        if self._beats_stored:
            self._beat(at)
        else:
            # What was written is gone: it beats again only if somebody writes or stored it.
            self._beat_at = None

    def _beat(self, at: int) -> None:
        if self._consumer_ns:
            self._beat_at = at + self._consumer_ns
        self._end(BEAT, at, "heartbeat is back")
        self._end(BIT_7, at, "bit 7 is 0 again")

    def _replied(self, toggle: int, at: int) -> None:
        self._replied_since_boot = True
        self._life_at = at + self._life_ns if self._life_ns else None
        self._end(SILENT, at, "the node replies again")
        wanted, self._toggle = self._toggle, 1 - toggle
        if wanted not in {None, toggle}:
            text = f"toggle bit {toggle} in the reply, where {wanted} was due"
            self.events.append(Event(What.NODE_GUARDING, self.node_id, at, text))
        if self._may_show(self.state, at):
            self._end(STATE, at, f"the node shows {self.state}")
        else:
            shows = self.state or "no state that there is"
            self._begin(STATE, at, f"the node shows {shows}, expected was {self.expected}")

    def _may_show(self, state: State | None, at: int) -> bool:
        if state is None:
            return False
        if self.expected in {None, state}:
            return True
        return at < self._settled_at and bool({None, state} & self._unsettled)

    def _emcy(self, code: int, at: int) -> None:
        if code == LIFE_GUARD_CODE:
            self._begin(LIFE, at, "the device missed its master (EMCY 8130h)")
        elif code == 0:
            self._end(LIFE, at, "the device has no error left (EMCY 0000h)")

    def _begin(self, cause: str, at: int, text: str) -> None:
        if cause not in self._open:
            what = self._open[cause] = CAUSES[cause]
            self.events.append(Event(what, self.node_id, at, text))

    def _end(self, cause: str, at: int, text: str) -> None:
        what = self._open.pop(cause, None)
        if what is not None:
            self.events.append(Event(what, self.node_id, at, text, over=True))

    # Time.

    def advance(self, now: int) -> Frames:
        """Time has come to `now`: polls that are due, and what stayed away too long."""
        if self._beat_at is not None and now >= self._beat_at:
            at, self._beat_at = self._beat_at, None
            text = f"no heartbeat within {show_span(self._consumer_ns)}"
            self._begin(BEAT, at, text)
        if self._life_at is not None and now >= self._life_at:
            at, self._life_at = self._life_at, None
            text = f"no reply within the life time of {show_span(self._life_ns)}"
            self._begin(SILENT, at, text)
        if self._poll_at is None or now < self._poll_at:
            return NOTHING
        if self._life_at is None and self._life_ns and SILENT not in self._open:
            self._life_at = now + self._life_ns
        missed = (now - self._poll_at) // self._guard_ns
        self._poll_at += (missed + 1) * self._guard_ns
        return (self._poll,)

    def deadline(self) -> int | None:
        """When `advance` must be called next, or None."""
        instants = (self._beat_at, self._life_at, self._poll_at)
        return min((at for at in instants if at is not None), default=None)


class NodeList(Mapping[int, Manager]):
    """The managers of many nodes, by node id.

    Args:
        node_ids: of the nodes, 1..127.
        settle_ns: see `Manager`.
    """

    def __init__(self, node_ids: Iterable[int], settle_ns: int = SETTLE_NS) -> None:
        self._managers = {node_id: Manager(node_id, settle_ns) for node_id in node_ids}
        self._by_can_id: dict[int, Callable[[Frame, int], None]] = {
            base + node_id: manager.update
            for node_id, manager in self._managers.items()
            for base in (EMCY, ERROR_CONTROL)
        }

    def __getitem__(self, node_id: int) -> Manager:
        return self._managers[node_id]

    def __iter__(self) -> Iterator[int]:
        return iter(self._managers)

    def __len__(self) -> int:
        return len(self._managers)

    def states(self) -> dict[int, State | None]:
        """The state of each node, as it last showed it."""
        return {node_id: manager.state for node_id, manager in self.items()}

    def command(self, command: Nmt, now: int) -> Frame:
        """One frame that gives every node on the bus a command."""
        for manager in self.values():
            manager.told(command, now)
        return nmt_frame(command, EVERY_NODE)

    def update(self, frame: Frame, at: int) -> None:
        """A frame was on the bus: whoever manages its sender is told."""
        update = self._by_can_id.get(frame.can_id)
        if update is not None:
            update(frame, at)

    def advance(self, now: int) -> list[Frame]:
        """The polls that are due by now."""
        return [frame for manager in self.values() for frame in manager.advance(now)]

    def deadline(self) -> int | None:
        """When `advance` must be called next, or None."""
        instants = (manager.deadline() for manager in self.values())
        return min((at for at in instants if at is not None), default=None)

    def take_events(self) -> list[Event]:
        """What has happened to any node since this was last asked, oldest first."""
        events = [event for manager in self.values() for event in manager.take_events()]
        return sorted(events, key=lambda event: event.at)
