"""Checks of the SocketCAN port and the host on a real vcan0; run by test_guest.py.

A plain script, because importing pytest is dear in the virtual machine: each function
whose name begins with check_ is called; one line a check goes to standard output.
"""

from __future__ import annotations

import contextlib
import os
import select
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import time
import traceback
from collections.abc import Callable, Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

from hil_tests.bench.action import Action
from hil_tests.bench.drivers.control import (
    ControlBitRate,
    ControlHealth,
    ControlKeys,
    ControlLeds,
    ControlPower,
    ControlSession,
)
from hil_tests.bus import link
from hil_tests.bus.choose import open_port
from hil_tests.bus.socketcan import SocketCanPort
from hil_tests.clock import MS, S
from hil_tests.errors import BusUnavailable
from hil_tests.trace import BusEvent, EventKind, Sighting
from node_model.frame import Frame

CHANNEL = "vcan0"
LEDS = ("on_off", "aut", "k3", "k4", "k5", "k6", "k7", "k8")


@contextlib.contextmanager
def port() -> Iterator[SocketCanPort]:
    """The tester's port."""
    with contextlib.closing(open_port("socketcan", CHANNEL)) as opened:
        assert isinstance(opened, SocketCanPort)
        yield opened


@contextlib.contextmanager
def stranger(fd_frames: bool = False) -> Iterator[socket.socket]:
    """Another socket on the same interface."""
    with socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW) as other:
        if fd_frames:
            other.setsockopt(socket.SOL_CAN_RAW, socket.CAN_RAW_FD_FRAMES, 1)
        other.bind((CHANNEL,))
        yield other


def classical(can_id: int, data: bytes) -> bytes:
    """struct can_frame, written independently of the code under test."""
    return struct.pack("=IB3x8s", can_id, len(data), data)


def next_frame(opened: SocketCanPort, span_ns: int = S) -> Sighting:
    """The next frame; nothing else may come."""
    found = opened.next(opened.now() + span_ns)
    assert isinstance(found, Sighting), found
    return found


def finish(opened: SocketCanPort, action: Action[Any]) -> Any:
    """Start an action and wait for it in the port's loop."""
    action.start(opened.now())
    while not action.poll(opened.now()):
        opened.next(action.wake_at, action.descriptors)
    return action.result()


def run_ip(*arguments: str) -> None:
    """Change the interface."""
    subprocess.run(["ip", *arguments], check=True)


def check_own_frames_and_stamps() -> str:
    """Own frames alone are own; every stamp lies inside the sender's system call."""
    worst = 0
    with port() as opened, stranger() as other:
        assert not opened.timed
        for number in range(20):
            began = time.time_ns()
            opened.send(Frame(0x123, bytes([number])))
            ended = time.time_ns()
            seen = next_frame(opened)
            assert seen.own
            assert seen.frame == Frame(0x123, bytes([number]))
            assert began <= seen.at <= ended, (began, seen.at, ended)
            other.send(classical(0x123, bytes([number])))
            assert not next_frame(opened).own
            worst = max(worst, ended - began)
    return f"send takes up to {worst / 1000:.0f} us"


def check_every_kind_of_frame() -> str:
    """Remote, extended and long-DLC frames survive the way; FD and error frames are events."""
    frames = [
        Frame(0x7FF, b"12345678"),
        Frame(0x1FFFFFFF, b"", extended=True),
        Frame(0x701, remote=True, dlc=1),
        Frame(0x123, bytes(8), dlc=12),
        Frame(0, b"\x01\x00"),
    ]
    with port() as opened, stranger(fd_frames=True) as other:
        for frame in frames:
            opened.send(frame)
            assert next_frame(opened).frame == frame, frame
        other.send(struct.pack("=IBB2x64s", 0x234, 12, 0, bytes(64)))
        event = opened.next(opened.now() + S)
        assert isinstance(event, BusEvent), event
        assert event.kind is EventKind.FD_FRAME
        assert "234h, 12 bytes" in event.text
        kinds = []
        for word, data in ((0x40, bytes(8)), (4, b"\0\1" + bytes(6)), (8, bytes(8))):
            other.send(classical(0x20000000 | word, data))
            event = opened.next(opened.now() + S)
            assert isinstance(event, BusEvent), event
            kinds.append(event.kind)
        assert kinds == [EventKind.BUS_OFF, EventKind.OVERFLOW, EventKind.ERROR], kinds
    return "ok"


def check_waiting() -> str:
    """`next` ends at its instant, at a descriptor, or with what is there already."""
    with port() as opened, stranger() as other:
        began = opened.now()
        assert opened.next(began + 50 * MS) is None
        late = opened.now() - began - 50 * MS
        assert late >= 0
        reader, writer = os.pipe()
        os.write(writer, b"x")
        assert opened.next(opened.now() + 10 * S, [reader]) is None
        assert opened.now() - began < 5 * S
        other.send(classical(1, b""))
        assert opened.next(0) is not None
        assert opened.next(0) is None
        os.close(reader)
        os.close(writer)
    return f"wakes {late / 1000:.0f} us late"


