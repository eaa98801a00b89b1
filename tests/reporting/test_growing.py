"""A file that grows: whole at every instant, cheap to add to, with or without hard links."""

from __future__ import annotations

import itertools
import json
import os
import signal
from collections.abc import Callable
from pathlib import Path
from typing import NoReturn

import pytest

from hil_tests.reporting.growing import GrowingFile

LONG = b"0123456789" * 10_000
"""Many pages of memory: a kill can end a write after any of them."""


def append_for_ever(path: Path) -> NoReturn:
    """Long items, one after the other: nearly all the time goes into writing."""
    file = GrowingFile(path, b"[0", b"]")
    for _ in itertools.count():
        file.append(b',"' + LONG + b'"', b"]")
    raise AssertionError


@pytest.mark.slow
def test_a_kill_in_the_middle_of_a_write_leaves_a_whole_file(tmp_path: Path) -> None:
    """A writer that does nothing else is killed forty times, wherever it stands."""
    for attempt in range(40):
        path = tmp_path / f"{attempt}.json"
        writer = os.fork()
        if not writer:
            append_for_ever(path)
        while not path.exists() or path.stat().st_size < attempt * 20_000:
            os.sched_yield()
        for _ in range(attempt * 37 % 400):
            os.sched_yield()
        os.kill(writer, signal.SIGKILL)
        os.waitpid(writer, 0)
        assert {0, LONG.decode()} >= set(json.loads(path.read_bytes()))


def filled(path: Path) -> bytes:
    """What a file holds after some items."""
    file = GrowingFile(path, b"[0", b"]")
    for number in range(1, 5):
        file.append(f",{number}".encode(), b"]" + b" " * (5 - number))
    file.close()
    return path.read_bytes()


def test_items_stand_between_head_and_the_last_tail(tmp_path: Path) -> None:
    """A shorter tail leaves no rest of a longer one, and nothing hidden stays behind."""
    assert filled(tmp_path / "a.json") == b"[0,1,2,3,4] "
    assert [path.name for path in tmp_path.iterdir()] == ["a.json"]


def test_without_hard_links_whole_copies_do(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Some file systems know one name for a file."""

    def refuse(*_: object) -> None:
        raise OSError(1, "Operation not permitted")

    monkeypatch.setattr(Path, "hardlink_to", refuse)
    assert filled(tmp_path / "a.json") == b"[0,1,2,3,4] "


def test_a_reader_that_came_before_keeps_what_it_opened(tmp_path: Path) -> None:
    """The next addition goes into the other copy."""
    file = GrowingFile(tmp_path / "a.json", b"[0", b"]")
    with (tmp_path / "a.json").open("rb") as before:
        file.append(b",1", b"]")
        assert before.read() == b"[0]"
    file.close()


@pytest.mark.parametrize("when", [lambda fails: fails == 0, lambda fails: fails == 1])
def test_what_could_not_be_written_comes_with_the_next_item(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, when: Callable[[int], bool]
) -> None:
    """Whichever of the two copies the full disk hits."""
    real, writes = os.pwrite, itertools.count()

    def full(descriptor: int, content: bytes, place: int) -> int:
        if when(next(writes)):
            raise OSError(28, "No space left on device")
        return real(descriptor, content, place)

    path = tmp_path / "a.json"
    file = GrowingFile(path, b"[0", b"]")
    monkeypatch.setattr(os, "pwrite", full)
    for number in (1, 2, 3):
        before = path.read_bytes()
        try:
            file.append(f",{number}".encode(), b"]")
        except OSError:
            assert path.read_bytes() == before
    file.close()
    assert path.read_bytes() == b"[0,1,2,3]"


def test_an_older_file_is_left_alone(tmp_path: Path) -> None:
    """It is another run's."""
    (tmp_path / "a.json").write_bytes(b"mine")
    with pytest.raises(FileExistsError):
        GrowingFile(tmp_path / "a.json", b"[", b"]")
    assert [path.name for path in tmp_path.iterdir()] == ["a.json"]
