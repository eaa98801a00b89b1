"""Finds a kernel for the guest: the user's, one fetched earlier, or one of this host."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from hil_tests.vm import image, modules
from hil_tests.vm.errors import Unavailable


@dataclass(frozen=True, slots=True)
class GuestKernel:
    """A kernel and the folder of its modules.

    Attributes:
        release: As `uname -r` says in the guest.
        image: What the machine boots.
        modules: The folder lib/modules/RELEASE.
    """

    release: str
    image: Path
    modules: Path


def given(path: Path) -> GuestKernel:
    """Returns the kernel that a user named.

    Its modules are looked for beside the file, as in an unpacked package (boot/vmlinuz-RELEASE
    with lib/modules/RELEASE), then on this host.

    Raises:
        Unavailable: It is no kernel, or its modules are not to be found.
    """
    release = image.release(path)
    roots = [*path.absolute().parents, Path("/usr")]
    for folder in (root / "lib/modules" / release for root in roots):
        if folder.is_dir():
            return GuestKernel(release, path, folder)
    raise Unavailable(
        f"The modules of {path} were not found: put them into lib/modules/{release} beside its"
        " folder (unpack the kernel's whole package, e.g. with `dpkg -x PACKAGE.deb FOLDER`)."
    )


def find(kernels: Path, host: Path = Path("/")) -> GuestKernel | None:
    """Returns a kernel that can be had without fetching one, None where there is none.

    Args:
        kernels: The folder of fetched kernels; the newest of them comes first.
        host: The root of the host's file system, whose own kernels come next.
    """
    fetched = _newest_first(kernels.glob("*/boot/vmlinuz-*"))
    for path in (*fetched, *_newest_first((host / "boot").glob("vmlinuz-*"))):
        try:
            kernel = given(path)
            modules.closure(kernel.modules)
        except Unavailable:
            # Unreadable for this user, or without vcan: the next may do.
            continue
        return kernel
    return None


def _newest_first(paths: Iterator[Path]) -> list[Path]:
    return sorted(paths, key=lambda path: path.stat().st_mtime, reverse=True)


def unpacked(kernel: GuestKernel, folder: Path) -> GuestKernel:
    """Returns the kernel with an image that boots faster, kept in `folder`, if one can be made."""
    target = folder / f"vmlinux-{kernel.release}"
    if not _is_current(target, kernel.image):
        elf = image.uncompressed(kernel.image.read_bytes())
        if elf is None:
            return kernel
        folder.mkdir(parents=True, exist_ok=True)
        # Written aside and renamed, so that another run never boots half a kernel.
        with tempfile.NamedTemporaryFile(dir=folder, prefix="unpacking-", delete=False) as partial:
            partial.write(elf)
        Path(partial.name).rename(target)
    return GuestKernel(kernel.release, target, kernel.modules)


def _is_current(target: Path, source: Path) -> bool:
    return target.exists() and target.stat().st_mtime >= source.stat().st_mtime
