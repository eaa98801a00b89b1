"""The host as a process of its own, on udp_multicast: what `python -m node_model` promises."""

from __future__ import annotations

import contextlib
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import can
import pytest

from hil_tests.bench.action import Action
from hil_tests.bench.drivers.control import (
    ControlHealth,
    ControlKeys,
    ControlPower,
    ControlSession,
)
from hil_tests.bus.pythoncan import PythonCanPort
from hil_tests.clock import MS, S
from hil_tests.trace import Sighting
from node_model.frame import Frame

GROUP = "239.74.163.2"
ROOT = Path(__file__).parents[2]


def free_channel() -> str:
    """A multicast channel that nobody else uses, or a skip."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("", 0))
        number = probe.getsockname()[1]
    try:
        with can.Bus(GROUP, interface="udp_multicast", port=number) as bus:
            bus.send(can.Message(arbitration_id=1))
            heard = bus.recv(0.2) is not None
    except (can.CanError, OSError):
        heard = False
    if not heard:
        pytest.skip("this machine delivers no multicast to itself")
    return f"{GROUP}:{number}"


@contextlib.contextmanager
def hosted(*arguments: str) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """A model in a process, and its ready line."""
    command = [sys.executable, "-m", "node_model", "--interface", "udp_multicast", *arguments]
    with subprocess.Popen(
        command, cwd=ROOT, text=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE
    ) as process:
        assert process.stdout is not None
        try:
            yield process, process.stdout.readline()
        finally:
            process.terminate()


@contextlib.contextmanager
def connected(address: str, port: PythonCanPort) -> Iterator[ControlSession]:
    """A control session that said hello."""
    with contextlib.closing(ControlSession(address, clock=port.now)) as session:
        session.connect()
        yield session


def pass_time(port: PythonCanPort, span_ns: int) -> None:
    """Let the bus run; whatever comes is of no interest."""
    until = port.now() + span_ns
    while port.next(until) is not None:
        pass


def finish(port: PythonCanPort, action: Action[Any]) -> Any:
    """Start an action and wait for it in the port's loop."""
    action.start(port.now())
    while not action.poll(port.now()):
        port.next(action.wake_at, action.descriptors)
    return action.result()


def first(port: PythonCanPort, frame: Frame) -> Sighting:
    """The next frame like this; others are passed over."""
    until = port.now() + 20 * S
    while (found := port.next(until)) is not None:
        if isinstance(found, Sighting) and found.frame == frame:
            return found
    pytest.fail(f"{frame} did not come")


@pytest.mark.slow
@pytest.mark.parametrize("stop", [signal.SIGTERM, signal.SIGINT])
def test_model_is_driven_over_tcp(stop: signal.Signals) -> None:
    """Ready line with the real port; off until power on; exact debounce; clean end."""
    channel = free_channel()
    with (
        contextlib.closing(PythonCanPort("udp_multicast", channel)) as port,
        hosted("--channel", channel, "--control", "tcp:127.0.0.1:0") as (process, ready),
        contextlib.ExitStack() as stack,
    ):
        assert ready.startswith("ready control=tcp:127.0.0.1:")
        assert ready.endswith(f" channel={channel}\n")
        session = stack.enter_context(connected(ready.split()[1].removeprefix("control="), port))
        on = finish(port, ControlPower(session).switch(True))
        boot = first(port, Frame(0x701, b"\0"))
        assert boot.at > on.latest
        port.send(Frame(0, b"\x01\x00"))
        first(port, Frame(0x701, b"\5"))
        edge = finish(port, ControlKeys(session).hold(frozenset({"aut"})))
        report = first(port, Frame(0x181, b"\2"))
        late = finish(port, ControlHealth(session).late())
        # Whatever the machine was busy with, the host says so.
        host_ns = max((sent - due for due, sent in late), default=0)
        assert 99 * MS <= report.at - edge.earliest <= 103 * MS + host_ns
        stack.close()
        process.send_signal(stop)

        assert process.wait() == 0
        assert process.stderr is not None
        assert process.stderr.read() == ""


@pytest.mark.slow
def test_model_without_control_is_powered_at_once() -> None:
    """By itself it is a device that somebody just plugged in."""
    channel = free_channel()
    with (
        contextlib.closing(PythonCanPort("udp_multicast", channel)) as port,
        hosted("--channel", channel, "--node-id", "9") as (_, ready),
    ):
        assert ready == f"ready control=- channel={channel}\n"
        first(port, Frame(0x709, b"\x7f"))


@pytest.mark.slow
def test_a_range_of_node_ids_is_as_many_nodes() -> None:
    """All start at once, and all obey."""
    channel = free_channel()
    with (
        contextlib.closing(PythonCanPort("udp_multicast", channel)) as port,
        hosted("--channel", channel, "--node-id", "7-9") as (_, ready),
    ):
        assert ready == f"ready control=- channel={channel}\n"
        for node_id in (7, 8, 9):
            first(port, Frame(0x700 + node_id, b"\x7f"))
        port.send(Frame(0, b"\1\0"))
        for node_id in (7, 8, 9):
            first(port, Frame(0x700 + node_id, b"\5"))


@pytest.mark.slow
def test_commissioned_parameters_survive_in_the_storage(tmp_path: Path) -> None:
    """Commissioned to node 7 over the bus, it is node 7 after a restart."""
    channel = free_channel()
    control = f"unix:{tmp_path}/control"
    options = ("--channel", channel, "--storage", f"{tmp_path}/image", "--control", control)
    record = bytes([7, 2, 3, 0xE8, 0, 1])
    with contextlib.closing(PythonCanPort("udp_multicast", channel)) as port:
        with hosted(*options), connected(control, port) as session:
            finish(port, ControlKeys(session).hold(frozenset({"on_off", "aut"})))
            finish(port, ControlPower(session).switch(True))
            pass_time(port, 200 * MS)
            port.send(Frame(0x4F8, record))
            first(port, Frame(0x3F8, record))
            pass_time(port, 600 * MS)
        with hosted(*options), connected(control, port) as session:
            finish(port, ControlPower(session).switch(True))
            first(port, Frame(0x707, b"\0"))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (["--channel", "x", "--eds", "y.eds"], "y.eds"),
        (["--channel", "x", "--profile", "nope"], "no profile 'nope'"),
        (["--channel", "x", "--mutant", "nope"], "'nope'"),
        (["--channel", "x", "--node-id", "200"], "1..15"),
        (["--channel", "x", "--node-id", "10-1"], "'10-1' is neither a node id nor a range"),
        (["--channel", "x", "--node-id", "ten"], "write e.g. 5, or 1-10"),
        (["--channel", "x", "--node-id", "1-16"], "node id 16 is none of a keypad"),
        (["--channel", "x", "--node-id", "1-2", "--control", "tcp:h:1"], "--control is for one"),
        (["--channel", "x", "--node-id", "1-2", "--storage", "f"], "--storage is for one node"),
        (["--channel", "239.74.163.2", "--control", "nowhere"], "tcp:HOST:PORT"),
        (["--channel", "no group"], "no group"),
    ],
)
def test_wrong_use_is_told(arguments: list[str], text: str) -> None:
    """Status 2 and one message, no traceback."""
    command = [sys.executable, "-m", "node_model", "--interface", "udp_multicast", *arguments]
    done = subprocess.run(command, cwd=ROOT, text=True, capture_output=True, check=False)

    assert done.returncode == 2
    assert text in done.stderr
    assert "Traceback" not in done.stderr
    assert done.stdout == ""
