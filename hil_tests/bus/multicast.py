"""Channels of python-can's udp_multicast: a group of hosts, and a UDP port."""

from __future__ import annotations

import os
import re
import socket
from contextlib import suppress
from typing import NamedTuple

DEFAULT_PORT = 43113
"""python-can's own, where the channel names none."""

_WITH_PORT = re.compile(r"(?:\[(?P<six>.+)\]|(?P<four>[0-9.]+)):(?P<port>[0-9]{1,5})")


class Group(NamedTuple):
    """A multicast channel.

    Args:
        address: of the group, without brackets.
        port: UDP port. Linux hands every socket on it the frames of all groups.
    """

    address: str
    port: int

    @classmethod
    def of(cls, channel: str) -> Group:
        """Read "ADDRESS" or "ADDRESS:PORT"; an IPv6 address with a port stands in brackets."""
        found = _WITH_PORT.fullmatch(channel)
        if found is None:
            return cls(channel, DEFAULT_PORT)
        return cls(found["six"] or found["four"], int(found["port"]))

    def at(self, port: int) -> str:
        """The channel of the same group on another port."""
        host = f"[{self.address}]" if ":" in self.address else self.address
        return f"{host}:{port}"


_HEARS_ALL = {
    socket.AF_INET: (socket.IPPROTO_IP, 49),
    socket.AF_INET6: (socket.IPPROTO_IPV6, 29),
}
"""Linux: IP_MULTICAST_ALL and IPV6_MULTICAST_ALL, which Python does not name."""


def hear_own_group_only(descriptor: int) -> None:
    """What programs send to other groups on the same port stays away, as far as Linux can do it.

    Args:
        descriptor: of a multicast socket; it stays open.
    """
    with socket.socket(fileno=os.dup(descriptor)) as end:
        option = _HEARS_ALL.get(end.family)
        if option is not None:
            with suppress(OSError):  # an old kernel, or another system
                end.setsockopt(*option, 0)
