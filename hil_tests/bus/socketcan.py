"""A port over Linux SocketCAN: a raw socket, read with `recvmsg`.

The clock is CLOCK_REALTIME in ns, the one with which the kernel stamps frames. Where an
adapter stamps in hardware, its stamps are followed onto that clock. If somebody sets the
clock while a test runs, a GAP event says by how much: intervals across it mean nothing.

Laws beyond those of a port: own frames are told by MSG_CONFIRM, which the kernel sets on
them alone; frames that the kernel dropped are counted by SO_RXQ_OVFL and told as a GAP
before the next frame; when the interface goes down, what was received before comes out
first, then one DOWN event, then every verb raises `BusUnavailable`.
"""

from __future__ import annotations

import contextlib
import errno
import select
import socket
import sys
import time
from array import array
from collections import deque
from collections.abc import Callable, Iterable, Sequence
from typing import cast

from hil_tests.bus import link, rawcan
from hil_tests.bus.datagrams import Note
from hil_tests.bus.errorframes import error_event
from hil_tests.bus.lock import ChannelLock
from hil_tests.bus.manyframes import ManyFrames, Packed
from hil_tests.bus.stamps import Follower, StepWatch, patience_ns
from hil_tests.clock import MS, US, S, show_span
from hil_tests.errors import BusUnavailable
from hil_tests.trace import BusEvent, Columns, EventKind, Sighting
from node_model.frame import Frame

SIMULATED_DOUBT_NS = 20 * US
"""vcan stamps a frame inside the sender's own system call."""
SOFTWARE_DOUBT_NS = 1 * MS
"""Interrupt or USB latency of an adapter without stamps of its own (up to 0.9 ms seen)."""
HARDWARE_DOUBT_NS = 100 * US
"""Of an adapter's own stamp once it is followed onto our clock."""

SEND_LIMIT_NS = 1 * S
_SEND_RETRY_S = 0.0005
_STEP_CHECK_NS = 100 * MS
_MOST_CACHED = 4096
_MANY = 16
"""After so many frames that were there already they are read by the hundred."""
_MOST_CALLS = 64
"""Of a hundred or two each, before what was read is looked at."""
_GAP_TEXT = "the kernel dropped frames because they were not read in time"