def check_lost_frames_are_told() -> str:
    """What the kernel dropped is counted and stands where it is missing."""
    sent = 3000
    with port() as opened, stranger() as other:
        opened._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        for number in range(sent):
            other.send(classical(0x100, struct.pack("<H", number)))
        seen = [opened.next(0)]
        while seen[-1] is not None:
            seen.append(opened.next(0))
        other.send(classical(0x101, b""))
        gap, last = opened.next(opened.now() + S), opened.next(opened.now() + S)
        assert isinstance(gap, BusEvent), gap
        assert gap.kind is EventKind.GAP
        assert isinstance(last, Sighting)
        assert last.frame.can_id == 0x101
        assert len(seen) - 1 + gap.lost == sent, (len(seen), gap)
    return f"{gap.lost} of {sent} lost and told"


def check_nothing_is_lost_by_default() -> str:
    """A reader that sleeps through 20 000 frames still gets them all."""
    sent = 20_000
    with port() as opened, stranger() as other:
        raw = classical(0x100, b"12345678")
        for _ in range(sent):
            other.send(raw)
        began = time.time_ns()
        count = 0
        while (found := opened.next(0)) is not None:
            assert isinstance(found, Sighting), found
            count += 1
        assert count == sent, count
    return f"read in {(time.time_ns() - began) / sent / 1000:.1f} us a frame"


def check_channel_is_locked() -> str:
    """The second tester is refused and told who is there."""
    with port():
        try:
            open_port("socketcan", CHANNEL)
        except BusUnavailable as error:
            assert f"pid {os.getpid()}" in str(error), error
        else:
            raise AssertionError("not refused")
    with port():
        return "ok"


def check_interface_that_is_missing_or_down() -> str:
    """The remedy is named; an interface that goes down is an event, then an error."""
    for channel, text in (("vcan7", "ip link add dev vcan7 type vcan"), ("lo", "lo")):
        try:
            open_port("socketcan", channel)
        except BusUnavailable as error:
            assert text in str(error), error
        else:
            raise AssertionError(channel)
    with port() as opened, stranger() as other:
        other.send(classical(0x55, b""))
        run_ip("link", "set", CHANNEL, "down")
        try:
            assert next_frame(opened).frame.can_id == 0x55
            event = opened.next(opened.now() + S)
            assert isinstance(event, BusEvent), event
            assert event.kind is EventKind.DOWN
            verbs: list[Callable[[], object]] = [
                lambda: opened.next(0),
                lambda: opened.send(Frame(1)),
            ]
            for verb in verbs:
                try:
                    verb()
                except BusUnavailable as error:
                    assert f"ip link set {CHANNEL} up" in str(error), error
                else:
                    raise AssertionError("not told")
            opened.close()
            try:
                open_port("socketcan", CHANNEL)
            except BusUnavailable as error:
                assert "is down" in str(error), error
            else:
                raise AssertionError("opened")
        finally:
            run_ip("link", "set", CHANNEL, "up")
    return "ok"


def check_setting_the_bit_rate_leaves_no_error_behind() -> str:
    """Our own taking down of the interface is not taken for a fault."""

    class Flap(link.BitRate):
        """Takes the interface down and up, as a change of bit rate does."""

        def ensure(self, bit_rate: int) -> None:  # noqa: ARG002 - vcan has none
            run_ip("link", "set", CHANNEL, "down")
            run_ip("link", "set", CHANNEL, "up")

    with port() as opened, stranger() as other:
        opened._rate = Flap(CHANNEL)
        opened.set_bit_rate(250_000)
        with contextlib.suppress(OSError):
            other.getsockopt(socket.SOL_SOCKET, socket.SO_ERROR)
        opened.send(Frame(5))
        assert next_frame(opened).own
        other.send(classical(6, b""))
        assert next_frame(opened).frame == Frame(6)
    return "ok"


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


def say(text: str) -> None:
    """One line, at once: the machine may die later."""
    sys.stdout.write(text + "\n")
    sys.stdout.flush()


def main() -> int:
    """Run all checks; 0 if none failed."""
    checks: list[Callable[[], str]] = [
        value for name, value in globals().items() if name.startswith("check_")
    ]
    wanted = sys.argv[1:]
    failed = 0
    for check in checks:
        if wanted and not any(word in check.__name__ for word in wanted):
            continue
        try:
            say(f"ok   {check.__name__}: {check()}")
        except Exception:  # noqa: BLE001 - a check may fail in any way
            failed += 1
            say(f"FAIL {check.__name__}\n{traceback.format_exc()}")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).parents[2]))
    sys.exit(main())
