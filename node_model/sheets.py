"""Data sheets that devices are made from: each file is read once."""

from __future__ import annotations

from dataclasses import fields
from functools import lru_cache
from importlib import resources
from operator import attrgetter
from pathlib import Path
from typing import Any

from node_model.eds import Sheet, load_eds
from node_model.lss import NODE_IDS
from node_model.od import Entry


def shipped(name: str) -> str:
    """Path of a data sheet that comes with the package."""
    return str(resources.files("node_model.profiles") / name)


def located(name: str, folder: Path) -> str:
    """Path of a data sheet that a profile names: beside it, or one that is shipped."""
    beside = folder / name
    return str(beside) if beside.is_file() else shipped(name)


@lru_cache(maxsize=32)  # a bench makes a device for each scenario
def sheet_of(path: str) -> Sheet:
    """A data sheet.

    Raises:
        EdsError: it cannot be read.
    """
    return load_eds(path, checked=False)


_row_of = attrgetter(*(field.name for field in fields(Entry)))


@lru_cache(maxsize=2 * len(NODE_IDS))  # what follows from the node id is worked out once
def _rows(path: str, node_id: int) -> tuple[tuple[Any, ...], ...]:
    """What the objects of a device are made from."""
    return tuple(map(_row_of, sheet_of(path).entries(node_id)))


def entries_of(path: str, node_id: int) -> list[Entry]:
    """New objects of a device; one without a node id has those of the last."""
    known = node_id if node_id in NODE_IDS else NODE_IDS[-1]
    return [Entry(*row) for row in _rows(path, known)]
