"""A wire through python-can, for interfaces other than SocketCAN.

Some interfaces hand sent frames back (udp_multicast always, unmarked). A device must not
hear itself: the message field `channel` of udp_multicast travels with the frame and holds
a tag of ours; elsewhere `is_rx` tells.
"""

from __future__ import annotations

import re
import secrets
import time
from typing import Any

from node_model.frame import Frame
from node_model.host.wires import WireError

_UDP_PORT = re.compile(r"(?:\[(?P<six>.+)\]|(?P<four>[0-9.]+)):(?P<port>[0-9]{1,5})")
_NS = 1_000_000_000
_REALTIME = frozenset({"udp_multicast", "virtual", "socketcan"})
"""Interfaces whose stamps are CLOCK_REALTIME; others count from their own start."""


class PythonCanWire:
    """A python-can bus.

    Args:
        interface: its type, e.g. "udp_multicast".
        channel: e.g. "239.74.163.2", or "239.74.163.2:43113" with a port.

    Raises:
        WireError: python-can is missing or cannot open it.
    """

    def __init__(self, interface: str, channel: str) -> None:
        self.name = channel
        self._tag = f"node-{secrets.token_hex(8)}"
        self._tagged = interface == "udp_multicast"
        self._realtime = interface in _REALTIME
        try:
            import can  # noqa: PLC0415 - an extra, and it costs 220 ms
        except ImportError:
            raise WireError(f"interface {interface!r} needs the package python-can") from None
        self._error = can.CanError
        self._message = can.Message
        options: dict[str, Any] = {}
        if self._tagged and (found := _UDP_PORT.fullmatch(channel)):
            channel = found["six"] or found["four"]
            options["port"] = int(found["port"])
        try:
            self._bus = can.Bus(channel, interface=interface, **options)
        except Exception as error:  # drivers raise whatever they like
            raise WireError(f"cannot open {channel!r} ({interface}): {error!r}") from error
        self.descriptor = _descriptor(self._bus)

    def receive(self) -> tuple[Frame, int] | None:
        """The next classical frame of somebody else, or None."""
        while True:
            try:
                message = self._bus.recv(0)
            except (self._error, OSError) as error:
                if self._tagged and not isinstance(error.__cause__, OSError | None):
                    continue  # a datagram on the group that is no frame
                raise WireError(f"{self.name!r} stopped receiving: {error!r}") from error
            if message is None:
                return None
            own = message.channel == self._tag if self._tagged else not message.is_rx
            if own or message.is_error_frame or message.is_fd:
                continue
            at = round(message.timestamp * _NS) if self._realtime else time.time_ns()
            try:
                return _frame(message), at
            except ValueError:
                continue  # no classical frame: the controller of a device would drop it

    def send(self, frame: Frame) -> bool:
        """Send a frame; False = the adapter's queue is full."""
        message = self._message(
            arbitration_id=frame.can_id,
            data=None if frame.remote else frame.data,
            is_remote_frame=frame.remote,
            is_extended_id=frame.extended,
            dlc=min(frame.dlc, 8),
            channel=self._tag if self._tagged else None,
        )
        try:
            self._bus.send(message, timeout=0)
        except TimeoutError:
            return False
        except (self._error, OSError) as error:
            raise WireError(f"{self.name!r} stopped sending: {error!r}") from error
        return True

    def close(self) -> None:
        """Leave the bus."""
        self._bus.shutdown()


def _frame(message: Any) -> Frame:
    data = b"" if message.is_remote_frame else bytes(message.data)
    return Frame(
        message.arbitration_id,
        data,
        message.is_remote_frame,
        message.is_extended_id,
        message.dlc,
    )


def _descriptor(bus: Any) -> int | None:
    try:
        descriptor = int(bus.fileno())
    except (NotImplementedError, AttributeError):
        return None
    return descriptor if descriptor >= 0 else None
