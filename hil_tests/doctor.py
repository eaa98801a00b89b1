"""Says what this machine can do, a line each, with a remedy for what it cannot.

A line begins with "ok", with "--" for what is missing but not needed by everybody, or with
"!!" for what keeps a run from starting.
"""

from __future__ import annotations

import importlib.util
import os
import platform
import socket
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from enum import Enum
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from hil_tests.config import BenchFile, DeviceProfile

_PACKAGES = ("nodeproof", "pytest", "hypothesis", "attrs", "cattrs", "python-can")
_BUFFER_LIMIT = Path("/proc/sys/net/core/rmem_max")
_SO_RCVBUFFORCE = 33
"""<asm-generic/socket.h>"""


class Sign(Enum):
    """How a line begins."""

    GOOD = "ok"
    LACKING = "--"
    BAD = "!!"


@dataclass(frozen=True, slots=True)
class Finding:
    """One line.

    Args:
        sign: see there.
        topic: one word or two.
        text: what was found.
        remedy: what to do about it; "" = nothing.
    """

    sign: Sign
    topic: str
    text: str
    remedy: str = ""

    @property
    def is_needed(self) -> bool:
        """Nothing can be tested without it."""
        return self.sign is Sign.BAD

    def __str__(self) -> str:
        hint = f"; {self.remedy}" if self.remedy else ""
        return f"{self.sign.value}  {self.topic:16s}{self.text}{hint}"


def examine(bench: str | None = None) -> Iterator[Finding]:
    """Everything, one after the other.

    Args:
        bench: a bench file that is checked too, with its bus and its control server.

    Raises:
        ConfigError: the bench file, or the profile that it names, is wrong.
    """
    yield python()
    yield from packages()
    yield plugin()
    yield socketcan()
    yield interfaces()
    yield multicast(has_msgpack=importlib.util.find_spec("msgpack") is not None)
    yield receive_buffer(may_force=may_force_buffer(), limit=buffer_limit())
    yield terminal(os.isatty(0))
    if bench is not None:
        yield from bench_findings(bench)


def python() -> Finding:
    """The interpreter and its platform."""
    version = platform.python_version()
    return Finding(Sign.GOOD, "python", f"{version} on {platform.system()} {platform.machine()}")


def packages(version: Callable[[str], str] = metadata.version) -> Iterator[Finding]:
    """What is installed of what nodeproof needs."""
    found = []
    for name in _PACKAGES:
        try:
            found.append(f"{name} {version(name)}")
        except metadata.PackageNotFoundError:
            yield Finding(Sign.BAD, "package", f"{name} is missing", "pip install -e .")
    yield Finding(Sign.GOOD, "packages", ", ".join(found))


def plugin(names: frozenset[str] | None = None) -> Finding:
    """Whether pytest finds the plugin by itself; a stale installation may not tell it."""
    if names is None:
        names = frozenset(point.value for point in metadata.entry_points(group="pytest11"))
    if "hil_tests.plugin" in names:
        return Finding(Sign.GOOD, "pytest plugin", "is found by pytest")
    return Finding(
        Sign.LACKING,
        "pytest plugin",
        "is not registered, so it works in the checkout only",
        "install again: pip install -e .",
    )


def socketcan() -> Finding:
    """Where `nodeproof vcan` would run a command."""
    from hil_tests.bus.link import can_interfaces  # noqa: PLC0415
    from hil_tests.vm import command, native  # noqa: PLC0415
    from hil_tests.vm.shell import HostShell, cache_folder  # noqa: PLC0415

    host = command.Host(HostShell(), native.Probe(), cache_folder(os.environ))
    there = can_interfaces()
    text = f"interfaces: {', '.join(there)}" if there else "no interface"
    return socketcan_finding(text, command.availability(host, ["vcan0"]))


def socketcan_finding(there: str, available: str) -> Finding:
    """The line for what `nodeproof vcan --check` says, e.g. "native: vcan0 on this kernel"."""
    way, _, why = available.partition(":")
    if way == "nothing":
        return Finding(Sign.LACKING, "socketcan", f"{there}; no vcan:{why}")
    return Finding(Sign.GOOD, "socketcan", f"{there}; nodeproof vcan would use {available}")


def interfaces() -> Finding:
    """Kinds of adapters that python-can knows; drivers of the makers are not looked for."""
    from hil_tests.bus.pythoncan import interfaces as known  # noqa: PLC0415

    return Finding(Sign.GOOD, "adapters", f"python-can knows {', '.join(sorted(known()))}")


