"""Which contacts the mask of a scenario's step "keys" closes, on a keypad of any profile."""

from __future__ import annotations

from functools import lru_cache

from hil_tests.api import KeypadBench


def order_of(bench: KeypadBench) -> tuple[str, ...]:
    """The keys in the order of the bits of a scenario's mask.

    Bits 0 and 1 are the commissioning keys, in the order of their bits in the key frame;
    further ones count from the last of the others.
    """
    names = bench.keys.names if bench.keys else ()
    special = bench.profile.commissioning_keys
    others = [name for name in names if name not in special]
    return (*(name for name in names if name in special), *reversed(others))


@lru_cache(maxsize=1024)
def held_by(order: tuple[str, ...], mask: int) -> frozenset[str]:
    """The keys of a scenario's mask."""
    return frozenset(name for index, name in enumerate(order) if mask >> index & 1)
