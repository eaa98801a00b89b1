"""Which port serves which kind of interface."""

from __future__ import annotations

import difflib

from hil_tests.bus.port import Port
from hil_tests.errors import BusUnavailable


def open_port(interface: str, channel: str, bit_rate: int | None = None) -> Port:
    """Open the tester's end of a bus.

    Args:
        interface: python-can's name of the interface type: "socketcan", "pcan"...
        channel: the channel on it: "vcan0", "can0", "PCAN_USBBUS1"...
        bit_rate: rate in bit/s to run a real interface at; None = as it is.

    Raises:
        BusUnavailable: unknown interface type (with near misses), missing channel,
            interface down, or held by another run.
        BenchError: the bit rate cannot be set.
    """
    if not channel:
        raise BusUnavailable(f"no channel given for interface {interface!r}, e.g. vcan0")
    if interface == "socketcan":
        from hil_tests.bus.socketcan import SocketCanPort  # noqa: PLC0415 - Linux only

        return SocketCanPort(channel, bit_rate)
    from hil_tests.bus.pythoncan import PythonCanPort, interfaces  # noqa: PLC0415 - slow import

    known = interfaces()
    if interface not in known:
        near = difflib.get_close_matches(interface, known, 3) or sorted(known)
        raise BusUnavailable(
            f"python-can has no interface type {interface!r}; did you mean {', '.join(near)}?"
        )
    return PythonCanPort(interface, channel, bit_rate)
