"""The memory of a hosted node on disk."""

from __future__ import annotations

from pathlib import Path

import pytest

from node_model.host.memory import read_image, write_image
from node_model.host.wires import WireError


def test_image_survives(tmp_path: Path) -> None:
    """Written in one step, read at the next start; no file is a factory-new device."""
    path = tmp_path / "image"
    assert read_image(path) is None
    write_image(path, b"\1\2")
    write_image(path, b"\3")

    assert read_image(path) == b"\3"
    assert [file.name for file in tmp_path.iterdir()] == ["image"]


def test_storage_that_is_a_folder_is_told(tmp_path: Path) -> None:
    """A wrong path is our user's error, not a crash."""
    with pytest.raises(WireError, match="storage"):
        read_image(tmp_path)