def multicast(*, has_msgpack: bool) -> Finding:
    """Whether python-can's udp_multicast works, a bus where no SocketCAN is to be had."""
    if has_msgpack:
        return Finding(Sign.GOOD, "udp_multicast", "is installed")
    remedy = "pip install 'nodeproof[multicast]', in the checkout: pip install -e '.[multicast]'"
    return Finding(Sign.LACKING, "udp_multicast", "its package msgpack is missing", remedy)


def may_force_buffer() -> bool:
    """Whether a socket's buffer may exceed the system's limit (needs CAP_NET_ADMIN)."""
    from hil_tests.bus.rawcan import RECEIVE_BUFFER  # noqa: PLC0415

    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.setsockopt(socket.SOL_SOCKET, _SO_RCVBUFFORCE, RECEIVE_BUFFER)
        except OSError:
            return False
    return True


def buffer_limit() -> int:
    """The largest receive buffer of an ordinary user, in bytes; 0 = not known."""
    try:
        return int(_BUFFER_LIMIT.read_text())
    except (OSError, ValueError):
        return 0


def receive_buffer(*, may_force: bool, limit: int) -> Finding:
    """Whether a busy bus can be read without a loss."""
    from hil_tests.bus.rawcan import RECEIVE_BUFFER  # noqa: PLC0415

    if may_force or limit >= RECEIVE_BUFFER:
        return Finding(Sign.GOOD, "receive buffer", f"{RECEIVE_BUFFER >> 20} MiB are granted")
    return Finding(
        Sign.LACKING,
        "receive buffer",
        f"{limit >> 10} KiB at most: a busy bus may lose frames (told as a gap)",
        f"sudo sysctl net.core.rmem_max={RECEIVE_BUFFER}",
    )


def terminal(is_there: bool) -> Finding:
    """Whether an operator could be asked."""
    if is_there:
        return Finding(Sign.GOOD, "terminal", "an operator can be asked here")
    remedy = "drivers of the kind operator need one: run from a terminal"
    return Finding(Sign.LACKING, "terminal", "standard input is none", remedy)


def bench_findings(path: str) -> Iterator[Finding]:
    """A bench file, and whether what it names is there.

    Raises:
        ConfigError: the file, or the profile that it names, is wrong.
    """
    from hil_tests.config import load_bench, load_profile  # noqa: PLC0415

    bench = load_bench(path)
    profile = load_profile(bench.device.profile or "keypad")
    has = ", ".join(bench.facilities) or "no facility"
    yield Finding(Sign.GOOD, "bench file", f"{path} is sound: {has}; profile {profile.name}")
    if profile.kind == "keypad" and bench.device.commissioned is None:
        yield Finding(
            Sign.LACKING,
            "parameters",
            "what the device is commissioned to is not known",
            "state node_id and parameters in [device], or let it be commissioned:"
            " power, keys and --can-allow-writes",
        )
    yield bus_finding(bench)
    if bench.control is not None:
        yield control_finding(bench, profile)


def bus_finding(bench: BenchFile) -> Finding:
    """Opens the bus, as it is, and leaves it again."""
    from hil_tests.bus.choose import open_port  # noqa: PLC0415
    from hil_tests.errors import BenchError  # noqa: PLC0415

    if bench.bus.channel is None:
        text, remedy = "the file names no channel", "add it to [bus], or pass --can-iface"
        return Finding(Sign.LACKING, "bus", text, remedy)
    try:
        port = open_port(bench.bus.interface or "socketcan", bench.bus.channel)
    except BenchError as error:
        return Finding(Sign.BAD, "bus", str(error))
    try:
        return Finding(Sign.GOOD, "bus", f"{port.name}; {port.clock}")
    finally:
        port.close()


def control_finding(bench: BenchFile, profile: DeviceProfile) -> Finding:
    """Says hello to the control server, and bye."""
    from hil_tests.bench.drivers.peer import ControlSession  # noqa: PLC0415
    from hil_tests.errors import ControlError  # noqa: PLC0415

    assert bench.control is not None
    session = ControlSession(bench.control.address)
    try:
        session.connect()
        session.require(*needs_of(bench))
    except ControlError as error:
        return Finding(Sign.BAD, "control server", str(error))
    finally:
        session.close()
    can = ", ".join(sorted(session.can))
    clock = "our clock" if session.same_clock else "a clock of its own"
    named = f"{session.device!r} (profile {profile.name})"
    return Finding(Sign.GOOD, "control server", f"{named} can {can}; it has {clock}")


def needs_of(bench: BenchFile) -> list[str]:
    """What the control server must be able to do: the facilities that are driven by it."""
    driven = [name for name in bench.facilities if getattr(bench, name).driver == "control"]
    return ["bus" if name == "bitrate" else name for name in driven]
