"""The files of a run, each with its size and SHA-256, so that a report can be checked."""

from __future__ import annotations

import hashlib
from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True, slots=True)
class Artefact:
    """One file of a run; `sha256` says why where it could not be read."""

    name: str
    size: int
    sha256: str


def artefacts_of(folder: Path, without: Collection[str] = ()) -> list[Artefact]:
    """Every file below the folder of a run, by name.

    Args:
        folder: of the run.
        without: names of files that are made from the others.
    """
    names = sorted(
        path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()
    )
    return [_artefact(folder, name) for name in names if name not in without and name[0] != "."]


def _artefact(folder: Path, name: str) -> Artefact:
    try:
        with (folder / name).open("rb") as file:
            digest = hashlib.file_digest(file, "sha256").hexdigest()
            return Artefact(name, file.tell(), digest)
    except OSError as error:
        return Artefact(name, 0, f"not readable: {error.strerror}")
