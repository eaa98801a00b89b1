"""Frames for what a device has besides SDO: NMT, LSS, SYNC, TIME, PDOs, error control."""

from __future__ import annotations

from random import Random

from benchmarks.fuzz.known import NODE, OTHER_NODE, Known
from node_model.frame import Frame

LSS = 0x7E5


def nmt(rng: Random, known: Known) -> list[Frame]:
    """Commands to this node, to all, to others; starts are the most frequent."""
    del known
    command = rng.choice((1, 1, 1, 1, 1, 2, 0x80, 0x80, 0x81, 0x82, rng.getrandbits(8)))
    node = rng.choice((NODE, NODE, NODE, 0, OTHER_NODE, rng.getrandbits(8)))
    data = bytes((command, node)) + rng.randbytes(rng.choice((0, 0, 0, 0, 1, 6)))
    return [Frame(0, data[: rng.choice((8, 8, 8, 8, 8, 8, 1, 0))])]


def sync(rng: Random, known: Known) -> list[Frame]:
    """SYNCs, with counter or without."""
    del known
    can_id = rng.choice((0x80, 0x80, 0x80, 0x81))
    size = rng.choice((0, 0, 0, 1, 1, 2, 8))
    return [Frame(can_id, rng.randbytes(size)) for _ in range(rng.choice((1, 1, 3)))]


def time_stamp(rng: Random, known: Known) -> list[Frame]:
    """TIME."""
    del known
    return [
        Frame(rng.choice((0x100, 0x100, 0x101)), rng.randbytes(rng.choice((6, 6, 6, 5, 8, 0))))
    ]


def pdo(rng: Random, known: Known) -> list[Frame]:
    """Receive PDOs of any length, and remote frames for those that are sent."""
    del known
    if rng.random() < 0.2:
        can_id = 0x180 + 0x100 * rng.randrange(4) + NODE
        return [Frame(can_id, remote=True, dlc=rng.randrange(9))]
    can_id = rng.choice((0x200, 0x300, 0x400, 0x500, 0x180, 0x100)) + NODE
    return [Frame(can_id, rng.randbytes(rng.choice((8, 8, 6, 4, 2, 1, 0))))]


def error_control(rng: Random, known: Known) -> list[Frame]:
    """Polls of this node, heartbeats of others, and what is neither."""
    del known
    if rng.random() < 0.4:
        return [Frame(0x700 + NODE, remote=True, dlc=rng.choice((1, 1, 0, 8)))]
    node = rng.choice((1, 1, OTHER_NODE, NODE, 0x7F))
    state = rng.choice((0, 4, 5, 0x7F, 0x85, rng.getrandbits(8)))
    return [Frame(0x700 + node, bytes((state,)) * rng.choice((1, 1, 1, 1, 0, 2)))]


def _lss(*data: int) -> Frame:
    return Frame(LSS, bytes(data).ljust(8, b"\0"))


def lss(rng: Random, known: Known) -> list[Frame]:
    """One command of any kind, with values that may be right."""
    specifier = rng.choice((0x04, 0x11, 0x13, 0x15, 0x17, 0x4C, 0x51, 0x5A, 0x5E))
    specifier = specifier if rng.random() < 0.8 else rng.getrandbits(8)
    if specifier == 0x15:
        return [_lss(0x15, rng.choice((0, 1, 5, 50)), 0)]
    node = rng.choice((NODE, NODE, NODE, OTHER_NODE, 1, 0, 0xFF, 0x80))
    values = (node, rng.randrange(9), rng.getrandbits(8))
    if specifier == 0x51:
        part = rng.randrange(4)
        bit = rng.choice((0x80, 31, 0, rng.getrandbits(8)))
        number = known.identity[part] if rng.random() < 0.7 else rng.getrandbits(32)
        return [_lss(0x51, *number.to_bytes(4, "little"), bit, part, rng.randrange(5))]
    return [_lss(specifier, *(values if specifier == 0x11 else (0, *values[1:])))]


def lss_session(rng: Random, known: Known) -> list[Frame]:
    """Selected by its identity or with all, set up, perhaps stored, sent back to waiting."""
    if rng.random() < 0.5:
        frames = [_lss(0x04, 1)]
    else:
        frames = [
            _lss(0x40 + part, *number.to_bytes(4, "little"))
            for part, number in enumerate(known.identity)
        ]
    for _ in range(rng.randint(1, 4)):
        frames += lss(rng, known)
    frames.append(_lss(0x04, rng.choice((0, 0, 0, 1, 2))))
    return frames


def anything(rng: Random, known: Known) -> list[Frame]:
    """Any frame of any kind."""
    del known
    extended, remote = rng.random() < 0.1, rng.random() < 0.1
    can_id = rng.getrandbits(29 if extended else 11)
    if remote:
        return [Frame(can_id, remote=True, extended=extended, dlc=rng.randrange(9))]
    return [Frame(can_id, rng.randbytes(rng.randrange(9)), extended=extended)]
