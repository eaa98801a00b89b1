"""Checks of the hosted model on a real vcan0; run by `guest_checks`."""

from __future__ import annotations

import contextlib
import os
import select
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from itertools import pairwise

from hil_tests.bench.drivers.control import (
    ControlBitRate,
    ControlHealth,
    ControlKeys,
    ControlLeds,
    ControlPower,
    ControlSession,
)
from hil_tests.bus.socketcan import SocketCanPort
from hil_tests.clock import MS, S
from hil_tests.trace import Sighting
from node_model.frame import Frame
from tests.bus.guest_bus import CHANNEL, finish, next_frame, port, run_ip

LEDS = ("on_off", "aut", "k3", "k4", "k5", "k6", "k7", "k8")


class Hosted:
    """A model in a process of its own, with its control session."""

    def __init__(self, opened: SocketCanPort, folder: str) -> None:
        self.port = opened
        self.process = subprocess.Popen(
            [sys.executable, "-m", "node_model", "--channel", CHANNEL, "--storage",
             f"{folder}/image", "--control", f"unix:{folder}/control"],
            stdout=subprocess.PIPE,
            text=True,
        )  # fmt: skip
        assert self.process.stdout is not None
        self.ready = self.process.stdout.readline()
        self.session = ControlSession(f"unix:{folder}/control", clock=opened.now)
        self.session.connect()
        self.power = ControlPower(self.session)
        self.keys = ControlKeys(self.session)
        self.leds = ControlLeds(self.session, LEDS)
        self.bus = ControlBitRate(self.session)
        self.health = ControlHealth(self.session)

    def seen(self, span_ns: int) -> list[Sighting]:
        """All frames in a span."""
        until = self.port.now() + span_ns
        found = []
        while (item := self.port.next(until)) is not None:
            assert isinstance(item, Sighting), item
            found.append(item)
        return found

    def stop(self) -> int:
        """End it; returns its exit status."""
        self.session.close()
        self.process.terminate()
        return self.process.wait()


@contextlib.contextmanager
def hosted() -> Iterator[Hosted]:
    """A model under test, warmed up."""
    with port() as opened, tempfile.TemporaryDirectory() as folder:
        node = Hosted(opened, folder)
        try:
            finish(opened, node.power.switch(True))
            node.seen(300 * MS)
            finish(opened, node.power.switch(False))
            finish(opened, node.health.late())
            node.seen(50 * MS)
            yield node
        finally:
            status = node.stop()
        assert status == 0, status


def check_hosted_model() -> str:
    """Boot-up, heartbeat, key frames and NMT of the model over vcan0, measured."""
    with hosted() as node:
        opened = node.port
        assert node.ready.startswith("ready control=unix:"), node.ready
        assert node.session.same_clock
        on = finish(opened, node.power.switch(True))
        assert on.doubt_ns < 5 * MS, on
        frames = node.seen(5 * S)
        boot = frames[0]
        assert boot.frame == Frame(0x701, b"\0"), frames[:3]
        beats = [item.at for item in frames if item.frame == Frame(0x701, b"\x7f")]
        gaps = [later - earlier for earlier, later in pairwise(beats)]
        opened.send(Frame(0, b"\x01\x00"))
        edge = finish(opened, node.keys.hold(frozenset({"aut"})))
        keys = [item for item in node.seen(300 * MS) if item.frame.can_id == 0x181]
        assert [item.frame.data for item in keys] == [b"\x02"], keys
        debounce = keys[0].at - edge.earliest
        steps = finish(
            opened,
            node.keys.sequence(
                [(0, frozenset()), (4 * MS, frozenset({"aut"})), (9 * MS, frozenset())]
            ),
        )
        assert [step.earliest - steps[0].earliest for step in steps] == [0, 4 * MS, 9 * MS]
        late = finish(opened, node.health.late())
        node.seen(300 * MS)
        opened.send(Frame(0x201, b"\x01"))
        opened.send(Frame(0x301, b"\x02"))
        node.seen(20 * MS)
        lights = finish(opened, node.leds.read())
        assert lights["on_off"] == "on", lights
        assert lights["aut"] == "blink", lights
        assert lights["k3"] == "off", lights
        edges = finish(opened, node.leds.watch(2 * S))
        assert [name for _, name, _ in edges.edges] == ["aut"] * len(edges.edges), edges
        assert len(edges.edges) == 4, edges
        finish(opened, node.bus.set(500_000))
        assert not node.seen(3 * S)
        worst = max(abs(gap - S) for gap in gaps)
        return (
            f"boot-up {(boot.at - on.latest) / 1e6:.3f} ms after power, heartbeat off by at "
            f"most {worst / 1e6:.3f} ms, debounce {debounce / 1e6:.3f} ms, late {len(late)}: "
            f"{[(sent - due) / 1e6 for due, sent in late][:5]}"
        )


