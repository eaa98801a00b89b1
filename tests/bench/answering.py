"""A bench of a node 5 with an object dictionary, whose device says what a script says."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import attrs
import pytest

from hil_tests.bench.cia301 import Cia301Bench
from hil_tests.clock import MS
from hil_tests.config import Cia301Profile, load_profile
from hil_tests.judge.verdict import DeviceFailure, Verdict
from node_model.frame import Frame
from tests.bench.fakes import ECHO_NS, FakePort, FakeStage

Says = tuple[int, str]
"""How long after a request is over, ns, and the frame as text: "585#4F..."."""
Script = Callable[[Frame], Sequence[Says]]

SOON = 1 * MS


class AnsweringPort(FakePort):
    """Plays what the script says to each frame that is sent."""

    def __init__(self, script: Script) -> None:
        super().__init__()
        self._script = script

    def send(self, frame: Frame) -> None:
        """As `FakePort`; the answers follow."""
        super().send(frame)
        for after_ns, text in self._script(frame):
            self.plays(text, self.at + ECHO_NS + after_ns)


def bench_with(script: Script) -> tuple[Cia301Bench, AnsweringPort]:
    """Node 5, which sends no heartbeat."""
    profile = load_profile("drive")
    assert isinstance(profile, Cia301Profile)
    port = AnsweringPort(script)
    home = attrs.evolve(profile.factory, heartbeat_ms=0)
    bench = Cia301Bench(FakeStage(port), profile, home)
    bench.begin()
    return bench, port


def in_turn(*answers: str, after_ns: int = SOON) -> Script:
    """One answer to each request; "" = none."""
    left: Iterator[str] = iter(answers)

    def script(_: Frame) -> Sequence[Says]:
        answer = next(left, "")
        return [(after_ns, answer)] if answer else []

    return script


def blamed(act: Callable[[], object]) -> Verdict:
    """The verdict with which this ends."""
    with pytest.raises(DeviceFailure) as caught:
        act()
    return caught.value.verdict
