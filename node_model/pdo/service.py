"""All PDOs of a device, and what happens to them in each phase of a SYNC (CiA 301 4.2.0, 7.2.2).

Laws: nothing is sent or taken outside operational. At a SYNC first the received synchronous
data go to the object dictionary, then the synchronous TPDOs are sampled, all at that
instant. They are sent one after the other; those that the window closes before are dropped,
and taken back where they still wait for the bus.

Wiring: after the error handler and SYNC. The application is told by `applied` of each object
that an RPDO has written, and tells by `written` of each mapped object that it has written by
itself; what clients write is seen here.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from node_model.frame import Frame
from node_model.nmt import NmtState
from node_model.node import NOTHING, Frames, earliest
from node_model.od import Entry, ObjectDictionary
from node_model.pdo.receive import Rpdo
from node_model.pdo.transmit import Tpdo
from node_model.service import ErrorHandler, QuietService
from node_model.sync import SyncService

RPDOS = range(0x1400, 0x1600)
TPDOS = range(0x1800, 0x1A00)

Applied = Callable[[int, int, int], None]
"""Called with index, sub-index and instant after an RPDO has written an object."""


def _nobody(index: int, sub: int, now: int) -> None:
    """An application that looks at its objects when it wants to."""


class PdoService(QuietService):
    """The PDOs of a device.

    Args:
        od: has their parameters and what they map.
        errors: is told of RPDOs that are short or missing.
        sync: whose SYNCs they follow, and whose window they keep.
        applied: told of objects that RPDOs have written.
        turnaround_ns: from a SYNC to the first synchronous TPDO, and from each to the next.
        tpdo: makes a TPDO.
        rpdo: makes an RPDO.
    """

    set_up_by = range(RPDOS.start, TPDOS.stop)

    def __init__(
        self,
        od: ObjectDictionary,
        errors: ErrorHandler,
        sync: SyncService,
        applied: Applied = _nobody,
        turnaround_ns: int = 0,
        *,
        tpdo: Callable[[ObjectDictionary, int], Tpdo] = Tpdo,
        rpdo: type[Rpdo] = Rpdo,
    ) -> None:
        self._od = od
        self._sync = sync
        self._applied = applied
        self._turnaround_ns = turnaround_ns
        self._waiting: list[tuple[int, Frame]] = []
        # The parameters of each PDO are observed by itself first, then here.
        self.tpdos = [tpdo(od, index) for index in sorted(od.indices) if self._is(index, TPDOS)]
        self.rpdos = [
            rpdo(od, index, errors, self._write)
            for index in sorted(od.indices)
            if self._is(index, RPDOS)
        ]
        self._pdos: tuple[Rpdo | Tpdo, ...] = (*self.rpdos, *self.tpdos)
        self._living_rpdos: tuple[Rpdo, ...] = ()
        self._living_tpdos: tuple[Tpdo, ...] = ()
        self._synchronous_ids: set[int] = set()
        for pdo in self._pdos:
            od.observe(pdo.parameters.index, self._set_up)
        mappable = {entry.index for entry in od.entries.values() if entry.pdo}
        self.timed_by = mappable.union(filter(self.set_up_by.__contains__, od.indices))
        for index in sorted(mappable):
            od.observe(index, partial(self.written, index))
        sync.tell(self.on_sync)

    def _is(self, index: int, kind: range) -> bool:
        """A communication parameter that has a mapping."""
        return index in kind and index + 0x200 in self._od

    # The verbs of a service.

    def listens_to(self) -> frozenset[int]:
        """The RPDOs, and remote frames for the TPDOs."""
        parameters = [rpdo.parameters for rpdo in self.rpdos]
        parameters += [tpdo.parameters for tpdo in self.tpdos if tpdo.answers_remote()]
        return frozenset(each.can_id() for each in parameters if each.is_valid())

    def start(self, now: int) -> Frames:
        """No PDO lives yet."""
        self.stop()
        return super().start(now)

    def enter(self, state: NmtState, now: int) -> Frames:
        """Operational brings them to life, every other state ends that."""
        if state is self.state:
            return NOTHING
        super().enter(state, now)
        if not self.may_act():
            self._end()
            return NOTHING
        for rpdo in self.rpdos:
            rpdo.begin()
        for tpdo in self.tpdos:
            tpdo.begin(now)
        self._see_who_lives()
        return self.advance(now)

    def receive(self, frame: Frame, now: int) -> Frames:
        """An RPDO, or a remote frame for a TPDO."""
        if not self.may_act():
            return NOTHING
        frames = NOTHING
        if frame.remote:
            for tpdo in self._living_tpdos:
                if tpdo.parameters.can_id() == frame.can_id:
                    frames = (*frames, *tpdo.on_remote(now))
            return frames
        window_open = self._sync.is_open(now)
        for rpdo in self._living_rpdos:
            if rpdo.parameters.can_id() == frame.can_id:
                frames = (*frames, *rpdo.on_data(frame.data, window_open, now))
        return frames

    def advance(self, now: int) -> Frames:
        """What is due, oldest first."""
        frames = NOTHING
        while (due := self.deadline()) is not None and due <= now:
            frames = (*frames, *self._send_synchronous(due))
            for rpdo in self._living_rpdos:
                frames = (*frames, *rpdo.advance(due))
            for tpdo in self._living_tpdos:
                frames = (*frames, *tpdo.advance(due))
        return frames

    def deadline(self) -> int | None:
        """The next PDO to send or to miss."""
        soonest = self._waiting[0][0] if self._waiting else None
        for rpdo in self._living_rpdos:
            if (due := rpdo.deadline()) is not None:
                soonest = earliest(soonest, due)
        for tpdo in self._living_tpdos:
            if (due := tpdo.deadline()) is not None:
                soonest = earliest(soonest, due)
        return soonest

    def stop(self) -> None:
        """No PDO lives any more."""
        super().stop()
        self._end()
        for tpdo in self.tpdos:
            tpdo.reset()

    def _end(self) -> None:
        self._waiting = []
        for pdo in self._pdos:
            pdo.end()
        self._see_who_lives()

    def _see_who_lives(self) -> None:
        """Keep to those that do something: most PDOs of a device are off."""
        self._living_rpdos = tuple(rpdo for rpdo in self.rpdos if rpdo.lives)
        self._living_tpdos = tuple(tpdo for tpdo in self.tpdos if tpdo.active)
        synchronous = [tpdo for tpdo in self._living_tpdos if tpdo.is_synchronous()]
        self._synchronous_ids = {tpdo.parameters.can_id() for tpdo in synchronous}

    def _set_up(self, sub: int, now: int) -> None:  # noqa: ARG002  any parameter
        """A client has written a parameter of a PDO."""
        self._see_who_lives()

    # What others tell.

    def on_sync(self, counter: int | None, now: int) -> Frames:
        """The first two phases of a SYNC."""
        if not self.may_act():
            return NOTHING
        self.take_received(now)
        self._waiting = self.sample(counter, now)
        return self._send_synchronous(now)

    def written(self, index: int, sub: int, now: int) -> None:
        """An object has a new value: event-driven TPDOs that map it become due."""
        for tpdo in self._living_tpdos:
            tpdo.on_change((index, sub), now)

    # What decides.

    def may_act(self) -> bool:
        """In operational alone."""
        return self.state is NmtState.OPERATIONAL

    def is_in_time(self, due: int) -> bool:
        """A synchronous TPDO that is sent at `due` still meets the window."""
        return self._sync.is_open(due)

    def withdraws(self, frame: Frame, asked_at: int, now: int) -> bool:
        """A synchronous TPDO that the bus keeps waiting until the window has closed is dropped."""
        if frame.can_id not in self._synchronous_ids or not self._sync.window_ns():
            return False
        synced_at = self._sync.synced_at
        if synced_at is not None and asked_at < synced_at:
            return True
        return self._sync.is_open(asked_at) and not self._sync.is_open(now)

    # What it does.

    def take_received(self, now: int) -> None:
        """What RPDOs have brought since the last SYNC takes effect."""
        for rpdo in self._living_rpdos:
            rpdo.on_sync(now)

    def sample(self, counter: int | None, now: int) -> list[tuple[int, Frame]]:
        """The synchronous TPDOs of this SYNC, and when each is sent."""
        due = now
        waiting = []
        for tpdo in self._living_tpdos:
            data = tpdo.on_sync(counter)
            if data is not None:
                due += self._turnaround_ns
                waiting.append((due, tpdo.frame(data)))
        return waiting

    def _send_synchronous(self, now: int) -> Frames:
        frames = NOTHING
        while self._waiting and self._waiting[0][0] <= now:
            due, frame = self._waiting.pop(0)
            if self.is_in_time(due):
                frames = (*frames, frame)
        return frames

    def _write(self, values: list[tuple[Entry, bytes]], now: int) -> None:
        """All values of an RPDO are written before anybody is told of one."""
        for entry, value in values:
            self._od.put(entry.index, entry.sub, value)
        for entry, _ in values:
            self._applied(entry.index, entry.sub, now)
            self.written(entry.index, entry.sub, now)
