"""How quick an SDO is: round trips in the world beside canopen's RemoteNode and LocalNode.

    python -m benchmarks.sdo

Both sides do expedited uploads and downloads of an UNSIGNED32 and look at each answer. In
the world each frame is arbitrated and takes its bit times, between a tester and a device: the
SDO server alone, and a whole drive. canopen has two networks on python-can's virtual bus,
with the threads that its users have. Processor time of all threads.
"""

from __future__ import annotations

import logging
from collections.abc import Callable
from functools import partial
from types import TracebackType
from typing import Any, Self

import canopen
from canopen.objectdictionary import ODVariable, datatypes

from benchmarks.tables import against, interleaved, ratio, show, timed
from node_model.devices import read
from node_model.frame import Frame
from node_model.node import NOTHING, Frames
from node_model.od import Access, DataType, Entry, ObjectDictionary
from node_model.sdo import SdoServer
from node_model.world import World

NODE_ID = 5
BIT_RATE = 250_000
"""As the drive leaves the factory."""
SECOND = 1_000_000_000
TRIPS = 20_000
SLOW_TRIPS = 1_000
"""canopen's share of one round: enough to be timed, short enough to wait for."""
BAR = 30.0
INDEX = 0x1018
SUB = 1
WRITTEN = 0x1016
"""An object of the drive that takes any value of the consumer's: node 0 is nobody."""
VALUE = b"\0\0\0\0"


class Server:
    """A device that is nothing but its SDO server."""

    bit_rate = BIT_RATE

    def __init__(self) -> None:
        entries = [
            Entry(INDEX, SUB, "vendor", DataType.UNSIGNED32, Access.RO, b"\1\2\3\4"),
            Entry(WRITTEN, SUB, "consumer", DataType.UNSIGNED32, Access.RW, VALUE),
        ]
        self._server = SdoServer(ObjectDictionary(entries), NODE_ID)
        self._server.start(0)
        self.listens_to: frozenset[int] | None = self._server.listens_to()
        self.receive = self._server.receive
        self.deadline = self._server.deadline
        self.advance = self._server.advance

    def power_on(self, now: int) -> Frames:  # noqa: ARG002  a verb of every node
        """It is on."""
        return NOTHING

    def power_off(self, now: int) -> Frames:  # noqa: ARG002  a verb of every node
        """It stays on."""
        return NOTHING


class Virtual:
    """A tester and a device in a world of their own."""

    def __init__(self, device: Any) -> None:
        self._world = World(BIT_RATE)
        self._tester = self._world.attach()
        device_end = self._world.attach(device)
        self._world.act(device_end, device.power_on)
        self._world.run(SECOND)

    def trips(self, request: Frame, answer: bytes, count: int) -> None:
        """Ask, and look at each answer.

        Raises:
            RuntimeError: it was another one.
        """
        world, tester = self._world, self._tester
        send, next_frame = world.send, world.next_frame
        answer_id = 0x580 + NODE_ID
        for _ in range(count):
            send(tester, request)
            until = world.now + SECOND
            while (seen := next_frame(until)) is not None:
                if seen[0].can_id == answer_id:
                    break
            if seen is None or seen[0].data[:4] != answer:
                raise RuntimeError(f"the answer to {request} was {seen}")

    def upload(self, count: int = TRIPS) -> None:
        """Read 1018h:01."""
        request = b"\x40" + INDEX.to_bytes(2, "little") + bytes((SUB, 0, 0, 0, 0))
        self.trips(Frame(0x600 + NODE_ID, request), b"\x43" + request[1:4], count)

    def download(self, count: int = TRIPS) -> None:
        """Write 1016h:01."""
        request = b"\x23" + WRITTEN.to_bytes(2, "little") + bytes((SUB,)) + VALUE
        self.trips(Frame(0x600 + NODE_ID, request), b"\x60" + request[1:4], count)


class Canopen:
    """RemoteNode on one virtual bus, LocalNode on another; a context manager."""

    def __init__(self) -> None:
        logging.getLogger("canopen").setLevel(logging.ERROR)
        self._master, self._slave = canopen.Network(), canopen.Network()
        for network in (self._master, self._slave):
            network.connect(interface="virtual", channel="nodeproof-benchmark-sdo")
        dictionary: Any = canopen.ObjectDictionary()
        variable = ODVariable("value", INDEX, 0)
        variable.data_type = datatypes.UNSIGNED32
        variable.access_type = "rw"
        variable.default = 0x04030201
        dictionary.add_object(variable)
        # Any: canopen is annotated in part.
        local: Any = canopen.LocalNode(NODE_ID, dictionary)
        remote: Any = canopen.RemoteNode(NODE_ID, dictionary)
        self._slave.add_node(local)
        self._master.add_node(remote)
        self._sdo = remote.sdo

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self._master.disconnect()
        self._slave.disconnect()

    def upload(self) -> None:
        """Read it."""
        upload = self._sdo.upload
        for _ in range(SLOW_TRIPS):
            if len(upload(INDEX, 0)) != len(VALUE):
                raise RuntimeError("canopen read something else")

    def download(self) -> None:
        """Write it."""
        download = self._sdo.download
        for _ in range(SLOW_TRIPS):
            download(INDEX, 0, VALUE)


def _alone(request: bytes) -> Callable[[], None]:
    """The server's `receive` without world and wire."""
    server = Server()
    frame = Frame(0x600 + NODE_ID, request)

    def work() -> None:
        receive = server.receive
        for now in range(TRIPS):
            receive(frame, now)

    return work


def _each(work: Callable[[], None], count: int) -> float:
    """Seconds of one round trip."""
    return timed(work) / count


def main() -> None:
    """Measure side by side, and print the table."""
    server = Virtual(Server())
    drive = Virtual(read("drive").with_node_id(NODE_ID).make())
    up = b"\x40" + INDEX.to_bytes(2, "little") + bytes((SUB, 0, 0, 0, 0))
    down = b"\x23" + WRITTEN.to_bytes(2, "little") + bytes((SUB,)) + VALUE
    with Canopen() as theirs:
        works: dict[str, tuple[Callable[[], None], int]] = {
            "receive alone, upload": (_alone(up), TRIPS),
            "receive alone, download": (_alone(down), TRIPS),
            "world, server, upload": (server.upload, TRIPS),
            "world, server, download": (server.download, TRIPS),
            "world, drive, upload": (drive.upload, TRIPS),
            "world, drive, download": (drive.download, TRIPS),
            "canopen, upload": (theirs.upload, SLOW_TRIPS),
            "canopen, download": (theirs.download, SLOW_TRIPS),
        }
        spent = interleaved({name: partial(_each, *work) for name, work in works.items()})
    rows = []
    for name, times in spent.items():
        base = spent["canopen, upload" if "upload" in name else "canopen, download"]
        faster = ratio(base, times)
        bar = against(faster, BAR) if name.startswith("world, server") else ""
        micros = sorted(times)[len(times) // 2] * 1e6
        rows.append((name, f"{micros:.2f}", f"{1e6 / micros:.0f}", f"{faster:.1f}", bar))
    show(
        "Expedited SDO round trips",
        ("", "us each", "a second", "faster than canopen by", "bar"),
        rows,
    )


if __name__ == "__main__":
    main()
