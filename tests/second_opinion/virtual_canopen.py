"""The canopen package on our wire in virtual time: its clients speak to our devices.

canopen waits in queues and conditions and reads the wall clock. Here a wait runs the world
until what is waited for has come, and the clock is that of the world. Nothing else of the
package is changed.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from queue import Empty
from types import TracebackType

import canopen
import canopen.emcy
import canopen.lss
import canopen.nmt
import canopen.sdo.client
import pytest

from node_model.devices import make_device
from node_model.frame import Frame
from node_model.node import Panel, S
from node_model.world import World

BIT_RATE = 250_000
EDS = "node_model/profiles/drive.eds"
MODULES = (canopen.emcy, canopen.lss, canopen.nmt, canopen.sdo.client)
"""Modules of the package that read the wall clock."""


class VirtualNetwork(canopen.Network):
    """A network whose bus is a virtual wire with our device on it.

    Args:
        device: the device, switched off.
    """

    def __init__(self, device: Panel) -> None:
        super().__init__()
        self.device = device
        self.world = World(BIT_RATE)
        self.tester = self.world.attach(None)
        self.controller = self.world.attach(device)
        self.frames = 0
        self.lss.responses = VirtualQueue(self)  # type: ignore[assignment]

    def send_message(self, can_id: int, data: bytes, remote: bool = False) -> None:
        """See canopen.Network."""
        dlc = len(data or b"") if remote else -1
        frame = Frame(can_id, b"" if remote else bytes(data), remote, can_id > 0x7FF, dlc)
        self.world.send(self.tester, frame)

    def run(self, span_ns: int, done: Callable[[], bool] = lambda: False) -> None:
        """Let virtual time pass, at most that long, until something is done."""
        until = self.world.now + span_ns
        while not done():
            found = self.world.next_frame(until)
            if found is None:
                return
            frame, at, sender, _ = found
            self.frames += 1
            if sender is not self.tester and not frame.remote:
                self.notify(frame.can_id, bytearray(frame.data), at / S)

    def power_on(self) -> None:
        """Switch the device on; it has booted afterwards."""
        self.world.act(self.controller, self.device.power_on)
        self.run(1 * S, lambda: self.frames > 0)

    def join(self, node_id: int) -> canopen.RemoteNode:
        """A remote node of this network that waits in virtual time."""
        node = self.add_node(node_id, EDS)
        node.sdo.responses = VirtualQueue(self)
        node.nmt.state_update = VirtualCondition(self)  # type: ignore[assignment]
        node.emcy.emcy_received = VirtualCondition(self)  # type: ignore[assignment]
        for one in (*node.tpdo.values(), *node.rpdo.values()):
            one.receive_condition = VirtualCondition(self)
        return node


class VirtualQueue:
    """A queue whose `get` lets virtual time pass."""

    def __init__(self, network: VirtualNetwork) -> None:
        self._network = network
        self._items: deque[bytes] = deque()
        self.strays = 0
        """Answers that nobody had asked for."""

    def put(self, item: bytes) -> None:
        """Append."""
        self._items.append(item)

    def empty(self) -> bool:
        """Asked before each request: what is still here was not asked for, and is dropped."""
        self.strays += len(self._items)
        self._items.clear()
        return True

    def get(self, block: bool = True, timeout: float = 0.0) -> bytes:
        """The next item; queue.Empty when none comes in time."""
        self._network.run(round(timeout * S) if block else 0, lambda: bool(self._items))
        if not self._items:
            raise Empty
        return self._items.popleft()


class VirtualCondition:
    """A condition whose `wait` lets virtual time pass."""

    def __init__(self, network: VirtualNetwork) -> None:
        self._network = network
        self._told = 0

    def __enter__(self) -> None:
        """There is one thread, and so nothing to lock."""

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Nothing was locked."""

    def notify_all(self) -> None:
        """What was waited for has come."""
        self._told += 1

    def wait(self, timeout: float) -> bool:
        """Whether it came in time."""
        before = self._told
        self._network.run(round(timeout * S), lambda: self._told > before)
        return self._told > before


class VirtualClock:
    """What canopen uses of the module `time`."""

    def __init__(self, world: World) -> None:
        self._world = world
        self.network: VirtualNetwork | None = None

    def time(self) -> float:
        """Seconds."""
        return self._world.now / S

    def sleep(self, seconds: float) -> None:
        """Let virtual time pass."""
        assert self.network is not None
        self.network.run(round(seconds * S))


@contextmanager
def virtual_network(node_id: int = 5) -> Iterator[tuple[VirtualNetwork, canopen.RemoteNode]]:
    """A drive that has booted, and canopen's view of it."""
    network = VirtualNetwork(make_device("drive", node_id=node_id))
    clock = VirtualClock(network.world)
    clock.network = network
    with pytest.MonkeyPatch.context() as patch:
        for module in MODULES:
            patch.setattr(module, "time", clock)
        node = network.join(node_id)
        network.power_on()
        yield network, node
