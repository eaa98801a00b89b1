"""One entry of an object dictionary: an index and sub-index with a value."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from node_model.od.types import DataType


class Access(Enum):
    """Access types of CiA 306, with what SDO may do: the PDO directions are `pdo`'s affair."""

    readable: bool
    """SDO upload is allowed."""
    writable: bool
    """SDO download is allowed."""

    RO = "ro"
    WO = "wo"
    RW = "rw"
    RWR = "rwr"
    RWW = "rww"
    CONST = "const"

    def __init__(self, word: str) -> None:
        self.readable = word != "wo"
        self.writable = word not in {"ro", "const"}


@dataclass(slots=True)
class Entry:
    """A value of the dictionary, as raw little-endian bytes.

    Args:
        index: 0000h..FFFFh.
        sub: 0..255; 0 for a VAR.
        name: ParameterName of the EDS.
        data_type: how to read the bytes.
        access: what SDO may do.
        value: now.
        default: as the device leaves the factory; power-on takes it, or what was stored.
        low: least allowed number; None = the type's.
        high: greatest allowed number; None = the type's.
        pdo: it can be mapped into PDOs.
        most: bytes that a string or domain can hold; 0 = no limit of its own.
    """

    index: int
    sub: int
    name: str
    data_type: DataType
    access: Access
    value: bytes = b""
    default: bytes = b""
    low: float | None = None
    high: float | None = None
    pdo: bool = False
    most: int = 0
