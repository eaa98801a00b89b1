"""Which port serves which interface."""

from __future__ import annotations

import contextlib
import secrets

import pytest

from hil_tests.bus.choose import open_port
from hil_tests.bus.pythoncan import PythonCanPort
from hil_tests.errors import BusUnavailable


def test_unknown_interface_names_near_misses() -> None:
    """A misspelt type is answered with those that are like it."""
    with pytest.raises(BusUnavailable, match=r"'socketcam'; did you mean .*socketcan"):
        open_port("socketcam", "vcan0")


def test_interface_without_a_near_miss_lists_all() -> None:
    """Where nothing is alike, all types are named."""
    with pytest.raises(BusUnavailable, match="virtual"):
        open_port("§§§", "vcan0")


@pytest.mark.parametrize("interface", ["socketcan", "virtual"])
def test_channel_is_needed(interface: str) -> None:
    """An empty name would bind a SocketCAN socket to all interfaces."""
    with pytest.raises(BusUnavailable, match="no channel"):
        open_port(interface, "")


def test_other_interfaces_go_through_python_can() -> None:
    """The name says channel and type; a simulated wire is untimed."""
    channel = secrets.token_hex(4)
    with contextlib.closing(open_port("virtual", channel, 125_000)) as port:
        assert isinstance(port, PythonCanPort)
        assert port.name == f"{channel} (virtual)"
        assert not port.timed


def test_adapter_that_is_not_there_is_told() -> None:
    """What a driver raises becomes a message with the next step."""
    with pytest.raises(BusUnavailable, match=r"cannot open nowhere \(pcan\).*check the adapter"):
        open_port("pcan", "nowhere")
