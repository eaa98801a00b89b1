"""The memory of a hosted node on disk."""

from __future__ import annotations

from pathlib import Path

import pytest

from node_model.host.memory import Keeper, read_image, write_image
from node_model.host.wires import WireError
from tests.host.fakes import FakePanel


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


class Notebook(FakePanel):
    """A node with a memory."""

    content = b"factory"

    def image(self) -> bytes:
        """What is in it."""
        return self.content


def test_memory_is_written_when_it_has_changed(tmp_path: Path) -> None:
    """Not before, and not again."""
    path = tmp_path / "image"
    node = Notebook()
    keeper = Keeper(node, path)
    keeper.keep()
    assert not path.exists()
    node.content = b"mine"
    keeper.keep()
    assert read_image(path) == b"mine"
    path.unlink()
    keeper.keep()
    assert not path.exists()
