"""A keypad made of canopen's LocalNode on python-can's virtual bus, as one would today."""

from __future__ import annotations

import logging
import threading
from collections.abc import Iterable, Sequence
from time import perf_counter, process_time
from types import TracebackType
from typing import Any, Self

import can
import canopen
from canopen.objectdictionary import ODArray, ODRecord, ODVariable, datatypes

_KEYS = 0x2000
_WAIT_S = 1.0
_SHORTEST_MS = 1
"""LocalNode takes its heartbeat time in whole milliseconds."""


def _variable(index: int, subindex: int, kind: int, value: int) -> ODVariable:
    variable = ODVariable(f"{index:X}sub{subindex}", index, subindex)
    variable.data_type = kind
    variable.access_type = "rw"
    variable.default = value
    return variable


def _dictionary(node_id: int) -> canopen.ObjectDictionary:
    """Heartbeat time, one TPDO with one byte of keys."""
    dictionary: Any = canopen.ObjectDictionary()
    dictionary.node_id = node_id
    dictionary.add_object(_variable(0x1017, 0, datatypes.UNSIGNED16, 0))
    dictionary.add_object(_variable(_KEYS, 0, datatypes.UNSIGNED8, 0))
    communication = ODRecord("TPDO1 communication", 0x1800)
    communication.add_member(_variable(0x1800, 0, datatypes.UNSIGNED8, 2))
    communication.add_member(_variable(0x1800, 1, datatypes.UNSIGNED32, 0x180 + node_id))
    communication.add_member(_variable(0x1800, 2, datatypes.UNSIGNED8, 255))
    dictionary.add_object(communication)
    mapping = ODArray("TPDO1 mapping", 0x1A00)
    mapping.add_member(_variable(0x1A00, 0, datatypes.UNSIGNED8, 1))
    mapping.add_member(_variable(0x1A00, 1, datatypes.UNSIGNED32, _KEYS << 16 | 8))
    dictionary.add_object(mapping)
    return dictionary


class LocalKeypad:
    """LocalNode on one virtual bus, a tester on another; a context manager.

    Args:
        node_id: 1..127.
        master: the tester is a canopen Network with a thread of its own that wakes the one
            that waits, as canopen's users have it; else it reads its bus itself.
    """

    def __init__(self, node_id: int, master: bool = False) -> None:
        logging.getLogger("canopen").setLevel(logging.ERROR)
        channel = f"nodeproof-benchmark-{master}"
        self._network = canopen.Network()
        self._network.connect(interface="virtual", channel=channel)
        self._arrived = threading.Semaphore(0)
        self._tester: can.BusABC | canopen.Network
        if master:
            self._tester = canopen.Network()
            self._tester.connect(interface="virtual", channel=channel)
            for cob_id in (0x180 + node_id, 0x700 + node_id):
                self._tester.subscribe(cob_id, lambda *_: self._arrived.release())
        else:
            self._tester = can.Bus(interface="virtual", channel=channel)
        # Any: canopen is annotated in part, and nodes have ids that may be None to it.
        self._node: Any = canopen.LocalNode(node_id, _dictionary(node_id))
        self._network.add_node(self._node)
        self._pdo = self._node.tpdo[1]
        self._pdo.read(from_od=True)
        self._node.nmt.state = "INITIALISING"
        self._node.nmt.state = "PRE-OPERATIONAL"
        self._node.nmt.state = "OPERATIONAL"
        self._drain()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self._network.disconnect()
        if isinstance(self._tester, canopen.Network):
            self._tester.disconnect()
        else:
            self._tester.shutdown()

    def push(self, masks: Iterable[int | None]) -> None:
        """Send as fast as it goes, each frame received by the tester.

        A heartbeat goes out by the call with which LocalNode sends its boot-up (it has no
        other way to send one now), a key frame as its TPDO.

        Args:
            masks: for each frame the keys to report, or None for a heartbeat.

        Raises:
            RuntimeError: a frame did not arrive.
        """
        network, pdo, keys = self._network, self._pdo, self._pdo[0]
        cob_id, status = 0x700 + self._node.id, b"\x05"
        receive = self._receive
        for mask in masks:
            if mask is None:
                network.send_message(cob_id, status)
            else:
                keys.raw = mask
                pdo.transmit()
            if not receive(_WAIT_S):
                raise RuntimeError("the virtual bus lost a frame")

    def live(self, masks: Sequence[int | None]) -> float:
        """Processor seconds, of all threads, for a node that lives and a master that listens.

        Its heartbeats come from its own timer, at its shortest period. A key is told as an
        application does it: the object is written, the TPDO sent, when its turn has come.

        Args:
            masks: for each frame in turn the keys to report, or None for a heartbeat to await.

        Raises:
            RuntimeError: a frame did not arrive.
        """
        pdo, keys = self._pdo, self._pdo[0]
        self._node.nmt.start_heartbeat(_SHORTEST_MS)
        self._receive(_WAIT_S)
        began = process_time()
        for mask in masks:
            if mask is not None:
                keys.raw = mask
                pdo.transmit()
            if not self._receive(_WAIT_S):
                raise RuntimeError("the virtual bus lost a frame")
        took = process_time() - began
        self._node.nmt.stop_heartbeat()
        self._drain()
        return took

    def beat(self, count: int) -> float:
        """Seconds for `count` heartbeats of LocalNode's own, at its shortest period."""
        self._node.nmt.start_heartbeat(_SHORTEST_MS)
        self._receive(_WAIT_S)
        began = perf_counter()
        for _ in range(count):
            self._receive(_WAIT_S)
        took = perf_counter() - began
        self._node.nmt.stop_heartbeat()
        self._drain()
        return took

    def _drain(self) -> None:
        while self._receive(0.01):
            pass

    def _receive(self, wait_s: float) -> bool:
        """Whether a frame came within that time."""
        if isinstance(self._tester, canopen.Network):
            return self._arrived.acquire(timeout=wait_s)
        return self._tester.recv(wait_s) is not None
