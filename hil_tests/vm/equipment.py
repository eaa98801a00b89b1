"""What this host has for running the machine, what it lacks, and how the lack is mended."""

from __future__ import annotations

import platform
from dataclasses import dataclass
from pathlib import Path

from hil_tests.vm import kernel, packages
from hil_tests.vm.errors import Unavailable
from hil_tests.vm.kernel import GuestKernel
from hil_tests.vm.shell import Shell

_QEMU = "qemu-system-x86_64"
_REMEDY = "`nodeproof vcan --setup` fetches or names what is missing."


@dataclass(frozen=True, slots=True)
class Equipment:
    """All that a machine is made of.

    Attributes:
        qemu: The emulator.
        busybox: A statically linked busybox: the guest's first tools.
        kernel: The guest's kernel.
    """

    qemu: str
    busybox: Path
    kernel: GuestKernel


def gather(shell: Shell, cache: Path, kernel_given: Path | None) -> Equipment:
    """Returns what is there, without fetching anything.

    Raises:
        Unavailable: Something is missing; the message names all of it.
    """
    _need_linux_on_x86()
    found = kernel.given(kernel_given) if kernel_given else kernel.find(_kernels(cache))
    qemu, busybox = shell.find(_QEMU), _busybox(shell, cache)
    if qemu is not None and busybox is not None and found is not None:
        return Equipment(qemu, busybox, found)
    parts = {_QEMU: qemu, "a static busybox": busybox, "a guest kernel with vcan": found}
    missing = [name for name, value in parts.items() if value is None]
    raise Unavailable(f"The virtual machine lacks {', '.join(missing)}. {_REMEDY}")


def set_up(shell: Shell, cache: Path) -> list[str]:
    """Fetches what is missing, and returns the commands that are left for root to run.

    Raises:
        Unavailable: The distribution's archive does not have it, or there is no apt here.
    """
    _need_linux_on_x86()
    left = []
    if shell.find(_QEMU) is None:
        if shell.is_root():
            shell.run(*packages.INSTALL_QEMU)
        else:
            left.append("sudo " + " ".join(packages.INSTALL_QEMU))
    if _busybox(shell, cache) is None:
        packages.fetch_busybox(shell, cache / "busybox")
    if kernel.find(_kernels(cache)) is None:
        packages.fetch_kernel(shell, _kernels(cache))
    return left


def _kernels(cache: Path) -> Path:
    return cache / "kernels"


def _busybox(shell: Shell, cache: Path) -> Path | None:
    """Returns a busybox that runs where no library is: one fetched earlier, or the host's."""
    fetched = [path for path in (cache / "busybox").rglob("bin/busybox") if path.is_file()]
    installed = [shell.find(name) for name in ("busybox-static", "busybox")]
    found = (*fetched, *(Path(path) for path in installed if path))
    return next((path for path in found if _is_static(path)), None)


def _is_static(program: Path) -> bool:
    """Whether an ELF program asks for no dynamic loader, whose path would stand near the start."""
    start = program.read_bytes()[:4096]
    return b"/ld-linux" not in start and b"/ld-musl" not in start


def _need_linux_on_x86() -> None:
    here = platform.system(), platform.machine()
    if here != ("Linux", "x86_64"):
        raise Unavailable(
            "The virtual machine runs this host's own programs and is made for Linux on x86_64;"
            f" this is {' on '.join(here)}. Run nodeproof in a Linux container, or use virtual"
            " time (plain `pytest`), which needs no SocketCAN."
        )
