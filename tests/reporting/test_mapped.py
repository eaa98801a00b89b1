"""A file that is written as memory: it grows, it is cut to its length, it can begin again."""

from __future__ import annotations

from pathlib import Path

import pytest

from hil_tests.reporting.mapped import MappedFile


@pytest.mark.parametrize("size", [0, 1, (1 << 16) - 1, 1 << 16, (1 << 16) + 1, 1_000_000])
def test_after_the_end_it_holds_what_was_written(tmp_path: Path, size: int) -> None:
    """At each border of its growth, in one piece and in two."""
    path = tmp_path / "file"
    content = bytes(range(256)) * (size // 256 + 1)
    content = content[:size]
    for cut in (0, size // 2):
        file = MappedFile(path)
        assert file.write(content[:cut]) + file.write(content[cut:]) == size
        file.close()
        file.close()
        assert path.read_bytes() == content


def test_before_the_end_the_rest_is_zeros(tmp_path: Path) -> None:
    """A reader sees what was written at once, and that nothing follows."""
    path = tmp_path / "file"
    file = MappedFile(path)
    file.write(b"frames")
    assert path.read_bytes().rstrip(b"\0") == b"frames"
    assert path.stat().st_size == 1 << 16
    file.close()


def test_begun_again_it_holds_nothing_of_before(tmp_path: Path) -> None:
    """What was longer leaves no tail."""
    path = tmp_path / "file"
    file = MappedFile(path)
    file.write(b"a long one")
    file.rewind()
    file.write(b"short")
    assert path.read_bytes().rstrip(b"\0") == b"short"
    file.close()
    file.rewind()
    assert path.read_bytes() == b"short"


def test_a_closed_file_takes_nothing(tmp_path: Path) -> None:
    """An error, and no write to memory that is gone."""
    file = MappedFile(tmp_path / "file")
    file.close()
    with pytest.raises(ValueError, match="closed"):
        file.write(b"x")


def test_a_file_that_cannot_grow_is_let_go(tmp_path: Path) -> None:
    """The error of the system comes through."""
    with pytest.raises(OSError, match="No such file"):
        MappedFile(tmp_path / "none" / "file")
    with pytest.raises(OSError, match="device"):
        MappedFile(Path("/dev/null"))
