"""SDO abort codes that a conforming server may answer with, by the kind of request.

CiA 301 (4.2.0, 7.2.4.3.17) names a code for each mistake, and a general one; servers in the
field differ. The first code of each set is the one that says most; the others are accepted.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from hil_tests.decode_sdo import ABORTS

GENERAL = 0x0800_0000


@dataclass(frozen=True, slots=True)
class Accepted:
    """A set of abort codes; the first is the preferred one."""

    codes: Sequence[int]

    @property
    def preferred(self) -> int:
        """The code that says most."""
        return self.codes[0]

    def __contains__(self, code: object) -> bool:
        return code in self.codes

    def __str__(self) -> str:
        return " or ".join(f"{code:08X}h" for code in self.codes)


def show_code(code: int) -> str:
    """A code with its meaning."""
    return f"{code:08X}h ({ABORTS.get(code, 'unknown code')})"


READ_ONLY = Accepted((0x0601_0002, 0x0601_0000, GENERAL))
"""Write to ro or const."""
WRITE_ONLY = Accepted((0x0601_0001, 0x0601_0000, GENERAL))
"""Read of wo."""
NO_OBJECT = Accepted((0x0602_0000, GENERAL))
NO_SUB_INDEX = Accepted((0x0609_0011, GENERAL))
TOO_HIGH = Accepted((0x0609_0031, 0x0609_0030, GENERAL))
TOO_LOW = Accepted((0x0609_0032, 0x0609_0030, GENERAL))
TOO_LONG = Accepted((0x0607_0012, 0x0607_0010, GENERAL))
TOO_SHORT = Accepted((0x0607_0013, 0x0607_0010, GENERAL))
LENGTH = Accepted((0x0607_0010, 0x0607_0012, 0x0607_0013))
"""Declared and transferred size differ."""
INVALID_VALUE = Accepted((0x0609_0030,))
VALUE_OR_STATE = Accepted((0x0609_0030, 0x0601_0000, GENERAL, 0x0800_0022))
"""A setting of a PDO that is changed while the PDO is valid."""
HISTORY_COUNT = Accepted((0x0609_0030, 0x0609_0031, GENERAL))
"""1003h:00 written with anything but 0."""
HISTORY_EMPTY = Accepted((0x0800_0024, GENERAL, 0x0800_0020))
"""Read of 1003h:01 while the list is empty; 0800 0020h is what one stack in the field says."""
EMCY_ID = Accepted((0x0609_0030, 0x0609_0032, GENERAL))
DEVICE_STATE = Accepted((0x0800_0022, GENERAL))
"""1019h while a period is set."""
INCOMPATIBLE = Accepted((0x0604_0043,))
"""1016h: the node is watched already."""
TOGGLE = Accepted((0x0503_0000,))
COMMAND = Accepted((0x0504_0001, GENERAL))
NO_TRANSFER = Accepted((0x0504_0001, GENERAL, 0x0800_0021, 0x0503_0000))
"""A segment is asked for that belongs to no transfer."""
NO_SIZE = Accepted((0x0607_0010, 0x0607_0012))
"""A download that does not tell its size, where it is not taken."""
BLOCK_SIZE = Accepted((0x0504_0002, 0x0504_0001, GENERAL))
SEQUENCE = Accepted((0x0504_0003, 0x0504_0001, GENERAL))
CRC = Accepted((0x0504_0004,))
SIGNATURE = Accepted((0x0800_0020, 0x0800_0021, 0x0800_0022, 0x0800_0023, 0x0800_0024, GENERAL))
"""1010h or 1011h with a wrong signature."""
MAPPING_LOCKED = Accepted(
    (0x0601_0000, 0x0604_0041, GENERAL, 0x0800_0020, 0x0609_0030, 0x0800_0022)
)
"""A mapping entry or count that is written while the mapping is in use."""
MAPPING_LENGTH = Accepted((0x0604_0042, 0x0604_0041, 0x0602_0000, 0x0609_0030, 0x0609_0031))
"""Too many or too long objects in a PDO."""
NOT_MAPPABLE = Accepted((0x0604_0041, 0x0602_0000))
