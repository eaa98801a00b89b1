"""Fetches what the machine needs from the distribution's archive, without installing it.

No root is needed: a kernel package is only unpacked: nothing is configured, no boot loader is
touched, and removing the cache folder removes it all. QEMU alone has to be installed properly.
"""

from __future__ import annotations

import re
import tempfile
from collections.abc import Iterable
from pathlib import Path

from hil_tests.vm.errors import Unavailable
from hil_tests.vm.shell import Shell

# Packages that always depend on the newest kernel: Debian's, Ubuntu's.
_NEWEST_KERNEL = ("linux-image-amd64", "linux-image-generic")
_BUSYBOX = "busybox-static"
INSTALL_QEMU = ("apt-get", "install", "-y", "--no-install-recommends", "qemu-system-x86")

_DEPENDS = re.compile(r"Depends: (linux-image-\d\S*)")


def kernel_package(shell: Shell) -> str:
    """Returns the package of the distribution's newest kernel, e.g. "linux-image-6.1.0-18-amd64".

    Raises:
        Unavailable: There is no apt here, or it knows no kernel.
    """
    _need_apt(shell)
    for newest in _NEWEST_KERNEL:
        if found := _DEPENDS.search(_known(shell, "apt-cache", "depends", newest)):
            return found[1]
    raise Unavailable(
        "apt knows no kernel package: run `sudo apt-get update`, or give one with --kernel PATH."
    )


def fetch_kernel(shell: Shell, folder: Path) -> Path:
    """Unpacks the distribution's newest kernel into a folder below `folder` and returns that."""
    package = kernel_package(shell)
    # Ubuntu keeps the modules in packages of their own; Debian has none of these names.
    release = package.removeprefix("linux-image-")
    extra = (f"linux-modules-{release}", f"linux-modules-extra-{release}")
    known = [name for name in extra if _is_known(shell, name)]
    return _unpacked(shell, [package, *known], folder / release)


def fetch_busybox(shell: Shell, folder: Path) -> Path:
    """Unpacks a static busybox into `folder` and returns the program."""
    _need_apt(shell)
    unpacked = _unpacked(shell, [_BUSYBOX], folder)
    return next(path for path in unpacked.rglob("bin/busybox") if path.is_file())


def _unpacked(shell: Shell, packages: Iterable[str], target: Path) -> Path:
    """Fetches and unpacks beside the target, then renames: a folder that is there is complete."""
    if target.exists():
        return target
    target.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix="fetching-", dir=target.parent) as name:
        work = Path(name)
        for package in packages:
            shell.run("apt-get", "download", package, cwd=work)
        for archive in work.glob("*.deb"):
            shell.run("dpkg", "-x", str(archive), str(work / "unpacked"))
        _moved(work / "unpacked", target)
    return target


def _moved(unpacked: Path, target: Path) -> None:
    try:
        unpacked.rename(target)
    except OSError:
        # Another run was faster; its copy is as good as ours.
        if not target.exists():
            raise


def _need_apt(shell: Shell) -> None:
    if shell.find("apt-get") is None or shell.find("dpkg") is None:
        raise Unavailable(
            "This system has no apt-get and dpkg to fetch a kernel with: install a static busybox,"
            " and give a kernel with --kernel PATH (a file like /boot/vmlinuz-RELEASE, its modules"
            " in /lib/modules/RELEASE)."
        )


def _known(shell: Shell, *command: str) -> str:
    try:
        return shell.run(*command)
    except Unavailable:
        return ""


def _is_known(shell: Shell, package: str) -> bool:
    return bool(_known(shell, "apt-cache", "show", package).strip())
