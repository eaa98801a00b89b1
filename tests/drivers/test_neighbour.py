"""A simulated device on this machine: who answers there, and how late it was."""

from __future__ import annotations

import os
import select
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import TypeVar

import pytest

from hil_tests.bench.action import Action
from hil_tests.bench.drivers.neighbour import NeighbourHealth, processes_behind
from hil_tests.clock import S
from hil_tests.errors import ControlError

Result = TypeVar("Result")


def carried_out(action: Action[Result]) -> Result:
    """Wait for an action as a bench does."""
    action.start(0)
    while not action.poll(0):
        select.select(action.descriptors, [], [], 20)
    return action.result()


@contextmanager
def sleeper() -> Iterator[subprocess.Popen[bytes]]:
    """A process that sleeps until it is killed."""
    command = [sys.executable, "-c", "import signal; print(flush=True); signal.pause()"]
    with subprocess.Popen(command, stdout=subprocess.PIPE) as child:
        try:
            assert child.stdout is not None
            child.stdout.readline()
            yield child
        finally:
            child.kill()


@pytest.mark.slow
def test_a_process_that_somebody_stops_is_late() -> None:
    """Seen from outside, without its help."""
    with sleeper() as child, closing(NeighbourHealth([child.pid])) as health:
        assert health.about == f"seen by a witness of process {child.pid} of this computer"
        child.send_signal(signal.SIGSTOP)
        os.waitid(os.P_PID, child.pid, os.WSTOPPED)
        stopped_at = time.time_ns()
        pairs = carried_out(health.late())
        assert any(due <= stopped_at <= sent for due, sent in pairs)
        assert all(due < sent for due, sent in pairs)
        child.send_signal(signal.SIGCONT)
        assert carried_out(health.late())


@pytest.mark.slow
def test_a_witness_that_is_gone_is_a_bench_error() -> None:
    """Without it nobody can say what the device is to blame for."""
    with closing(NeighbourHealth([os.getpid()])) as health:
        assert isinstance(carried_out(health.late()), list)
        health._witness.kill()
        lost = rf"process {os.getpid()} of this computer.* has ended; .*health"
        with pytest.raises(ControlError, match=lost):
            carried_out(health.late())


@pytest.mark.slow
def test_a_witness_that_says_nothing_is_a_bench_error() -> None:
    """It is asked, and answers within seconds or never."""
    with closing(NeighbourHealth([os.getpid()])) as health:
        health._witness.send_signal(signal.SIGSTOP)
        action = health.late()
        action.start(0)
        assert not action.poll(5 * S - 1)
        with pytest.raises(ControlError, match="has not answered for 5 s; start the run again"):
            action.poll(5 * S)


@pytest.mark.slow
def test_a_process_without_an_account_is_refused() -> None:
    """The kernel keeps none of a process that does not exist."""
    with pytest.raises(OSError, match="keeps no account of 999999999"):
        NeighbourHealth([999_999_999])


# Who is at the other end.


def test_the_other_end_of_a_unix_socket_is_known() -> None:
    """The kernel tells."""
    here, there = socket.socketpair()
    with here, there:
        assert processes_behind(here) == [os.getpid()]


def test_without_procfs_nobody_is_known(tmp_path: Path) -> None:
    """Systems other than Linux are not asked what they cannot tell."""
    here, there = socket.socketpair()
    with here, there:
        assert processes_behind(here, tmp_path / "nowhere") == []


@pytest.mark.parametrize(
    ("family", "listens", "connects"),
    [
        (socket.AF_INET, "127.0.0.1", "127.0.0.1"),
        (socket.AF_INET6, "::1", "::1"),
        (socket.AF_INET6, "::ffff:127.0.0.1", "127.0.0.1"),
    ],
)
def test_the_other_end_of_a_tcp_connection_is_found(
    family: socket.AddressFamily, listens: str, connects: str
) -> None:
    """By the table of connections, and who has the socket open."""
    with socket.socket(family) as server:
        if family == socket.AF_INET6:
            server.setsockopt(socket.IPPROTO_IPV6, socket.IPV6_V6ONLY, 0)
        try:
            server.bind((listens, 0))
        except OSError:
            pytest.skip("this machine has no IPv6")
        server.listen()
        with socket.create_connection((connects, server.getsockname()[1])) as client:
            accepted, _ = server.accept()
            with accepted:
                assert processes_behind(client) == [os.getpid()]


def test_a_peer_elsewhere_is_nobody_here(tmp_path: Path) -> None:
    """No connection of this machine has these ends; nor is one found where there is no procfs."""
    heads = "  sl  local_address rem_address\n"
    (tmp_path / "net").mkdir()
    for table in ("tcp", "tcp6"):
        (tmp_path / "net" / table).write_text(heads)
    with (
        socket.create_server(("127.0.0.1", 0)) as server,
        socket.create_connection(server.getsockname()) as client,
    ):
        assert processes_behind(client, tmp_path) == []
        assert processes_behind(client, tmp_path / "nowhere") == []