def check_stopped_host() -> str:
    """A host that is stopped for 3.3 s sends late, says so, and keeps its schedule."""
    with hosted() as node:
        opened = node.port
        finish(opened, node.power.switch(True))
        node.seen(2500 * MS)
        finish(opened, node.health.late())
        os.kill(node.process.pid, signal.SIGSTOP)
        before = node.seen(3300 * MS)
        assert not before, before
        opened.send(Frame(0, b"\x01\x00"))
        node.seen(10 * MS)
        os.kill(node.process.pid, signal.SIGCONT)
        burst = [item for item in node.seen(200 * MS) if not item.own]
        after = [item for item in node.seen(3 * S) if not item.own]
        late = finish(opened, node.health.late())
        states = [item.frame.data for item in burst]
        assert states[:3] == [b"\x7f"] * 3, states
        assert len(late) >= 3, late
        dues = [due for due, _ in late]
        assert dues[1] - dues[0] == S, dues
        assert dues[2] - dues[1] == S, dues
        phases = [(item.at - dues[0]) % S for item in after if item.frame == Frame(0x701, b"\5")]
        assert phases, after
        return (
            f"{len(late)} late, by {[round((sent - due) / 1e6) for due, sent in late]} ms; "
            f"afterwards {[round(phase / 1e6, 3) for phase in phases]} ms off the schedule"
        )


def check_model_survives_an_unplugged_bus() -> str:
    """A device does not die because its bus is gone for a while; nor does its host."""
    with tempfile.TemporaryDirectory() as folder:
        with port() as opened:
            node = Hosted(opened, folder)
            finish(opened, node.power.switch(True))
            node.seen(200 * MS)
        run_ip("link", "set", CHANNEL, "down")
        finish_without_bus(node, 2500 * MS)
        run_ip("link", "set", CHANNEL, "up")
        with port() as opened:
            node.port = opened
            beats = node.seen(3 * S)
            assert [item.frame for item in beats] == [Frame(0x701, b"\x7f")] * 3, beats
            assert node.stop() == 0
    return "ok"


def finish_without_bus(node: Hosted, span_ns: int) -> None:
    """Let time pass with the control session alone."""
    select.select([], [], [], span_ns / S)
    node.session.ask({"do": "state"})


def check_many_answers_are_quick() -> str:
    """From an NMT reset to the boot-up, fifty times: what the host adds."""
    with hosted() as node:
        opened = node.port
        finish(opened, node.power.switch(True))
        node.seen(300 * MS)
        spans = []
        for _ in range(50):
            opened.send(Frame(0, b"\x82\x00"))
            own = next_frame(opened)
            boot = next_frame(opened)
            assert boot.frame == Frame(0x701, b"\0"), boot
            spans.append(boot.at - own.at)
            node.seen(30 * MS)
        spans.sort()
        late = finish(opened, node.health.late())
        return (
            f"reset to boot-up {spans[0] / 1e6:.3f} .. {spans[25] / 1e6:.3f} .. "
            f"{spans[-1] / 1e6:.3f} ms (model: 10), {len(late)} late"
        )
