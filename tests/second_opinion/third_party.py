"""Devices that nobody here wrote, on our wire in virtual time.

canopen's LocalNode and durand's Node do what their authors wrote; the adapters carry frames
to and from them and tell them the time. A device starts anew with each power-on.
"""

from __future__ import annotations

import heapq
import itertools
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, nullcontext, suppress
from importlib.metadata import version
from types import SimpleNamespace
from typing import Any

import canopen
import canopen.network
from canopen.objectdictionary.eds import import_eds
from durand.datatypes import DatatypeEnum
from durand.node import MinimalNode
from durand.object_dictionary import ObjectDictionary, Record, Variable
from durand.scheduler import AbstractScheduler, set_scheduler

from node_model.devices import Blueprint, Kind, Settings
from node_model.frame import Frame
from node_model.node import MS, NOTHING, Frames, S

BIT_RATE = 250_000
NODE_ID = 5
EDS = "node_model/profiles/drive.eds"
IDENTITY = (0x0000_1234, 0x0000_5678, 0x0001_0002, 0x0000_9ABC)


class ThirdParty:
    """What both adapters share: power, and no keys, LEDs or errors of their own."""

    name = ""
    keys: tuple[str, ...] = ()
    leds: tuple[str, ...] = ()
    faults: tuple[str, ...] = ()

    def __init__(self, node_id: int) -> None:
        self.node_id = node_id
        self.powered = False
        self.bit_rate = 0
        self.listens_to: frozenset[int] | None = None
        self.now = 0
        self._sent: list[Frame] = []
        self._boot_at: int | None = None
        self.end()

    def power_on(self, now: int) -> Frames:
        """It starts a moment later."""
        if not self.powered:
            self.powered = True
            self._boot_at = now + 10 * MS
        return NOTHING

    def power_off(self, now: int) -> Frames:  # noqa: ARG002  a verb of every node
        """Everything is lost."""
        self.powered, self.bit_rate, self._boot_at = False, 0, None
        self.end()
        return NOTHING

    def receive(self, frame: Frame, now: int) -> Frames:
        """A frame of another station; its program answers before it returns."""
        if not self.bit_rate:
            return NOTHING
        self.now = now
        self.hear(frame)
        return self._taken()

    def advance(self, now: int) -> Frames:
        """The start, and whatever its program has planned."""
        frames: list[Frame] = []
        while (due := self.deadline()) is not None and due <= now:
            self.now = due
            if self._boot_at is not None:
                self._boot_at, self.bit_rate = None, BIT_RATE
                self.begin()
            else:
                self.fire()
            frames += self._taken()
        return frames

    def deadline(self) -> int | None:
        """See Node."""
        return self.planned() if self._boot_at is None else self._boot_at

    def send(self, can_id: int, data: bytes, remote: bool = False) -> None:
        """Its program sends."""
        self._sent.append(Frame(can_id, b"" if remote else bytes(data), remote))

    def _taken(self) -> Frames:
        taken, self._sent = self._sent, []
        return taken

    # What an adapter adds.

    def begin(self) -> None:
        """Its program starts."""
        raise NotImplementedError

    def end(self) -> None:
        """Its program is gone."""

    def hear(self, frame: Frame) -> None:
        """Its program receives a frame."""
        raise NotImplementedError

    def fire(self) -> None:
        """What it has planned for now."""
        raise NotImplementedError

    def planned(self) -> int | None:
        """When it next wants to do something."""
        raise NotImplementedError

    # What a bench asks of every panel.

    def hold(self, held: frozenset[str], now: int) -> Frames:
        """It has no keys."""
        raise ValueError(f"no keys: {held} at {now}")

    def lit(self, led: str, now: int) -> bool:
        """It has no LEDs."""
        raise ValueError(f"no LED {led} at {now}")

    def lamp_change(self, now: int) -> int | None:  # noqa: ARG002
        """It has no LEDs."""
        return None

    def fail(self, active: frozenset[str], now: int) -> Frames:
        """It has no errors that a bench can raise."""
        raise ValueError(f"no errors: {active} at {now}")

    def image(self) -> bytes:
        """It has no memory."""
        return b""


class Calendar(AbstractScheduler[list[Any]]):
    """durand's scheduler on the time of our wire."""

    def __init__(self, device: ThirdParty) -> None:
        self._device = device
        self._order = itertools.count()
        self.entries: list[list[Any]] = []

    def add(
        self,
        delay: float,
        callback: Callable[..., object],
        args: Sequence[object] = (),
        kwargs: dict[str, object] | None = None,
    ) -> list[Any]:
        """Plan a call."""
        due = self._device.now + round(delay * S)
        entry = [due, next(self._order), lambda: callback(*args, **(kwargs or {}))]
        heapq.heappush(self.entries, entry)
        return entry

    def cancel(self, entry: list[Any]) -> None:
        """Forget it; one that was called is gone already."""
        if entry in self.entries:
            self.entries.remove(entry)
            heapq.heapify(self.entries)

    @property
    def lock(self) -> AbstractContextManager[None]:
        """There is one thread."""
        return nullcontext()


