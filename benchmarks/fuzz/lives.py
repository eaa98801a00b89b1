"""A life: power, frames, in between requests that must be served, power again."""

from __future__ import annotations

import traceback
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from benchmarks.fuzz.frames import Input, life
from benchmarks.fuzz.known import NODE, known_of
from benchmarks.fuzz.lines import Direct, Line, OnWire, Spent
from benchmarks.fuzz.sdo import expedited
from benchmarks.fuzz.watched import PRODUCER_TIME, Finding, Watched
from node_model.device import Cia301Device
from node_model.frame import Frame
from node_model.lss import NO_NODE_ID
from node_model.nmt import NmtState
from node_model.node import MS

FRAMES = 1000
"""Of a life."""
PROBE_EVERY = 100
BEAT_MS = 20
MOST_CALLS = 100
"""A frame's share of calls of the device. A producer of a SYNC each microsecond, as the
frames may have set it up, would need millions: such a life ends early."""
_TRIES = 3
_PATIENCE = 100_000
"""Deadlines after which a device that is silent is taken to be so for ever."""


@dataclass(frozen=True, slots=True)
class Lived:
    """What came of a life.

    Args:
        frames: how many it was told.
        probes: how many requests were served.
        spent: it ended early.
        finding: what is wrong, or None.
        at: number of the frame at which that was seen.
    """

    frames: int
    probes: int
    spent: bool = False
    finding: str | None = None
    at: int = 0


Maker = Callable[[], Cia301Device]


def inputs_of(seed: int, number: int, make: Maker, count: int = FRAMES) -> list[Input]:
    """The inputs of a life of such a device."""
    return life(seed, number, count, known_of(make()))


def play(make: Maker, inputs: Sequence[Input], wired: bool = False) -> Lived:
    """Live through these inputs.

    Args:
        make: the device.
        inputs: what it is told.
        wired: over a bus with bit times.
    """
    watched = Watched(make())
    line: Line = OnWire(watched) if wired else Direct(watched)
    told = probes = 0
    try:
        line.power(True)
        line.wait(100 * MS)
        probe(line)
        for told, (wait_ns, frame) in enumerate(inputs, 1):
            line.wait(wait_ns)
            line.send(frame)
            if not told % PROBE_EVERY:
                probe(line)
                probes += 1
                watched.said.clear()
            if watched.calls > MOST_CALLS * (told + FRAMES):
                raise Spent
        probe(line)
        line.power(False)
        line.wait(100 * MS)
        line.power(True)
        line.wait(100 * MS)
        probe(line)
        line.close()
    except Spent:
        return Lived(told, probes, spent=True)
    except Exception as error:  # noqa: BLE001 - whatever a device raises is a finding
        return Lived(told, probes, finding=_text(error), at=told)
    return Lived(told, probes + 2)


def _text(error: Exception) -> str:
    if isinstance(error, Finding):
        return str(error)
    last = traceback.extract_tb(error.__traceback__)[-1]
    place = f"{Path(last.filename).name}:{last.lineno}"
    return f"{type(error).__name__} in {place}: {error}"


# Requests that must be served.


def probe(line: Line) -> None:
    """Whatever was before: it can be brought to answer, and to work.

    Raises:
        Finding: a valid request is not served.
    """
    for again in range(_TRIES):
        mark = len(line.watched.said)
        try:
            _ask(line)
        except Finding:
            if again + 1 == _TRIES or not _has_erred(line, mark):
                raise
        else:
            return


def _has_erred(line: Line, mark: int) -> bool:
    """An error came meanwhile, and stopped it, as 1029h may ask for."""
    watched = line.watched
    told = any(0x80 < f.can_id < 0x100 and len(f.data) == 8 for _, f in watched.said[mark:])
    stopped = watched.device.state is watched.reaction() is NmtState.STOPPED
    return stopped and (told or watched.is_quiet_about_errors())


def _ask(line: Line) -> None:
    line.settle()
    _await_start(line)
    if line.watched.device.node_id == NO_NODE_ID:
        _configure(line)
    node_id = line.watched.device.node_id
    # A client gives up what is under way; pre-operational, where SDO is served.
    line.send(Frame(0, bytes((0x80, node_id))))
    line.send(Frame(0x600 + node_id, b"\x80" + bytes(7)))
    line.settle()
    vendor = line.watched.device.identity()[0].to_bytes(4, "little")
    upload = b"\x40\x18\x10\x01\0\0\0\0"
    _served(line, 0x600 + node_id, upload, 0x580 + node_id, b"\x43\x18\x10\x01" + vendor)
    beat = expedited(PRODUCER_TIME, 0, BEAT_MS, 2).data
    _served(line, 0x600 + node_id, beat, 0x580 + node_id, b"\x60\x17\x10\0\0\0\0\0")
    line.send(Frame(0, bytes((1, node_id))))
    line.settle()


def _await_start(line: Line) -> None:
    """It may initialise, or be silent as LSS asked it to."""
    watched = line.watched
    for _ in range(_PATIENCE):
        if watched.bit_rate and (watched.device.state is not NmtState.INITIALISING or _bare(line)):
            return
        due = watched.deadline()
        if due is None:
            raise Finding("it is silent for ever")
        line.wait(max(due - line.now, 0))
    raise Spent


def _bare(line: Line) -> bool:
    return line.watched.device.node_id == NO_NODE_ID


def _served(line: Line, request_id: int, data: bytes, answer_id: int, answer: bytes) -> None:
    mark = len(line.watched.said)
    line.send(Frame(request_id, data))
    line.settle()
    answers = [f.data for _, f in line.watched.said[mark:] if f.can_id == answer_id]
    if answers != [answer]:
        told = ", ".join(each.hex() for each in answers) or "nothing"
        raise Finding(f"{request_id:03X}#{data.hex()} is answered with {told}, not {answer.hex()}")


def _configure(line: Line) -> None:
    """A device without a node id takes one from LSS, and starts."""
    line.send(Frame(0x7E5, b"\x04".ljust(8, b"\0")))
    line.settle()
    _await_start(line)
    if line.watched.device.node_id != NO_NODE_ID:
        return  # one was pending
    line.send(Frame(0x7E5, b"\x04\x01".ljust(8, b"\0")))
    request = bytes((0x11, NODE)).ljust(8, b"\0")
    _served(line, 0x7E5, request, 0x7E4, b"\x11".ljust(8, b"\0"))
    line.send(Frame(0x7E5, b"\x04".ljust(8, b"\0")))
    line.settle()
    _await_start(line)
    if line.watched.device.node_id != NODE:
        raise Finding(f"LSS gave it node id {NODE}; it has {line.watched.device.node_id}")
