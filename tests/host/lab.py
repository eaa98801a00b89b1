"""A control server on a fake node with a clock of ours, and a client at it."""

from __future__ import annotations

import contextlib
import json
import socket
from decimal import Decimal
from pathlib import Path
from typing import Any

from node_model.host.control import Server
from node_model.host.loop import Loop
from node_model.host.verbs import Verbs
from tests.host.fakes import Clock, FakePanel, FakeWire


class Lab:
    """A server on a node with a clock of ours, and a client at it."""

    def __init__(self, folder: Path) -> None:
        self.clock = Clock()
        self.wire = FakeWire(self.clock)
        self.node = FakePanel()
        self.loop = Loop(self.node, self.wire, self.clock)
        verbs = Verbs(self.loop)
        self.server = Server(f"unix:{folder}/control", verbs, verbs.release)
        self.client = self.join()

    def join(self) -> socket.socket:
        """One more client."""
        client = socket.socket(socket.AF_UNIX)
        client.connect(self.server.address.removeprefix("unix:"))
        client.setblocking(False)
        return client

    def send(self, data: bytes) -> None:
        """The client's bytes, and the server's turns until it has them all."""
        view = memoryview(data)
        while view:
            with contextlib.suppress(BlockingIOError):
                view = view[self.client.send(view) :]
            self.turn()

    def turn(self, after_ns: int = 0) -> None:
        """Time goes on, and the host comes round."""
        self.clock.now += after_ns
        self.loop.catch_up()
        self.server.turn()
        self.server.turn()

    def answers(self) -> list[Any]:
        """What has come back."""
        data = b""
        with contextlib.suppress(BlockingIOError):
            while chunk := self.client.recv(1 << 20):
                data += chunk
        return [json.loads(line, parse_float=Decimal) for line in data.splitlines()]

    def ask(self, **request: Any) -> Any:
        """A request with its only answer."""
        self.send(json.dumps({"id": 1, **request}).encode() + b"\n")
        (answer,) = self.answers()
        return answer