class DurandDevice(ThirdParty):
    """durand's node, with some objects of an application."""

    name = "durand"

    def begin(self) -> None:
        """A new node on a new calendar."""
        self._calendar = Calendar(self)
        self._subscribed: dict[int, Callable[[int, bytes], None]] = {}
        set_scheduler(self._calendar)
        self.node = MinimalNode(self, self.node_id, durand_objects())
        identity = self.node.object_dictionary[0x1018]
        for sub, number in enumerate(IDENTITY, 1):
            identity[sub].value = number
            self.node.object_dictionary.write(0x1018, sub, number)

    def end(self) -> None:
        """Nothing is planned any more."""
        self._calendar = Calendar(self)

    def hear(self, frame: Frame) -> None:
        """As durand's listener: remote frames are passed over."""
        set_scheduler(self._calendar)
        callback = self._subscribed.get(frame.can_id)
        if callback is not None and not frame.remote and not frame.extended:
            callback(frame.can_id, frame.data)

    def fire(self) -> None:
        """The first entry of its calendar."""
        set_scheduler(self._calendar)
        heapq.heappop(self._calendar.entries)[2]()

    def planned(self) -> int | None:
        """Its first entry."""
        entries = self._calendar.entries
        return int(entries[0][0]) if entries else None

    # What durand asks of a network.

    def add_subscription(self, cob_id: int, callback: Callable[[int, bytes], None]) -> None:
        """Frames with this identifier go to `callback`."""
        self._subscribed[cob_id] = callback

    def remove_subscription(self, cob_id: int) -> None:
        """No more."""
        self._subscribed.pop(cob_id)


def durand_objects() -> ObjectDictionary:
    """Objects of an application, as a user of durand would add them."""
    od = ObjectDictionary()
    od[0x2000] = Variable(DatatypeEnum.DOMAIN, "rw", b"", name="Domain")
    numbers = Record(name="Numbers")
    for sub, kind in enumerate(("UNSIGNED8", "UNSIGNED16", "UNSIGNED32"), 1):
        numbers[sub] = Variable(DatatypeEnum[kind], "rw", 0, name=kind)
    od[0x2010] = numbers
    kind = DatatypeEnum.INTEGER16
    od[0x2011] = Variable(kind, "rw", 0, minimum=-100, maximum=100, name="Limited")
    od[0x2012] = Variable(DatatypeEnum.UNSIGNED8, "wo", 0, name="Secret")
    return od


def durand_eds() -> str:
    """The electronic data sheet that durand's node makes of itself."""
    device = DurandDevice(NODE_ID)
    device.power_on(0)
    device.advance(S)
    return str(device.node.eds.content)


class Task:
    """What canopen's periodic tasks can do, on the time of our wire."""

    def __init__(self, device: LocalDevice, frame: Frame, period_ns: int) -> None:
        self._device = device
        self.frame = frame
        self.period_ns = period_ns
        self.due_at = device.now  # python-can sends the first one at once

    def update(self, data: Sequence[int]) -> None:
        """Other data from the next frame on."""
        self.frame = Frame(self.frame.can_id, bytes(data))

    def stop(self) -> None:
        """No more."""
        self._device.tasks.remove(self)


class LocalNetwork(canopen.Network):
    """canopen's network without a bus: what it sends goes to the device's wire."""

    def __init__(self, device: LocalDevice) -> None:
        super().__init__()
        self._device = device

    def send_message(self, can_id: int, data: bytes, remote: bool = False) -> None:
        """See canopen.Network."""
        self._device.send(can_id, data, remote)

    def send_periodic(self, can_id: int, data: bytes, period: float, remote: bool = False) -> Any:
        """See canopen.Network."""
        assert not remote
        task = Task(self._device, Frame(can_id, bytes(data)), round(period * S))
        self._device.tasks.append(task)
        return task


class LocalDevice(ThirdParty):
    """canopen's LocalNode with the objects of our drive."""

    name = "LocalNode"
    tasks: list[Task]

    def begin(self) -> None:
        """A new node, which a user starts as canopen's documentation says."""
        self.tasks = []
        self._network = LocalNetwork(self)
        self.node = canopen.LocalNode(self.node_id, import_eds(EDS, self.node_id))
        self._network[self.node_id] = self.node
        self.node.nmt.state = "INITIALISING"
        self.node.nmt.state = "PRE-OPERATIONAL"

    def end(self) -> None:
        """Nothing is sent any more."""
        self.tasks = []

    def hear(self, frame: Frame) -> None:
        """As canopen's listener: remote frames are passed over, 29 bits are not seen.

        What its program raises is logged there, and nothing else comes of it.
        """
        if not frame.remote:
            with suppress(Exception):
                self._network.notify(frame.can_id, bytearray(frame.data), self.now / S)

    def fire(self) -> None:
        """The task that is due."""
        task = min(self.tasks, key=lambda each: each.due_at)
        task.due_at += task.period_ns
        self.send(task.frame.can_id, task.frame.data)

    def planned(self) -> int | None:
        """Its first task."""
        return min((task.due_at for task in self.tasks), default=None)


def blueprint(make: Callable[[int], ThirdParty]) -> Blueprint[Any]:
    """What a virtual bench builds a third-party device from; its memory is its node id."""

    def memory(facts: object, settings: Settings) -> bytes:  # noqa: ARG001  some have facts
        return bytes((settings["node_id"],))

    def maker(facts: object, image: bytes) -> Any:  # noqa: ARG001  a maker has facts
        return make(image[0] if image else NODE_ID)

    kind: Kind[Any] = Kind(
        "generic", lambda _: None, maker, memory, range(1, 128), lambda facts, _: facts
    )
    factory = SimpleNamespace(bit_rate=BIT_RATE)
    return Blueprint(kind, SimpleNamespace(factory=factory), maker)


VERSIONS = {name: version(name) for name in ("durand", "canopen")}
