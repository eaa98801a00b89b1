"""Control servers for tests: scripted ones that may lie, stall or hang up."""

from __future__ import annotations

import contextlib
import json
import select
import socket
import threading
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

from hil_tests.bench.action import Action

Reply = bytes | None | Callable[[dict[str, Any]], bytes | None]
"""What to send for a request; None = hang up; b"" = say nothing."""

HELLO: dict[str, Any] = {
    "protocol": 1,
    "device": "scripted",
    "can": ["power", "keys", "key-sequences", "leds", "led-edges", "faults", "bus", "health"],
    "clock": "same",
}


def answer(**fields: Any) -> Callable[[dict[str, Any]], bytes]:
    """An answer that repeats the id of its request."""

    def reply(request: dict[str, Any]) -> bytes:
        return json.dumps({"id": request["id"], "ok": True, **fields}).encode() + b"\n"

    return reply


@contextlib.contextmanager
def scripted(folder: Path, replies: Sequence[Reply], **hello: Any) -> Iterator[str]:
    """A server that says hello, plays the replies, then is silent; gives its address.

    `hello` replaces fields of the usual one; a field that is None is left out.
    """
    path = folder / "peer"
    fields = {name: value for name, value in {**HELLO, **hello}.items() if value is not None}
    with socket.socket(socket.AF_UNIX) as listener:
        listener.bind(str(path))
        listener.listen()
        script: list[Reply] = [answer(**fields), *replies]
        thread = threading.Thread(target=_serve, args=(listener, script))
        thread.start()
        try:
            yield f"unix:{path}"
        finally:
            # Wakes a server to which nobody came.
            with contextlib.suppress(OSError), socket.socket(socket.AF_UNIX) as waker:
                waker.connect(str(path))
            thread.join()
            path.unlink()


def _serve(listener: socket.socket, script: list[Reply]) -> None:
    peer, _ = listener.accept()
    with peer, peer.makefile("rb") as lines, contextlib.suppress(OSError):
        for line in lines:
            reply = script.pop(0) if script else b""
            if callable(reply):
                reply = reply(json.loads(line))
            if reply is None:
                return
            peer.sendall(reply)


def finish(action: Action[Any], clock: Callable[[], int]) -> Any:
    """Start an action and wait for it, as a bench does between frames."""
    action.start(clock())
    while not action.poll(clock()):
        left_ns = max(action.wake_at - clock(), 0)
        select.select(action.descriptors, [], [], left_ns / 1_000_000_000)
    return action.result()
