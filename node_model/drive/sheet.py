"""The objects of the shipped EDS files."""

from __future__ import annotations

from functools import cache
from importlib import resources

from node_model.eds import Sheet, parse_eds
from node_model.od import Entry


@cache
def _sheet(name: str) -> Sheet:
    data = (resources.files("node_model.profiles") / name).read_bytes()
    return parse_eds(name, data, checked=False)


def entries_of(name: str, node_id: int) -> list[Entry]:
    """The objects of a shipped EDS, new ones each time.

    Args:
        name: of the file.
        node_id: 1..127; 255 = none yet.
    """
    return _sheet(name).entries(node_id)
