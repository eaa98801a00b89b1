"""Data sheets that devices are made from: each file is read once."""

from __future__ import annotations

from functools import lru_cache
from importlib import resources
from pathlib import Path

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


def entries_of(path: str, node_id: int) -> list[Entry]:
    """New objects of a device; one without a node id has those of the last."""
    return sheet_of(path).entries(node_id if node_id in NODE_IDS else NODE_IDS[-1])