class SocketCanPort:
    """The tester's end of a SocketCAN interface (see `hil_tests.bus.port.Port`).

    Args:
        channel: name of the interface, e.g. "can0".
        bit_rate: rate in bit/s to run a real interface at; None = as it is.
        make_socket: makes the raw socket; for tests.
        many: reads frames by the hundred; for tests.

    Raises:
        BusUnavailable: no such interface, it is down, in use, or no AF_CAN here.
        BenchError: the bit rate cannot be set.
    """

    send_limit_ns = SEND_LIMIT_NS
    """How long `send` waits where the queue is full."""

    def __init__(
        self,
        channel: str,
        bit_rate: int | None = None,
        make_socket: Callable[[], socket.socket] = rawcan.raw_socket,
        many: ManyFrames | None = None,
    ) -> None:
        self.name = f"{channel} (socketcan)"
        self._channel = channel
        self._gone = ""
        self._ready: deque[Sighting | BusEvent | Columns] = deque()
        self._in_a_row = 0
        """Frames that waited already when they were asked for, one after the other."""
        self._cache: dict[bytes, Frame] = {}
        self._dropped = 0
        self._follower = Follower()
        self._steps = StepWatch()
        self._checked_at = 0
        self._rate: link.BitRate | None = None
        self._lock = ChannelLock("socketcan", channel)
        try:
            self._socket = make_socket()
        except BaseException:
            self._lock.release()
            raise
        self._fd = self._socket.fileno()
        try:
            self._many = many or ManyFrames()
            self._set_up(bit_rate)
        except BaseException:
            self.close()
            raise

    def _set_up(self, bit_rate: int | None) -> None:
        channel, sock = self._channel, self._socket
        try:
            socket.if_nametoindex(channel)
        except OSError:
            raise BusUnavailable(link.missing_text(channel)) from None
        simulated = link.is_simulated(channel)
        self.timed = not simulated
        if not simulated:
            self._rate = link.BitRate(channel)
            if bit_rate is not None:
                self._rate.ensure(bit_rate)
        self.doubt_ns = SIMULATED_DOUBT_NS if simulated else SOFTWARE_DOUBT_NS
        self.clock = f"kernel stamps, CLOCK_REALTIME, doubt {show_span(self.doubt_ns)}"
        if not link.is_up(sock, channel):
            raise BusUnavailable(link.down_text(channel, simulated))
        rawcan.set_options(sock, simulated)
        try:
            sock.bind((channel,))
        except OSError as error:
            raise BusUnavailable(
                f"interface {channel!r} cannot be opened for CAN ({error.strerror}); "
                f"CAN interfaces here: {', '.join(link.can_interfaces()) or 'none'}"
            ) from None
        sock.setblocking(False)

    def now(self) -> int:
        """CLOCK_REALTIME in ns."""
        return time.time_ns()

    def send(self, frame: Frame) -> None:
        """Queue a frame; waits at most `send_limit_ns` where the queue is full."""
        self._check_open()
        raw = rawcan.pack(frame)
        limit = 0
        while True:
            try:
                self._socket.send(raw)
                return
            except OSError as error:
                if error.errno not in (errno.EAGAIN, errno.ENOBUFS):
                    raise BusUnavailable(self._why(error)) from None
            # A full queue of the interface (ENOBUFS) does not show in select; retry.
            select.select([], [], [], _SEND_RETRY_S)
            now = time.monotonic_ns()
            limit = limit or now + self.send_limit_ns
            if now >= limit:
                raise BusUnavailable(
                    f"{self.name} took no frame for {show_span(self.send_limit_ns)}: nothing "
                    "acknowledges on the bus, or it is bus-off; check wiring, termination "
                    f"and bit rate (ip -details -statistics link show {self._channel})"
                )

    def next(self, until: int, also: Sequence[int] = ()) -> Sighting | BusEvent | None:
        """The next frame or event, at the latest at `until` (see the port's contract)."""
        while True:
            if self._ready:
                return self._hand_out()
            if self._gone:
                self._check_open()
            if self._receive():
                self._in_a_row += 1
                if self._in_a_row >= _MANY:
                    self._read_many()
                continue
            self._in_a_row = 0
            now = time.time_ns()
            if now - self._checked_at > _STEP_CHECK_NS or now < self._checked_at:
                self._checked_at = now
                self._check_clock(now)
                if self._ready:
                    continue
            # select, not poll or epoll: those wait in whole milliseconds.
            wait_ns = patience_ns(until - now)
            ready = select.select([self._fd, *also], [], [], wait_ns / S)[0]
            if self._fd not in ready and (ready or now + wait_ns >= until):
                return None

    def _hand_out(self) -> Sighting | BusEvent:
        """The first of what was read."""
        first = self._ready.popleft()
        if not isinstance(first, Columns):
            return first
        self._ready.extendleft(reversed(list(first.sightings())))
        return self._hand_out()

    def gather(self) -> Columns | None:
        """See `hil_tests.bus.port.GatheringPort`."""
        if self._ready and isinstance(self._ready[0], Columns):
            return cast("Columns", self._ready.popleft())
        return None

    def set_bit_rate(self, bit_rate: int) -> None:
        """Run the controller at `bit_rate` bit/s; a simulated wire has no bit rate."""
        self._check_open()
        if self._rate is None:
            return
        self._rate.ensure(bit_rate)
        # Our own taking down left ENETDOWN on the socket; reading it clears it.
        self._socket.getsockopt(socket.SOL_SOCKET, socket.SO_ERROR)

    def close(self) -> None:
        """Leave the bus, and put the bit rate back that was found."""
        if not self._gone:
            self._gone = f"{self.name} was closed"
        self._socket.close()
        try:
            if self._rate is not None:
                self._rate.restore()
        finally:
            self._rate = None
            self._lock.release()

    def _receive(self) -> bool:
        """Read one datagram, without waiting; whether there was one. The hot path."""
        try:
            raw, notes, flags, _ = self._socket.recvmsg(rawcan.CANFD_MTU, rawcan.ROOM)
        except BlockingIOError:
            return False
        except OSError as error:
            self._went_down(error)
            return True
        self._accept(raw, notes, flags)
        return True

    def _accept(self, raw: bytes, notes: Iterable[Note], flags: int) -> None:
        """A datagram, as `socket.recvmsg` gives it."""
        at, doubt_ns, lost = 0, self.doubt_ns, 0
        for _, kind, body in notes:
            if kind == rawcan.SO_TIMESTAMPNS:
                seconds, ns = rawcan.TIMESPEC.unpack(body)
                at = seconds * S + ns
            elif kind == rawcan.SO_TIMESTAMPING:
                at, doubt_ns = self._stamp(body)
            elif kind == rawcan.SO_RXQ_OVFL:
                lost = self._newly_lost(int.from_bytes(body, sys.byteorder))
        if not at:
            at = time.time_ns()
        if lost:
            self._ready.append(BusEvent(EventKind.GAP, at, _GAP_TEXT, lost))
        frame = self._cache.get(raw)
        own = bool(flags & rawcan.MSG_CONFIRM)
        self._ready.append(
            self._decode(raw, at, doubt_ns, own)
            if frame is None
            else Sighting(frame, at, doubt_ns, own)
        )

    def _read_many(self) -> None:
        """Take from the kernel all that waits: frames come faster than they are looked at."""
        for _ in range(_MOST_CALLS):
            try:
                if not self._many.receive(self._fd):
                    return
            except OSError as error:
                self._went_down(error)
                return
            packed = self._many.packed()
            if packed is None:
                for datagram in self._many.datagrams():
                    self._accept(*datagram)
            else:
                self._accept_many(packed)

    def _accept_many(self, packed: Packed) -> None:
        """Frames up to where the kernel dropped some, and on from there."""
        instants, doubts = self._stamp_all(packed)
        drops = packed.drops
        start = 0
        for place, total in enumerate(drops):
            if total != self._dropped:
                self._keep(packed, instants, doubts, slice(start, place))
                lost = self._newly_lost(total)
                self._ready.append(BusEvent(EventKind.GAP, instants[place], _GAP_TEXT, lost))
                start = place
        self._keep(packed, instants, doubts, slice(start, None))

    def _keep(self, packed: Packed, instants: array[int], doubts: array[int], part: slice) -> None:
        """Some of them wait to be handed out."""
        columns = Columns(packed.heads[part], packed.bodies[part], instants[part], doubts[part])
        if columns.heads:
            self._ready.append(columns)

    def _stamp_all(self, packed: Packed) -> tuple[array[int], array[int]]:
        """Instants and doubts; see `_stamp`."""
        soft, hard = packed.soft, packed.hard
        if not any(hard):
            return array("q", soft), array("I", [self.doubt_ns]) * len(soft)
        pairs = [self._agreed(*both) for both in zip(soft, hard, strict=True)]
        return array("q", [at for at, _ in pairs]), array("I", [doubt for _, doubt in pairs])

    def _decode(self, raw: bytes, at: int, doubt_ns: int, own: bool) -> Sighting | BusEvent:
        """A frame seen for the first time, an error frame or a CAN FD frame."""
        if len(raw) != rawcan.CAN_MTU:
            word = int.from_bytes(raw[:4], sys.byteorder) & rawcan.ERR_MASK
            text = f"identifier {word:03X}h, {raw[4]} bytes"
            return BusEvent(EventKind.FD_FRAME, at, text)
        word = rawcan.CAN_FRAME.unpack(raw)[0]
        if word & rawcan.ERR_FLAG:
            return error_event(word & rawcan.ERR_MASK, raw[8:], at)
        frame = rawcan.unpack(raw)
        if len(self._cache) >= _MOST_CACHED:
            self._cache.clear()
        self._cache[raw] = frame
        return Sighting(frame, at, doubt_ns, own)

    def _stamp(self, body: bytes) -> tuple[int, int]:
        """Instant and doubt out of a SCM_TIMESTAMPING note: software, (unused), hardware."""
        seconds, ns, _, _, hard_seconds, hard_ns = rawcan.TIMESPECS.unpack(body)
        return self._agreed(seconds * S + ns, hard_seconds * S + hard_ns)

    def _agreed(self, soft: int, hard: int) -> tuple[int, int]:
        """Instant and doubt by the stamps of kernel and adapter (0 = none), ns."""
        if not hard:
            return soft, self.doubt_ns
        return self._follower.ours(hard, soft or time.time_ns()), HARDWARE_DOUBT_NS

    def _newly_lost(self, total: int) -> int:
        """How far the kernel's running total of drops (32 bits) rose."""
        lost = total - self._dropped & 0xFFFF_FFFF
        self._dropped = total
        return lost

    def _check_clock(self, now: int) -> None:
        step = self._steps.step()
        if step:
            text = f"the host's clock was set by {show_span(step)}; do not do that in a run"
            self._ready.append(BusEvent(EventKind.GAP, now, text))

    def _went_down(self, error: OSError) -> None:
        """The kernel reports the error before what it still holds: that comes out first.

        Raises:
            BusUnavailable: it had gone away before.
        """
        self._check_open()
        self._gone = self._why(error)
        with contextlib.suppress(BusUnavailable):
            while self._receive():
                pass
        self._ready.append(BusEvent(EventKind.DOWN, time.time_ns(), self._gone))

    def _check_open(self) -> None:
        if self._gone:
            raise BusUnavailable(self._gone)

    def _why(self, error: OSError) -> str:
        if error.errno in (errno.ENODEV, errno.ENXIO):
            return f"the interface went away; {link.missing_text(self._channel)}"
        if error.errno == errno.ENETDOWN:
            return link.down_text(self._channel, not self.timed)
        return f"{self.name}: {error.strerror} (errno {error.errno})"
