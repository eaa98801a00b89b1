"""Exploring for a given time on every core, with progress; what was found is made small.

A worker tells how far it is and what it found; nothing is shared but that. The same seed,
number of workers and model walk the same scenarios on every machine: how far a worker gets
depends on its speed, what it finds does not.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from queue import Empty
from typing import TYPE_CHECKING

from hil_tests.explore.lab import Finding, Lab
from hil_tests.explore.shrink import shrink
from hil_tests.explore.walks import walk
from hil_tests.scenarios.scenario import Scenario

if TYPE_CHECKING:
    from multiprocessing.queues import Queue

_TELL_EVERY_S = 0.5
_ALIKE = 3
"""Findings of one requirement that are told; further ones are counted."""


@dataclass(frozen=True, slots=True)
class Soak:
    """What to explore.

    Args:
        profile: name or file.
        model: mutant or variant; None = the right model.
        seed: of the walks.
        seconds: wall time.
        jobs: worker processes.
        families: walk these alone; none = all.
    """

    profile: str
    model: str | None
    seed: int
    seconds: float
    jobs: int
    families: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Progress:
    """How far one worker is."""

    worker: int
    played: int
    bus_ns: int
    frames: int


@dataclass(frozen=True, slots=True)
class Found:
    """A finding, made small, as text that another process can read.

    Args:
        number: of the walk.
        requirement: what is broken first.
        text: what is wrong.
        scenario: that shows it.
    """

    number: int
    requirement: str
    text: str
    scenario: str


Message = Progress | Found | None
"""None = a worker has ended."""


def cores() -> int:
    """How many processors this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def explored(lab: Lab, soak: Soak, worker: int, go_on: Callable[[], bool]) -> Iterator[Message]:
    """One worker's share: every `jobs`-th walk, as long as `go_on` says."""
    number = worker
    seen: dict[str, int] = {}
    while go_on():
        finding = lab.play(walk(soak.seed, number, soak.families))
        if finding is not None:
            requirement = finding.verdicts[0].requirement
            seen[requirement] = seen.get(requirement, 0) + 1
            if seen[requirement] <= _ALIKE:
                yield _small(lab, finding, number)
        number += soak.jobs
        yield Progress(worker, lab.played, lab.bench.bus_ns, lab.bench.frames)
    yield None


def _small(lab: Lab, finding: Finding, number: int) -> Found:
    """The finding, shrunk as long as the same requirement is broken first."""
    requirement = finding.verdicts[0].requirement

    def fails(story: Scenario) -> bool:
        again = lab.play(story)
        return again is not None and again.verdicts[0].requirement == requirement

    small = shrink(finding.scenario, fails)
    again = lab.play(small) or finding
    return Found(number, requirement, str(again.verdicts[0]), str(small))


def _work(soak: Soak, worker: int, tell: Queue[Message]) -> None:
    """A worker process; tells now and then, and whatever it finds at once."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # who started it ends it
    lab = Lab(soak.profile, soak.model)
    told_at = time.monotonic()
    ends_at = told_at + soak.seconds
    untold: Progress | None = None
    # However short the time or slow the machine, one scenario is played.
    for message in explored(
        lab, soak, worker, lambda: not lab.played or time.monotonic() < ends_at
    ):
        if isinstance(message, Progress) and time.monotonic() - told_at < _TELL_EVERY_S:
            untold = message
            continue
        if untold is not None:
            tell.put(untold)
        tell.put(message)
        untold, told_at = None, time.monotonic()


def run(soak: Soak, tell: Callable[[Progress | Found], None]) -> bool:
    """Explore with all workers; whether none of them was lost on the way.

    Args:
        soak: what to explore.
        tell: called with whatever a worker says.
    """
    # Spawned, not forked: nothing of this process but the arguments is in a worker.
    context = multiprocessing.get_context("spawn")
    queue: Queue[Message] = context.Queue()
    workers = [
        context.Process(target=_work, args=(soak, index, queue), daemon=True)
        for index in range(soak.jobs)
    ]
    for worker in workers:
        worker.start()
    try:
        ended = _listen(workers, queue, tell)
    finally:
        for worker in workers:
            worker.terminate()
            worker.join()
    return ended == soak.jobs


def _listen(
    workers: Sequence[multiprocessing.process.BaseProcess],
    queue: Queue[Message],
    tell: Callable[[Progress | Found], None],
) -> int:
    """Pass on what workers say; how many of them came to their end."""
    ended = 0
    while ended < len(workers):
        try:
            message = queue.get(timeout=_TELL_EVERY_S)
        except Empty:
            if not any(worker.is_alive() for worker in workers):
                break
            continue
        if message is None:
            ended += 1
        else:
            tell(message)
    return ended
