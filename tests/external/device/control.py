"""The bench of the independent keypad: its server of the control protocol."""

from __future__ import annotations

import json
import socket
import time
from pathlib import Path
from typing import Any

from tests.external.device.firmware import KEYS, OFF, Keypad

MAX_LINE = 65_536


class Bench:
    """The server of the control protocol: one session at a time."""

    def __init__(self, device: Keypad, address: str, same_clock: bool) -> None:
        self.device = device
        self.same_clock = same_clock
        self.peer: socket.socket | None = None
        self._text = b""
        kind, _, rest = address.partition(":")
        if kind == "unix":
            Path(rest).unlink(missing_ok=True)
            self.listener = socket.socket(socket.AF_UNIX)
            self.listener.bind(rest)
        elif kind == "tcp":
            host, _, port = rest.rpartition(":")
            family = socket.AF_INET6 if ":" in host else socket.AF_INET
            self.listener = socket.socket(family)
            self.listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            self.listener.bind((host.strip("[]"), int(port)))
        else:
            raise SystemExit(f"--control {address}: write tcp:HOST:PORT or unix:PATH")
        self.listener.listen()

    def accept(self) -> None:
        """A new client; the old one, if any, is gone."""
        self._leave()
        self.peer, _ = self.listener.accept()
        if self.peer.family != socket.AF_UNIX:
            self.peer.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def read(self) -> None:
        """Answer every complete line."""
        assert self.peer is not None
        try:
            chunk = self.peer.recv(MAX_LINE)
        except OSError:
            chunk = b""
        if not chunk:
            self._leave()
            return
        self._text += chunk
        while b"\n" in self._text and self.peer is not None:
            line, self._text = self._text.split(b"\n", 1)
            answer = self._answer(line)
            try:
                self.peer.sendall(json.dumps(answer).encode() + b"\n")
            except OSError:
                self._leave()
                return
            if answer.get("ok") and answer.pop("bye", False):
                self._leave()

    def _leave(self) -> None:
        if self.peer is not None:
            self.peer.close()
        self.peer = None
        self._text = b""

    def _answer(self, line: bytes) -> dict[str, Any]:
        number = None
        try:
            request = json.loads(line)
            number = request["id"]
            return {"id": number, "ok": True} | self._do(request)
        except (ValueError, KeyError, TypeError, AttributeError) as error:
            return {"id": number, "ok": False, "error": f"{type(error).__name__}: {error}"}

    def _do(self, request: dict[str, Any]) -> dict[str, Any]:
        device = self.device
        match request["do"]:
            case "hello":
                can = ["power", "keys", "leds", "bus"]
                said = {"protocol": 1, "device": "independent keypad", "can": can}
                return said | ({"clock": "same"} if self.same_clock else {})
            case "state":
                rate = {} if device.wire_rate is None else {"bus": device.wire_rate}
                down = [key for key in KEYS if key in device.held]
                return {"power": device.state != OFF, "held": down} | rate
            case "power":
                on = _flag(request["on"])
                return self._timed(lambda now: device.power(on, now))
            case "keys":
                held = frozenset(request["held"])
                if held - set(KEYS):
                    raise ValueError(f"no key {', '.join(sorted(held - set(KEYS)))}")
                return self._timed(lambda now: device.hold(held, now))
            case "leds":
                if "for" in request:
                    raise ValueError("LED edges are not watched here")
                return {"leds": device.leds()}
            case "bus":
                device.wire_rate = int(request["bitrate"])
                return {}
            case "bye":
                return {"bye": True}
            case other:
                raise ValueError(f"cannot do {other!r}")

    def _timed(self, action: Any) -> dict[str, Any]:
        began = time.time()
        now = time.monotonic_ns()
        self.device.run(now)
        action(now)
        ended = time.time()
        return {"at": [began, ended]} if self.same_clock else {}


def _flag(value: object) -> bool:
    if not isinstance(value, bool):
        raise TypeError(f"true or false, not {value!r}")
    return value
