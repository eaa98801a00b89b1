"""What the operating system knows of a CAN network interface, and its bit rate.

Reads sysfs; sets bit rates with the `ip` command (netlink is not written by hand here).
"""

from __future__ import annotations

import difflib
import fcntl
import json
import shutil
import socket
import struct
import subprocess
from pathlib import Path
from typing import Any

from hil_tests.errors import BenchError

NET = Path("/sys/class/net")
_ARPHRD_CAN = "280"
_SIOCGIFFLAGS = 0x8913
_IFF_UP = 1
_IP_TIME_OUT_S = 10
_LONGEST_OUTPUT = 200


def can_interfaces(net: Path = NET) -> list[str]:
    """Names of the CAN interfaces of this machine."""
    names = []
    for folder in sorted(net.iterdir()) if net.is_dir() else []:
        try:
            if (folder / "type").read_text().strip() == _ARPHRD_CAN:
                names.append(folder.name)
        except OSError:
            continue  # it went away while we looked
    return names


def is_simulated(channel: str, net: Path = NET) -> bool:
    """Whether no hardware stands behind the interface: vcan, vxcan.

    The kernel files an interface without a parent device under devices/virtual. An old
    serial-line driver (slcan before Linux 6.0) is filed there too; its frames are then
    judged as on an untimed wire, which errs on the safe side.
    """
    return "/devices/virtual/" in str((net / channel).resolve())


def is_up(sock: socket.socket, channel: str) -> bool:
    """Whether the interface is administratively up."""
    request = struct.pack("16sH14x", channel.encode(), 0)
    flags = struct.unpack_from("16xH", fcntl.ioctl(sock, _SIOCGIFFLAGS, request))[0]
    return bool(flags & _IFF_UP)


def missing_text(channel: str, net: Path = NET) -> str:
    """What to say of an interface that does not exist: near misses and the remedy."""
    known = can_interfaces(net)
    near = difflib.get_close_matches(channel, known, 3) or known
    have = f"there is {', '.join(near)}" if near else "this machine has no CAN interface"
    if channel.startswith(("vcan", "vxcan")):
        remedy = (
            f"make it: ip link add dev {channel} type vcan; ip link set {channel} up; "
            "or run where vcan exists: nodeproof vcan -- pytest ..."
        )
    else:
        remedy = "plug the adapter in and load its driver (ip -details link shows it)"
    return f"no CAN interface {channel!r}: {have}; {remedy}"


def down_text(channel: str, simulated: bool) -> str:
    """What to say of an interface that is down."""
    if simulated:
        return f"interface {channel!r} is down; ip link set {channel} up"
    return (
        f"interface {channel!r} is down; ip link set {channel} up type can bitrate 125000 "
        "(with the bit rate of the bus)"
    )


class BitRate:
    """Bit rate of a real CAN interface; the rate found first is restored by `restore`.

    Setting it takes the interface down and needs CAP_NET_ADMIN.
    """

    def __init__(self, channel: str) -> None:
        self._channel = channel
        self._found: int | None = None
        self._set: int | None = None

    def ensure(self, bit_rate: int) -> None:
        """Run the interface at `bit_rate` bit/s, unless it does already.

        Raises:
            BenchError: `ip` is missing or refused; with the command to run by hand.
        """
        current = self.current()
        if current == bit_rate and self._is_up():
            self._set = bit_rate
            return
        if self._found is None:
            self._found = current
        name = self._channel
        for command in (
            ["link", "set", name, "down"],
            ["link", "set", name, "type", "can", "bitrate", str(bit_rate)],
            ["link", "set", name, "up"],
        ):
            self._ip(command, bit_rate)
        self._set = bit_rate

    def current(self) -> int | None:
        """The bit rate in bit/s; None = not set or not known."""
        info = self._details()
        data = info.get("linkinfo", {}).get("info_data", {})
        rate = data.get("bittiming", {}).get("bitrate")
        return rate if isinstance(rate, int) and rate > 0 else None

    def restore(self) -> None:
        """Back to the rate that was found, if it was changed."""
        if self._found is not None and self._found != self._set:
            self.ensure(self._found)
        self._found = None

    def _is_up(self) -> bool:
        return "UP" in self._details().get("flags", [])

    def _details(self) -> dict[str, Any]:
        text = self._ip(["-details", "-json", "link", "show", "dev", self._channel], 0)
        try:
            links = json.loads(text)
        except ValueError:
            links = []
        return links[0] if links and isinstance(links[0], dict) else {}

    def _ip(self, arguments: list[str], bit_rate: int) -> str:
        by_hand = (
            f"sudo ip link set {self._channel} down; sudo ip link set {self._channel} "
            f"up type can bitrate {bit_rate}"
        )
        program = shutil.which("ip")
        if program is None:
            raise BenchError(f"the program 'ip' (iproute2) is missing; by hand: {by_hand}")
        done = subprocess.run(
            [program, *arguments],
            capture_output=True,
            text=True,
            errors="replace",
            timeout=_IP_TIME_OUT_S,
            check=False,
        )
        if done.returncode:
            said = done.stderr.strip()[:_LONGEST_OUTPUT]
            raise BenchError(
                f"ip {' '.join(arguments)} failed: {said!r}; setting a bit rate needs "
                f"CAP_NET_ADMIN; by hand: {by_hand}"
            )
        return done.stdout
