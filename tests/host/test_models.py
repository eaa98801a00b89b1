"""Which node is hosted, and its memory on disk."""

from __future__ import annotations

from pathlib import Path

import pytest

from node_model.frame import Frame
from node_model.host.models import UnknownModelError, make_node, read_image, write_image
from node_model.host.wires import WireError


def test_keypad_is_made_with_another_node_id() -> None:
    """The command line overrides the factory's parameters."""
    node = make_node("keypad", None, 12, None)
    node.power_on(0)
    frames: list[Frame] = []
    while not frames:
        due = node.deadline()
        assert due is not None
        frames = list(node.advance(due))

    assert frames[0].can_id == 0x700 + 12


@pytest.mark.parametrize("node_id", [0, 16, 128, -1])
def test_impossible_node_id_is_refused(node_id: int) -> None:
    """The keypad can be commissioned to 1..15."""
    with pytest.raises(UnknownModelError, match=r"1\.\.15"):
        make_node("keypad", None, node_id, None)


def test_unknown_profile_is_refused() -> None:
    """Neither bundled nor a file."""
    with pytest.raises(UnknownModelError, match="'keypadd'"):
        make_node("keypadd", None, None, None)


def test_unusable_profile_is_refused(tmp_path: Path) -> None:
    """A file that is no profile."""
    path = tmp_path / "x.toml"
    path.write_text("[device]\n")

    with pytest.raises(UnknownModelError, match="not usable"):
        make_node(str(path), None, None, None)


def test_unknown_mutant_is_refused() -> None:
    """The message shows the name."""
    with pytest.raises(UnknownModelError, match="'no-such-fault'"):
        make_node("keypad", "no-such-fault", None, None)


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
