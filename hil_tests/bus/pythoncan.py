"""A port over any other interface of python-can.

The clock is CLOCK_REALTIME in ns. Where python-can's stamps come from it already
(udp_multicast: the kernel; virtual: the sender) they are taken as they are, else they are
followed onto it (see `stamps`), because adapters count from their own start.

How own frames are recognised, once they were on the bus:

- udp_multicast echoes every frame to its sender, unmarked. The message field `channel`
  travels with the frame, so a tag in it marks ours, whoever else sends equal frames.
- virtual and the adapters of `_ECHOING` hand sent frames back with `is_rx` False.
- Others never show them. Such a frame is reported when it was handed over, with a doubt.

The only module of the suite that imports `can`, and it does so when a port is opened.
"""

from __future__ import annotations

import os
import secrets
import select
import time
from collections import deque
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from hil_tests.bus.lock import ChannelLock
from hil_tests.bus.multicast import Group, hear_own_group_only
from hil_tests.bus.stamps import Follower, StepWatch, patience_ns
from hil_tests.clock import MS, US, S, show_span
from hil_tests.errors import BusUnavailable, FrameNotCarried
from hil_tests.trace import BusEvent, EventKind, Sighting
from node_model.frame import Frame

if TYPE_CHECKING:
    import can

SIMULATED = frozenset({"virtual", "udp_multicast"})
"""Interfaces without a wire: no arbitration, no bit times, no bit rate."""

_ECHOING = {
    "virtual": {"receive_own_messages": True},
    "kvaser": {"receive_own_messages": True},
    "vector": {"receive_own_messages": True},
    "pcan": {"receive_own_messages": True},
    "nixnet": {"receive_own_messages": True},
    "neovi": {"receive_own_messages": True},
    "etas": {"receive_own_messages": True},
    "gs_usb": {},
    "cantact": {},
}
"""Interfaces of python-can 4.6 that mark echoes with `is_rx` False, and what asks for it."""

_SIMULATED_DOUBT_NS = 1 * US
"""A float of seconds since 1970 resolves 0.24 us."""
_ADAPTER_DOUBT_NS = 1 * MS
"""USB and driver latency that following the stamps does not remove."""
_HANDOVER_NS = 2 * MS
"""How long after the hand-over a frame that is never echoed may end on an idle bus: one
longest frame at 125 kbit/s, and the adapter's own latency."""
_SEND_LIMIT_S = 1.0
_SLICE_NS = 2 * MS
"""How long to wait in python-can at a time where an interface has no descriptor."""
_STEP_CHECK_NS = 100 * MS
_LONGEST_TEXT = 200


