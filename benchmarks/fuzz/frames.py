"""The frames of a life: bursts of a kind, damaged now and then, at any distance.

They follow from seed and number alone, never from what the device says: so a life can be
played again, and made smaller.
"""

from __future__ import annotations

from collections.abc import Callable
from random import Random
from typing import NamedTuple

from benchmarks.fuzz import sdo, services
from benchmarks.fuzz.known import Known
from node_model.frame import Frame
from node_model.node import MS, US


class Input(NamedTuple):
    """What happens next.

    Args:
        wait_ns: how long nothing comes before it.
        frame: then this comes.
    """

    wait_ns: int
    frame: Frame


Burst = Callable[[Random, Known], list[Frame]]

BURSTS: tuple[tuple[Burst, int], ...] = (
    (sdo.anything, 6),
    (sdo.commands, 6),
    (sdo.write, 14),
    (sdo.read, 6),
    (sdo.download, 7),
    (sdo.block_download, 7),
    (sdo.block_upload, 7),
    (sdo.abort, 2),
    (sdo.store, 3),
    (sdo.settings, 8),
    (sdo.mapping, 3),
    (services.nmt, 9),
    (services.sync, 8),
    (services.time_stamp, 3),
    (services.pdo, 10),
    (services.error_control, 8),
    (services.lss, 5),
    (services.lss_session, 3),
    (services.anything, 5),
)
"""Makers of frames, and how often each has its turn."""

_MAKERS = tuple(maker for maker, share in BURSTS for _ in range(share))
_INSIDE = (0, 0, 0, 100 * US, 100 * US, MS)
"""Waits between the frames of a burst."""
_BETWEEN = (0, 100 * US, MS, MS, 2 * MS, 5 * MS, 5 * MS, 19 * MS, 40 * MS)
_LONG = (120 * MS, 600 * MS, 1100 * MS)
_DAMAGED, _MIXED, _RARELY = 0.04, 0.1, 0.01


def life(seed: int, number: int, count: int, known: Known) -> list[Input]:
    """The inputs of one life.

    Args:
        seed: another one, other lives.
        number: of the life.
        count: how many frames.
        known: of the device.
    """
    rng = Random(f"{seed}/{number}")
    inputs: list[Input] = []
    while len(inputs) < count:
        frames = rng.choice(_MAKERS)(rng, known)
        if rng.random() < _MIXED:
            frames = _mixed(rng, frames, rng.choice(_MAKERS)(rng, known))
        wait = rng.choice(_LONG if rng.random() < _RARELY else _BETWEEN)
        for frame in frames:
            inputs.append(Input(wait, _damaged(rng, frame) if rng.random() < _DAMAGED else frame))
            wait = rng.choice(_INSIDE)
    return inputs[:count]


def _mixed(rng: Random, first: list[Frame], second: list[Frame]) -> list[Frame]:
    """Two bursts as one, each in its own order."""
    mixed, left, right = [], list(first), list(second)
    while left or right:
        source = left if left and (not right or rng.random() < 0.5) else right
        mixed.append(source.pop(0))
    return mixed


def _damaged(rng: Random, frame: Frame) -> Frame:
    """The same with another byte, length or kind."""
    data = bytearray(frame.data)
    kind = rng.randrange(4)
    if kind == 0 and data:
        data[rng.randrange(len(data))] = rng.getrandbits(8)
        return Frame(frame.can_id, bytes(data), extended=frame.extended)
    if kind == 1:
        return Frame(frame.can_id, bytes(data[: rng.randrange(9)]), extended=frame.extended)
    if kind == 2:
        return Frame(frame.can_id, remote=True, extended=frame.extended, dlc=len(data))
    return Frame(frame.can_id, bytes(data), extended=True)
