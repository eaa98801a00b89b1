"""Whether this kernel has the CAN interfaces itself, and how to make them."""

from __future__ import annotations

import socket
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from hil_tests.vm.errors import Unavailable
from hil_tests.vm.shell import Shell

# IFF_UP of <linux/if.h> and ARPHRD_CAN of <linux/if_arp.h>.
_UP = 0x1
_CAN = 280


def kernel_has_can() -> bool:
    """Whether this kernel knows raw CAN sockets (it may load the module for the question)."""
    try:
        socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW).close()
    except (OSError, AttributeError):
        return False
    return True


def is_up(channel: str, interfaces: Path = Path("/sys/class/net")) -> bool:
    """Whether the channel is a CAN interface that is up."""
    try:
        kind = int((interfaces / channel / "type").read_text())
        flags = int((interfaces / channel / "flags").read_text(), 16)
    except OSError:
        return False
    return kind == _CAN and bool(flags & _UP)


@dataclass(frozen=True, slots=True)
class Probe:
    """How to look at the kernel; a test brings answers of its own."""

    has_can: Callable[[], bool] = kernel_has_can
    is_up: Callable[[str], bool] = is_up


def obstacle(channels: Sequence[str], shell: Shell, probe: Probe) -> str | None:
    """Returns why this kernel cannot have the channels, None where they are up or can be made.

    Changes nothing.
    """
    if not probe.has_can():
        return "this kernel has no SocketCAN"
    down = [channel for channel in channels if not probe.is_up(channel)]
    if not down:
        return None
    if not shell.is_root() or shell.find("ip") is None:
        commands = "; ".join(
            f"sudo ip link add dev {name} type vcan; sudo ip link set {name} up" for name in down
        )
        return f"{', '.join(down)} is not up, and only root can make it: {commands}"
    return None


def make(channels: Sequence[str], shell: Shell, probe: Probe) -> None:
    """Makes the channels that are not up yet; they stay when the command is done.

    Raises:
        Unavailable: The kernel refused, most often because it has no vcan module.
    """
    for channel in channels:
        if probe.is_up(channel):
            continue
        _attempt(shell, "modprobe", "vcan")
        _attempt(shell, "ip", "link", "add", "dev", channel, "type", "vcan")
        shell.run("ip", "link", "set", channel, "up")


def _attempt(shell: Shell, *command: str) -> None:
    """Runs what may fail because it was not needed; what was needed shows in the next step."""
    try:
        shell.run(*command)
    except Unavailable:
        return
