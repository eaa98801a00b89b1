"""One session of the bench control protocol, version 1, as its client.

The peer is a stranger: whatever it sends, however it stalls or hangs up, becomes a
`ControlError` that names the address, the request, what came, and what to do. A broken
session stays broken and tells its first cause to all that come after.

Requests may overlap; the protocol answers them in order, so the next answer must carry
the id of the oldest request that has none.
"""

from __future__ import annotations

import contextlib
import json
import select
import socket
import time
from collections import deque
from collections.abc import Callable, Mapping
from decimal import Decimal
from typing import NoReturn

from hil_tests.bench.drivers.neighbour import processes_behind
from hil_tests.clock import S
from hil_tests.errors import ControlError

PROTOCOL = 1
LINE_LIMIT = 64 * 1024
"""Bytes a line may have, line feed not counted."""
TIMEOUT_NS = 5 * S
"""How long an answer may take, beside the time that the request itself takes."""
_BYE_NS = 1 * S
_CHUNK = 65_536
_LONGEST_TEXT = 120

Answer = Mapping[str, object]


class ControlSession:
    """A connection to a control server, shared by all facilities with its address.

    Args:
        address: "tcp:HOST:PORT" or "unix:PATH".
        timeout_ns: how long an answer may take.
        clock: CLOCK_REALTIME in ns; the clock of the bench's port.
    """

    def __init__(
        self,
        address: str,
        timeout_ns: int = TIMEOUT_NS,
        clock: Callable[[], int] = time.time_ns,
    ) -> None:
        self.address = address
        self.timeout_ns = timeout_ns
        self.clock = clock
        self.device = ""
        self.can: frozenset[str] = frozenset()
        self.same_clock = False
        self._socket: socket.socket | None = None
        self._unread = bytearray()
        self._unsent = bytearray()
        self._waiting: deque[tuple[int, str]] = deque()
        self._answers: dict[int, Answer] = {}
        self._last_id = 0
        self._ended = False
        self._broken: ControlError | None = None

    # Once a run.

    def connect(self) -> None:
        """Connect and say hello; the only verbs that wait are this one and `close`.

        Raises:
            ControlError: nobody there, another protocol, or a hello that makes no sense.
        """
        try:
            self._socket = _connect(self.address, self.timeout_ns)
        except (OSError, ValueError) as error:
            self._fail(
                f"cannot connect ({error}); start the control server, or correct [control] "
                "address in the bench file"
            )
        self._check_hello(self.ask({"do": "hello", "protocol": PROTOCOL}))

    def ask(self, request: Mapping[str, object]) -> Answer:
        """Send a request and wait for its answer; not to be used while the bus is watched."""
        ident = self.send(request)
        limit = time.monotonic_ns() + self.timeout_ns
        while (answer := self.take(ident)) is None:
            left = limit - time.monotonic_ns()
            if left <= 0:
                self.stalled(ident)
            fd = [self.fileno()]
            select.select(fd, fd if self._unsent else [], [], left / S)
        return answer

    def require(self, *names: str) -> None:
        """The server must be able to do these things, as the bench file says it can.

        Raises:
            ControlError: its hello lacks one.
        """
        lacking = [name for name in names if name not in self.can]
        if lacking:
            raise ControlError(
                f"control server {self.address}: its hello lacks {', '.join(lacking)} (it can "
                f"{', '.join(sorted(self.can)) or 'nothing'}); remove that section from the "
                "bench file or give it another driver"
            )

    def close(self) -> None:
        """Say bye, and hang up whatever comes; calling it twice is allowed."""
        if self._socket is None:
            return
        if self._broken is None:
            self.timeout_ns = min(self.timeout_ns, _BYE_NS)
            with contextlib.suppress(ControlError):
                self.ask({"do": "bye"})
        self._socket.close()
        self._socket = None
        if self._broken is None:
            self._broken = ControlError(f"control session to {self.address} was closed")

    # While the bus is watched: nothing here waits.

    def fileno(self) -> int:
        """What select can wait on."""
        self._check()
        assert self._socket is not None
        return self._socket.fileno()

    def processes(self) -> list[int]:
        """The processes that answer, where they run on this machine."""
        self._check()
        assert self._socket is not None
        return processes_behind(self._socket)

    @property
    def unsent(self) -> bool:
        """Part of a request still waits for the peer to read."""
        return bool(self._unsent)

    def send(self, request: Mapping[str, object]) -> int:
        """Send a request; returns its id.

        Raises:
            ControlError: the session is broken, or the request is too long for a line.
        """
        self._check()
        self._last_id += 1
        line = json.dumps({"id": self._last_id, **request})
        if len(line) > LINE_LIMIT:
            raise ControlError(
                f"control server {self.address}: request {_short(request)} needs "
                f"{len(line)} bytes, a line has {LINE_LIMIT} at most; send shorter sequences"
            )
        self._waiting.append((self._last_id, _short(request)))
        self._unsent += line.encode() + b"\n"
        self._write()
        return self._last_id

    def take(self, ident: int) -> Answer | None:
        """The answer to that request, if it is there.

        Raises:
            ControlError: the peer hung up, broke the protocol, or refused.
        """
        if ident not in self._answers:
            self._check()
            self._write()
            self._read()
        answer = self._answers.pop(ident, None)
        if answer is None and self._ended:
            rest = f" after {_short(bytes(self._unread))}" if self._unread else ""
            self._fail(f"it hung up on {self._oldest()}{rest}; look at its log")
        return answer

    def stalled(self, ident: int) -> NoReturn:
        """The time for that answer is over.

        Raises:
            ControlError: always.
        """
        what = next((text for waiting, text in self._waiting if waiting == ident), "?")
        seconds = self.timeout_ns / S
        self._fail(
            f"no answer to {what} within {seconds:g} s beside the time it takes; is the "
            "server alive, and is no other client connected to it?"
        )

    def broke(self, what: str, answer: Answer) -> ControlError:
        """The error for an answer that makes no sense; the session ends with it."""
        try:
            self._fail(f"{what} in the answer {_short(answer)}; correct the server")
        except ControlError as error:
            return error

    def _check(self) -> None:
        if self._broken is not None:
            raise ControlError(str(self._broken))
        if self._socket is None:
            raise ControlError(f"control session to {self.address} is not connected")

    def _fail(self, why: str) -> NoReturn:
        self._broken = ControlError(f"control server {self.address}: {why}")
        raise self._broken

    def _write(self) -> None:
        assert self._socket is not None
        while self._unsent:
            try:
                sent = self._socket.send(self._unsent)
            except BlockingIOError:
                return
            except OSError as error:
                self._fail(f"it hung up on {self._oldest()} ({error}); look at its log")
            del self._unsent[:sent]

    def _read(self) -> None:
        """Take in what has come, and sort the answers."""
        assert self._socket is not None
        while True:
            try:
                data = self._socket.recv(_CHUNK)
            except BlockingIOError:
                break
            except OSError as error:
                self._fail(f"it hung up on {self._oldest()} ({error}); look at its log")
            if not data:
                # What it said before it hung up still counts.
                self._ended = True
                break
            self._unread += data
            self._lines()

    def _lines(self) -> None:
        while (end := self._unread.find(b"\n")) >= 0:
            line = bytes(self._unread[:end])
            del self._unread[: end + 1]
            self._sort(line)
        if len(self._unread) > LINE_LIMIT:
            self._too_long()

    def _sort(self, line: bytes) -> None:
        """Keep an answer under the id of its request."""
        if len(line) > LINE_LIMIT:
            self._too_long()
        try:
            answer = json.loads(line.decode(), parse_float=Decimal, parse_constant=_refuse)
        except (ValueError, RecursionError):
            self._fail(f"answered {self._oldest()} with no JSON: {_short(line)}; correct it")
        if not isinstance(answer, dict):
            self._fail(f"answered {self._oldest()} with no JSON object: {_short(line)}")
        if not self._waiting:
            self._fail(f"sent {_short(line)} though nothing was asked; correct it")
        ident, what = self._waiting[0]
        got = answer.get("id")
        if got != ident or isinstance(got, bool | Decimal):
            self._fail(
                f"answered {what}, id {ident}, with id {_short(got)}: {_short(line)}; "
                "answers come in order and repeat the request's id"
            )
        self._waiting.popleft()
        if answer.get("ok") is False:
            # A refusal leaves the session whole: only this request failed.
            why = _short(answer.get("error"))
            self._answers[ident] = {"refused": f"refused {what}: {why}"}
        elif answer.get("ok") is True:
            self._answers[ident] = answer
        else:
            self._fail(f"answered {what} without ok true or false: {_short(line)}")

    def _too_long(self) -> NoReturn:
        self._fail(f"answered {self._oldest()} with a line of more than {LINE_LIMIT} bytes")

    def _oldest(self) -> str:
        return self._waiting[0][1] if self._waiting else "nothing"

    def _check_hello(self, answer: Answer) -> None:
        if "refused" in answer:
            self._fail(f"{answer['refused']}; this suite speaks version {PROTOCOL}")
        protocol, device, can = (answer.get(name) for name in ("protocol", "device", "can"))
        if protocol != PROTOCOL or isinstance(protocol, bool | Decimal):
            raise self.broke(f"protocol {_short(protocol)} instead of {PROTOCOL}", answer)
        if not isinstance(device, str):
            raise self.broke("no device name", answer)
        if not isinstance(can, list) or not all(isinstance(name, str) for name in can):
            raise self.broke("no list 'can' of names", answer)
        clock = answer.get("clock")
        if clock is not None and not isinstance(clock, str):
            raise self.broke(f"clock {_short(clock)}", answer)
        self.device, self.can, self.same_clock = device, frozenset(can), clock == "same"


def _connect(address: str, timeout_ns: int) -> socket.socket:
    kind, _, rest = address.partition(":")
    host, _, port = rest.rpartition(":")
    if kind == "unix" and rest:
        peer = socket.socket(socket.AF_UNIX)
        peer.settimeout(timeout_ns / S)
        try:
            peer.connect(rest)
        except OSError:
            peer.close()
            raise
    elif kind == "tcp" and host and port.isdecimal():
        peer = socket.create_connection((host.strip("[]"), int(port)), timeout_ns / S)
        peer.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    else:
        raise ValueError("an address is tcp:HOST:PORT or unix:PATH")
    peer.setblocking(False)
    return peer


def _refuse(name: str) -> object:
    raise ValueError(f"{name} is no JSON number")


def _short(value: object) -> str:
    text = repr(value)
    return text if len(text) <= _LONGEST_TEXT else f"{text[:_LONGEST_TEXT]}..."
