"""The memory of a hosted node as a file."""

from __future__ import annotations

from pathlib import Path

from node_model.host.wires import WireError
from node_model.node import Panel


def read_image(path: Path) -> bytes | None:
    """Memory of an earlier life; None where there is no such file yet."""
    try:
        return path.read_bytes()
    except FileNotFoundError:
        return None
    except OSError as error:
        raise WireError(f"storage {path}: {error.strerror}") from None


def write_image(path: Path, image: bytes) -> None:
    """Replace the file in one step, so that a crash leaves the old or the new one."""
    fresh = path.with_name(f".{path.name}.new")
    fresh.write_bytes(image)
    fresh.replace(path)


class Keeper:
    """Keeps the memory of a node in a file.

    Args:
        node: whose memory; what it holds now is in the file already, or the factory's.
        path: of the file.
    """

    def __init__(self, node: Panel, path: Path) -> None:
        self._node = node
        self._path = path
        self._kept = node.image()

    def keep(self) -> None:
        """Write what has changed since it was last written."""
        image = self._node.image()
        if image != self._kept:
            write_image(self._path, image)
            self._kept = image
