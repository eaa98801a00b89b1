"""Channels of udp_multicast."""

from __future__ import annotations

import inspect
import socket

import pytest

from hil_tests.bus.multicast import Group, hear_own_group_only

GROUPS = {
    "239.0.0.1": ("239.0.0.1", 43113),
    "239.0.0.1:5000": ("239.0.0.1", 5000),
    "ff15::1": ("ff15::1", 43113),
    "[ff15::1]:5000": ("ff15::1", 5000),
}


@pytest.mark.parametrize("channel", GROUPS)
def test_a_channel_is_a_group_and_a_port(channel: str) -> None:
    """Without a port it is python-can's; an IPv6 group with a port stands in brackets."""
    assert Group.of(channel) == GROUPS[channel]
    assert Group.of(Group.of(channel).at(7)) == (GROUPS[channel][0], 7)


def test_the_port_is_that_of_python_can() -> None:
    """A channel without a port is opened where python-can would open it."""
    udp_multicast = pytest.importorskip("can.interfaces.udp_multicast")
    default = inspect.signature(udp_multicast.UdpMulticastBus).parameters["port"].default
    assert Group.of("239.0.0.1").port == default


def test_a_socket_that_is_no_multicast_stays_as_it_is() -> None:
    """What Linux cannot set is left alone; the socket stays open."""
    ends = socket.socketpair()
    with ends[0], ends[1], socket.socket(socket.AF_INET6, socket.SOCK_DGRAM) as six:
        for end in (ends[0], six):
            hear_own_group_only(end.fileno())
            assert end.fileno() >= 0
