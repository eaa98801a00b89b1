"""The memory of a hosted node as a file."""

from __future__ import annotations

from pathlib import Path

from node_model.host.wires import WireError


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
