"""Which kernel modules the guest needs, in the order in which they must be loaded.

The dependencies are read from the modules themselves (the `depends=` field of their .modinfo
section), so neither `depmod` nor its index is needed, and a package that was only unpacked will
do.
"""

from __future__ import annotations

import gzip
import lzma
import re
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path

from hil_tests.vm.errors import Unavailable

# The file system of the host (9p over virtio, with an overlay that takes the writes), the serial
# ports that carry the output, and CAN. A kernel may have any of them built in.
NEEDED = (
    "virtio_pci", "9pnet_virtio", "9p", "virtio_console", "overlay", "can", "can_raw", "vcan",
)  # fmt: skip

_DEPENDS = re.compile(rb"\0depends=([^\0]*)\0")


@dataclass(frozen=True, slots=True)
class Module:
    """A kernel module, uncompressed.

    Attributes:
        name: Its name as the kernel spells it, with underscores.
        data: The object file.
    """

    name: str
    data: bytes


def closure(folder: Path, names: tuple[str, ...] = NEEDED) -> tuple[Module, ...]:
    """Returns the named modules and all that they need, dependencies first.

    Args:
        folder: The modules of one kernel, as in /lib/modules/RELEASE.
        names: Modules to load; those built into the kernel are left out.

    Raises:
        Unavailable: A module is neither there nor built in.
    """
    files = {_name(path): path for path in folder.rglob("*.ko*")}
    builtin = _builtin(folder)
    loaded: dict[str, Module] = {}
    for name in names:
        _load(name, files, builtin, loaded)
    return tuple(loaded.values())


def _load(
    name: str, files: dict[str, Path], builtin: frozenset[str], loaded: dict[str, Module]
) -> None:
    if name in loaded or name in builtin:
        return
    if name not in files:
        raise Unavailable(
            f"The guest kernel has no module {name!r}. Choose another kernel with --kernel PATH;"
            " Debian's stock kernel has it (nodeproof vcan --setup fetches it), Ubuntu keeps it"
            " in linux-modules-extra."
        )
    data = _uncompressed(files[name])
    depends = _DEPENDS.search(data)
    for needed in depends[1].decode().split(",") if depends and depends[1] else ():
        _load(needed.replace("-", "_"), files, builtin, loaded)
    loaded[name] = Module(name, data)


def _name(path: Path) -> str:
    return path.name.partition(".ko")[0].replace("-", "_")


def _builtin(folder: Path) -> frozenset[str]:
    try:
        listed = (folder / "modules.builtin").read_text()
    except FileNotFoundError:
        return frozenset()
    return frozenset(_name(Path(line)) for line in listed.splitlines())


def _uncompressed(path: Path) -> bytes:
    data = path.read_bytes()
    match path.suffix:
        case ".xz":
            return lzma.decompress(data)
        case ".gz":
            return gzip.decompress(data)
        case ".zst":
            return _unzstd(data, path)
    return data


def _unzstd(data: bytes, path: Path) -> bytes:
    zstd = shutil.which("zstd")
    if zstd is None:
        raise Unavailable(f"{path.name} is compressed with zstd: install the program `zstd`.")
    return subprocess.run([zstd, "-dc"], input=data, capture_output=True, check=True).stdout
