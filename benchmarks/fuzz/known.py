"""What the makers of frames know of a device: where it can be spoken to."""

from __future__ import annotations

from dataclasses import dataclass
from random import Random

from node_model.device import Cia301Device

NODE = 5
OTHER_NODE = 6
NUMBERS = (
    *(0, 1, 2, 3, 5, 20, 0x7F, 0x80, 0xFE, 0xFF, 0x100, 0x205, 0x385, 0x585, 0x605, 0x705),
    *(0x8000, 0xFFFF, 0x1_0000, 0x01_0032, 0x02_0014, 0x10_0000, 0x3F00_0000, 0x4000_0080),
    *(0x6040_0010, 0x607A_0020, 0x7FFF_FFFF, 0x8000_0000, 0x8000_0205, 0xC000_0185, 0xFFFF_FFFF),
)
"""Values at which something changes: limits, COB-IDs with their upper bits, mapped objects."""

Place = tuple[int, int, int]
"""Index, sub-index, and bytes of its value; 0 = any number."""


@dataclass(frozen=True, slots=True)
class Known:
    """A device from outside.

    Args:
        places: all of its objects.
        mapped: those that a PDO can carry, as they stand in a mapping.
        identity: the four parts of 1018h.
        wide: those objects whose value can have more than four bytes.
    """

    places: tuple[Place, ...]
    mapped: tuple[int, ...]
    identity: tuple[int, int, int, int]
    wide: tuple[Place, ...] = ()

    def long(self, rng: Random) -> Place:
        """One for transfers of several segments, where it has such."""
        if self.wide and rng.random() < 0.6:
            return rng.choice(self.wide)
        return self.place(rng)

    def place(self, rng: Random) -> Place:
        """One of its objects; now and then one next to it."""
        index, sub, size = rng.choice(self.places)
        return (index, sub + 1 & 0xFF, size) if rng.random() < 0.05 else (index, sub, size)


def known_of(device: Cia301Device) -> Known:
    """What there is to know of a device that has just been made."""
    entries = device.od.entries.values()
    places = [(each.index, each.sub, each.data_type.size) for each in entries]
    return Known(
        tuple(places),
        tuple(
            each.index << 16 | each.sub << 8 | 8 * each.data_type.size
            for each in entries
            if each.pdo
        ),
        device.identity(),
        tuple(place for place in places if not 1 <= place[2] <= 4),
    )


def number(rng: Random) -> int:
    """A number of up to 32 bits, rather a telling one."""
    pick = rng.random()
    if pick < 0.6:
        return rng.choice(NUMBERS)
    return rng.getrandbits(32) if pick < 0.8 else rng.getrandbits(8)
