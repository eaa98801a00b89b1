"""The server's end of the bench control protocol: sessions, lines, answers in order.

One session at a time; a second client waits in the queue of the listening socket until
the first is gone. Nothing here waits: the loop of the host calls `turn` when a descriptor
is ready. Whatever a client sends, the session goes on (protocol, last table but one);
only a client that does not read its answers is dropped.
"""

from __future__ import annotations

import contextlib
import socket
import stat
from collections.abc import Callable, Mapping
from decimal import Decimal
from pathlib import Path

from node_model.host.jsonline import LINE_LIMIT, dump, parse
from node_model.host.loop import Job
from node_model.host.verbs import Refusal

Handler = Callable[[Mapping[str, object]], dict[str, object] | Job]

_CHUNK = 65_536
_MOST_UNREAD = 4 * (LINE_LIMIT + 1)
"""Bytes of requests kept while one is being done."""
_MOST_UNSENT = 1 << 20
"""Bytes of answers that a client may leave unread before it is dropped."""
_BACKLOG = 8


def listen(address: str) -> tuple[socket.socket, str]:
    """A listening socket, and its real address (port 0 picks a free one).

    Args:
        address: "tcp:HOST:PORT" or "unix:PATH".

    Raises:
        ValueError: no such address form.
        OSError: it cannot be bound.
    """
    kind, _, rest = address.partition(":")
    if kind == "unix" and rest:
        _remove_stale(Path(rest))
        server = socket.socket(socket.AF_UNIX)
        try:
            server.bind(rest)
        except OSError:
            server.close()
            raise
        server.listen(_BACKLOG)
        return server, address
    host, _, port = rest.rpartition(":")
    if kind != "tcp" or not host or not port.isdecimal() or int(port) > 65_535:
        raise ValueError(f"{address!r} is no control address: tcp:HOST:PORT or unix:PATH")
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    server = socket.create_server((host.strip("[]"), int(port)), family=family, backlog=_BACKLOG)
    return server, f"tcp:{host}:{server.getsockname()[1]}"


def _remove_stale(path: Path) -> None:
    """A socket file that nobody listens on any more is in the way of a new one."""
    if not path.exists() or not stat.S_ISSOCK(path.stat().st_mode):
        return
    with socket.socket(socket.AF_UNIX) as probe:
        probe.setblocking(False)
        try:
            probe.connect(str(path))
        except ConnectionRefusedError:
            path.unlink()
        except OSError:
            return  # somebody is there: bind will say so


class Server:
    """Serves one client after the other.

    Args:
        address: where to listen; see `listen`.
        handler: does a request; its answer, or the job that will have one.
        release: called when a job is over, or its client left.
    """

    def __init__(self, address: str, handler: Handler, release: Callable[[], None]) -> None:
        self._listener, self.address = listen(address)
        self._listener.setblocking(False)
        self._handler = handler
        self._release = release
        self._session: Session | None = None

    def descriptors(self) -> tuple[list[int], list[int]]:
        """What to wait for: readable ones, writable ones."""
        session = self._session
        if session is None:
            return [self._listener.fileno()], []
        return session.descriptors()

    def turn(self) -> None:
        """Accept, read, do and answer as far as possible without waiting."""
        if self._session is None:
            try:
                peer, _ = self._listener.accept()
            except OSError:
                return  # it was gone before we came
            self._session = Session(peer, self._handler, self._release)
        if not self._session.turn():
            self._end()

    def _end(self) -> None:
        if self._session is not None:
            self._session.close()
            self._session = None

    def close(self) -> None:
        """End the session and stop listening."""
        self._end()
        self._listener.close()
        if self.address.startswith("unix:"):
            Path(self.address.removeprefix("unix:")).unlink(missing_ok=True)