class PythonCanPort:
    """The tester's end of a python-can interface (see `hil_tests.bus.port.Port`).

    Args:
        interface: python-can's name of the interface type, e.g. "pcan".
        channel: e.g. "PCAN_USBBUS1"; udp_multicast also takes "ADDRESS:PORT".
        bit_rate: in bit/s; None leaves it to python-can's configuration.

    Raises:
        BusUnavailable: the interface cannot be opened, or another run holds it.
    """

    def __init__(self, interface: str, channel: str, bit_rate: int | None = None) -> None:
        self.name = f"{channel} ({interface})"
        self.timed = interface not in SIMULATED
        self.doubt_ns = _ADAPTER_DOUBT_NS if self.timed else _SIMULATED_DOUBT_NS
        source = "adapter's stamps followed onto" if self.timed else "stamps of"
        doubt = show_span(self.doubt_ns)
        self.clock = f"{source} CLOCK_REALTIME, doubt {doubt}"
        self._interface = interface
        self._channel = channel
        self._echoes = interface in _ECHOING
        self._tag = f"nodeproof-{os.getpid()}-{secrets.token_hex(8)}"
        self._tagged = interface == "udp_multicast"
        self._ready: deque[Sighting | BusEvent] = deque()
        self._follower = Follower()
        self._steps = StepWatch()
        self._checked_at = 0
        self._gone = ""
        self._lock = ChannelLock(interface, channel)
        try:
            self._open(bit_rate)
        except BaseException:
            self._lock.release()
            raise

    def _open(self, bit_rate: int | None) -> None:
        import can  # costs 220 ms, so only where it is used  # noqa: PLC0415

        self._error = can.CanError
        self._message = can.Message
        options: dict[str, Any] = dict(_ECHOING.get(self._interface, {}))
        channel = self._channel
        if self._tagged:
            channel, options["port"] = Group.of(channel)
        if bit_rate is not None and self.timed:
            options["bitrate"] = bit_rate
        try:
            self._bus = can.Bus(channel, interface=self._interface, **options)
        except Exception as error:  # drivers raise whatever they like
            raise BusUnavailable(
                f"python-can cannot open {self.name}: {_short(error)}; check the adapter, "
                "its driver and the channel's name"
            ) from error
        self._fd = _descriptor(self._bus)
        if self._tagged and self._fd is not None:
            hear_own_group_only(self._fd)

    def now(self) -> int:
        """CLOCK_REALTIME in ns."""
        return time.time_ns()

    def send(self, frame: Frame) -> None:
        """Queue a frame for the bus.

        Raises:
            BusUnavailable: the adapter refuses.
            FrameNotCarried: a DLC above 8, which python-can cannot send.
        """
        self._check_open()
        if frame.dlc > 8:
            text = f"python-can sends no DLC {frame.dlc}; use a socketcan interface"
            raise FrameNotCarried(text)
        message = self._message(
            arbitration_id=frame.can_id,
            data=None if frame.remote else frame.data,
            is_remote_frame=frame.remote,
            is_extended_id=frame.extended,
            dlc=frame.dlc,
            channel=self._tag if self._tagged else None,
        )
        began = time.time_ns()
        try:
            self._bus.send(message, timeout=_SEND_LIMIT_S)
        except (self._error, OSError) as error:
            raise BusUnavailable(
                f"{self.name} does not send: {_short(error)}; is anything on the bus to "
                "acknowledge, at this bit rate?"
            ) from error
        if not self._tagged and not self._echoes:
            at = time.time_ns() + _HANDOVER_NS
            self._ready.append(Sighting(frame, at, at - began, own=True))

    def next(self, until: int, also: Sequence[int] = ()) -> Sighting | BusEvent | None:
        """The next frame or event, at the latest at `until` (see the port's contract)."""
        while True:
            if self._ready:
                return self._ready.popleft()
            found = self._receive(0.0)
            if found is not None:
                return found
            now = time.time_ns()
            if now - self._checked_at > _STEP_CHECK_NS or now < self._checked_at:
                self._checked_at = now
                self._check_clock(now)
                continue
            wait_ns = patience_ns(until - now)
            if self._fd is not None:
                ready = select.select([self._fd, *also], [], [], wait_ns / S)[0]
                if self._fd not in ready and (ready or now + wait_ns >= until):
                    return None
                continue
            # No descriptor: wait inside python-can, in slices if others must be watched.
            if wait_ns == 0 or (also and select.select(also, [], [], 0)[0]):
                return None
            found = self._receive((min(wait_ns, _SLICE_NS) if also else wait_ns) / S)
            if found is not None:
                return found

    def set_bit_rate(self, bit_rate: int) -> None:
        """Open the adapter again at `bit_rate` bit/s; a simulated wire has no bit rate."""
        self._check_open()
        if not self.timed:
            return
        self._bus.shutdown()
        self._open(bit_rate)

    def close(self) -> None:
        """Leave the bus; calling it twice is allowed."""
        if not self._gone:
            self._gone = f"{self.name} was closed"
        self._bus.shutdown()
        self._lock.release()

    def _receive(self, wait_s: float) -> Sighting | BusEvent | None:
        self._check_open()
        try:
            message = self._bus.recv(wait_s)
        except (self._error, OSError) as error:
            return self._trouble(error)
        if message is None:
            return None
        seen_at = time.time_ns()
        at = round(message.timestamp * S)
        if not at:
            at = seen_at
        elif self.timed:
            at = self._follower.ours(at, seen_at)
        if message.is_error_frame:
            return BusEvent(EventKind.ERROR, at, f"data {bytes(message.data).hex()}")
        if message.is_fd:
            text = f"identifier {message.arbitration_id:03X}h, {len(message.data)} bytes"
            return BusEvent(EventKind.FD_FRAME, at, text)
        try:
            frame = _frame(message)
        except ValueError as error:
            return BusEvent(EventKind.ERROR, at, f"no classical CAN frame: {error}")
        own = message.channel == self._tag if self._tagged else not message.is_rx
        return Sighting(frame, at, self.doubt_ns, own)

    def _trouble(self, error: Exception) -> BusEvent:
        """A datagram that is no frame is an event; all else ends the port."""
        now = time.time_ns()
        if self._tagged and not isinstance(error.__cause__, OSError | None):
            return BusEvent(EventKind.ERROR, now, f"no CAN frame: {_short(error.__cause__)}")
        self._gone = f"{self.name} stopped receiving: {_short(error)}; check the adapter"
        return BusEvent(EventKind.DOWN, now, self._gone)

    def _check_clock(self, now: int) -> None:
        step = self._steps.step()
        if step:
            text = f"the host's clock was set by {show_span(step)}; do not do that in a run"
            self._ready.append(BusEvent(EventKind.GAP, now, text))

    def _check_open(self) -> None:
        if self._gone:
            raise BusUnavailable(self._gone)


def interfaces() -> frozenset[str]:
    """Names of the interface types that python-can knows, plug-ins included."""
    import can  # noqa: PLC0415 - costs 220 ms, so only where it is used

    return frozenset(can.VALID_INTERFACES)


def _frame(message: can.Message) -> Frame:
    """The frame in a message; the data of a remote frame are not looked at."""
    data = b"" if message.is_remote_frame else bytes(message.data)
    return Frame(
        message.arbitration_id,
        data,
        message.is_remote_frame,
        message.is_extended_id,
        message.dlc,
    )


def _descriptor(bus: can.BusABC) -> int | None:
    """What select can wait on, where the interface has something of the kind."""
    try:
        descriptor = bus.fileno()
    except (NotImplementedError, AttributeError):
        return None
    return descriptor if descriptor >= 0 else None


def _short(error: object) -> str:
    return repr(error)[:_LONGEST_TEXT]