class Session:
    """One client: bytes in, lines done in order, bytes out."""

    def __init__(self, peer: socket.socket, handler: Handler, release: Callable[[], None]) -> None:
        peer.setblocking(False)
        with contextlib.suppress(OSError):  # no TCP
            peer.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._peer = peer
        self._handler = handler
        self._release = release
        self._unread = bytearray()
        self._unsent = bytearray()
        self._skipping = False
        self._said_bye = False
        self._lost = False
        self._job: Job | None = None
        self._job_id: object = None

    def descriptors(self) -> tuple[list[int], list[int]]:
        """What to wait for: readable while there is room, writable while there is need."""
        fd = self._peer.fileno()
        return (
            [fd] if len(self._unread) < _MOST_UNREAD else [],
            [fd] if self._unsent else [],
        )

    def turn(self) -> bool:
        """Go on; False when the session is over."""
        self._read()
        self._write()
        self._work()
        if len(self._unsent) > _MOST_UNSENT:
            return False
        return not (self._lost or (self._said_bye and not self._unsent))

    def _read(self) -> None:
        """Take in what has come."""
        while len(self._unread) < _MOST_UNREAD:
            try:
                data = self._peer.recv(_CHUNK)
            except BlockingIOError:
                return
            except OSError:
                data = b""
            if not data:
                self._lost = True
                return
            self._unread += data

    def _work(self) -> None:
        """Do the requests that are complete, one after the other."""
        if self._job is not None:
            if self._job.due() is not None:
                return
            self._answer(self._job_id, self._job.answer())
            self._job = None
            self._release()
            self._write()
        while self._free():
            line = self._line()
            if line is None:
                return
            self._request(line)
            self._write()

    def _free(self) -> bool:
        """The next request may be done: nothing is running, nothing waits to be read."""
        return self._job is None and not self._said_bye and not self._unsent

    def _line(self) -> bytes | None:
        """The next complete line, without those that are too long."""
        while True:
            end = self._unread.find(b"\n")
            if end < 0:
                if len(self._unread) > LINE_LIMIT:
                    self._unread.clear()
                    self._too_long()
                return None
            line = bytes(self._unread[:end])
            del self._unread[: end + 1]
            if self._skipping:
                self._skipping = False
            elif end > LINE_LIMIT:
                self._too_long()
                self._skipping = False
            else:
                return line

    def _too_long(self) -> None:
        """Refuse the line once; the rest of it is passed over."""
        if not self._skipping:
            self._refuse(None, f"the line has more than {LINE_LIMIT} bytes")
        self._skipping = True

    def _request(self, line: bytes) -> None:
        try:
            request = parse(line)
        except ValueError as error:
            self._refuse(None, str(error))
            return
        ident = request.get("id")
        if not isinstance(ident, str | int | Decimal):
            ident = None
        try:
            done = self._handler(request)
        except Refusal as error:
            self._refuse(ident, str(error))
            return
        if isinstance(done, dict):
            self._answer(ident, done)
        elif done.due() is None:
            self._answer(ident, done.answer())
            self._release()
        else:
            self._job, self._job_id = done, ident
        self._said_bye = request.get("do") == "bye"

    def _answer(self, ident: object, answer: dict[str, object]) -> None:
        line = dump({"id": ident, "ok": True, **answer})
        if len(line) > LINE_LIMIT:
            self._refuse(ident, f"the answer needs more than {LINE_LIMIT} bytes; ask for less")
            return
        self._unsent += line.encode() + b"\n"

    def _refuse(self, ident: object, why: str) -> None:
        self._unsent += dump({"id": ident, "ok": False, "error": why}).encode() + b"\n"

    def _write(self) -> None:
        while self._unsent:
            try:
                sent = self._peer.send(self._unsent)
            except BlockingIOError:
                return
            except OSError:
                self._lost = True
                self._unsent.clear()
                return
            del self._unsent[:sent]

    def close(self) -> None:
        """Hang up."""
        if self._job is not None:
            self._release()
        self._peer.close()
