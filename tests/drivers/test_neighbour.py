"""A simulated device on this machine: the kernel's account of its process, and who it is."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path

import pytest

from hil_tests.bench.drivers.neighbour import (
    ENOUGH_NS,
    FULLY,
    NeighbourHealth,
    ProcAccount,
    Witness,
    processes_behind,
)
from hil_tests.clock import MS, US, S

TICK_NS = S // os.sysconf("SC_CLK_TCK")


class Told:
    """An account that a test writes."""

    def __init__(self) -> None:
        self.now = 1 * S
        self.wait_ns = 0
        self.state = "S"
        self.stolen_ns = 0

    def waited(self) -> int:
        """Once."""
        found, self.wait_ns = self.wait_ns, 0
        return found

    def states(self) -> frozenset[str]:
        """As set."""
        return frozenset(self.state)

    def stolen(self) -> int:
        """Once."""
        found, self.stolen_ns = self.stolen_ns, 0
        return found

    def clock(self) -> int:
        """As set."""
        return self.now


class Scene:
    """A witness, and looks at instants that a test chooses."""

    def __init__(self) -> None:
        self.account = Told()
        self.witness = Witness(self.account, self.account.clock)

    def look(
        self, after_ns: int = 2 * MS, wait_ns: int = 0, state: str = "S", *, fully: bool = False
    ) -> bool:
        """Look after a while in which it waited and came to that state."""
        self.account.now += after_ns
        self.account.wait_ns, self.account.state = wait_ns, state
        return self.witness.look(fully=fully)

    @property
    def pairs(self) -> list[tuple[int, int]]:
        """What is known, counted from the beginning."""
        return [(due - 1 * S, sent - 1 * S) for due, sent in self.witness.take()]


def test_a_process_that_never_waits_is_never_late() -> None:
    """Nothing is held against the host, and everything that was due is done."""
    scene = Scene()
    assert all(scene.look() for _ in range(3 * FULLY))
    assert scene.pairs == []


@pytest.mark.parametrize(
    ("wait_ns", "pairs"),
    [(ENOUGH_NS, []), (ENOUGH_NS + 1, [(4 * MS - ENOUGH_NS - 1, 6 * MS)])],
)
def test_what_is_sent_after_a_wait_was_due_as_much_earlier(
    wait_ns: int, pairs: list[tuple[int, int]]
) -> None:
    """Earlier than the last look by the wait; a wait that every process has does not count."""
    scene = Scene()
    scene.look()
    scene.look()
    scene.look(wait_ns=wait_ns)
    scene.look()
    assert scene.pairs == pairs
    assert scene.pairs == []


def test_waits_add_up_until_the_process_sleeps() -> None:
    """Who is kept from work twice is late by both; asleep, everything is done."""
    scene = Scene()
    assert not scene.look(wait_ns=150 * US, state="R")
    assert not scene.look(wait_ns=150 * US, state="RS")
    assert scene.look(wait_ns=150 * US, state="S")
    assert scene.look(wait_ns=150 * US, state="S")
    late = [(2 * MS - 300 * US, 4 * MS), (4 * MS - 450 * US, 6 * MS)]
    assert scene.pairs == late


def test_a_process_that_never_sleeps_is_not_late_for_ever() -> None:
    """Half a millisecond that it waited a quarter of a second ago is over."""
    scene = Scene()
    scene.look(wait_ns=500 * US, state="R")
    scene.look(250 * MS, state="R")
    assert len(scene.pairs) == 2
    scene.look(1, state="R")
    assert scene.pairs == []


@pytest.mark.parametrize("letter", "Tt")
def test_a_stopped_process_sends_late_until_it_sleeps_again(letter: str) -> None:
    """Due at the earliest when it was last seen not to be stopped."""
    scene = Scene()
    scene.look(fully=True)
    assert not scene.look(state=letter, fully=True)
    assert not scene.look(1 * S, state="R", fully=True)
    assert scene.look(state="S", fully=True)
    scene.look(fully=True)
    since = 2 * MS
    assert scene.pairs == [(since, 4 * MS), (since, 4 * MS + S), (since, 6 * MS + S)]


def test_a_stop_is_seen_with_every_fifth_look() -> None:
    """In between it is not asked for; from then on what is due is not done."""
    scene = Scene()
    assert [scene.look(state="T") for _ in range(FULLY + 1)] == [True] * 4 + [False] * 2


def test_time_that_was_taken_from_the_machine_is_the_hosts() -> None:
    """What its own host took from a virtual machine, it took from the device."""
    scene = Scene()
    scene.account.stolen_ns = 30 * MS
    scene.look(fully=True)
    assert scene.pairs == [(-30 * MS, 2 * MS)]


def test_questions_are_answered_when_the_process_has_done_its_work() -> None:
    """Or after a second, where it never has."""
    account = Told()
    asking = NeighbourHealth(account, account.clock).late()
    asking.start(account.now)
    account.state = "R"
    assert not asking.poll(account.now)
    assert asking.wake_at > account.now
    account.state = "S"
    assert asking.poll(account.now)
    account.state = "R"
    assert not asking.poll(1 * S + 1 * S - 1)
    assert asking.poll(1 * S + 1 * S)
    assert asking.result() == []


# What procfs says.


class Proc:
    """A procfs of files."""

    def __init__(self, root: Path) -> None:
        self.root = root
        self.steal(0)

    def thread(self, number: int, waited_ns: int, state: str = "S") -> Path:
        """A thread of process 7."""
        folder = self.root / "7" / "task" / str(number)
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "schedstat").write_text(f"12345 {waited_ns} 6\n")
        (folder / "stat").write_text(f"{number} (a) S (b) {state} 1 1 1\n")
        return folder

    def steal(self, ticks: int) -> None:
        """What the machine's host took."""
        (self.root / "stat").write_text(f"cpu  1 2 3 4 5 6 7 {ticks} 0 0\ncpu0 1\n")

    @contextmanager
    def account(self) -> Iterator[ProcAccount]:
        """Of process 7."""
        with closing(ProcAccount([7], self.root)) as account:
            yield account


def test_waits_of_all_threads_count_from_the_first_look(tmp_path: Path) -> None:
    """Together; a thread that is new has waited for nothing so far."""
    proc = Proc(tmp_path)
    proc.thread(7, 1_000)
    proc.thread(8, 2_000)
    with proc.account() as account:
        assert account.waited() == 0
        proc.thread(7, 1_500)
        proc.thread(8, 2_200)
        assert account.waited() == 700
        proc.thread(9, 5_000)
        assert sum(account.waited() for _ in range(60)) == 0
        assert len(account) == 3
        proc.thread(9, 5_001)
        assert account.waited() == 1


def test_threads_that_have_ended_are_forgotten(tmp_path: Path) -> None:
    """Their account is empty, or no number."""
    proc = Proc(tmp_path)
    proc.thread(7, 1_000)
    ended = proc.thread(8, 1_000)
    with proc.account() as account:
        account.waited()
        (ended / "schedstat").write_text("")
        proc.thread(7, 1_010)
        assert account.waited() == 10
        assert len(account) == 1


def test_states_are_the_letters_behind_the_name(tmp_path: Path) -> None:
    """A program may be called anything."""
    proc = Proc(tmp_path)
    proc.thread(7, 0, "S")
    proc.thread(8, 0, "R")
    with proc.account() as account:
        account.waited()
        assert account.states() == {"S", "R"}


def test_stolen_time_counts_in_ticks_from_the_beginning(tmp_path: Path) -> None:
    """A kernel that does not tell has stolen nothing."""
    proc = Proc(tmp_path)
    proc.thread(7, 0)
    proc.steal(5)
    with proc.account() as account:
        assert account.stolen() == 0
        proc.steal(8)
        assert account.stolen() == 3 * TICK_NS
        (tmp_path / "stat").write_text("cpu  1 2 3\n")
    with proc.account() as account:
        assert account.stolen() == 0


def test_a_process_without_an_account_is_refused() -> None:
    """The kernel keeps none of a process that does not exist."""
    with pytest.raises(OSError, match="keeps no account of 999999999"):
        ProcAccount([999_999_999])


@pytest.mark.slow
def test_a_process_that_somebody_stops_is_late() -> None:
    """Seen from outside, without its help; the stop was seen to begin after it was sent."""
    asleep = [sys.executable, "-c", "import signal; print(flush=True); signal.pause()"]
    with subprocess.Popen(asleep, stdout=subprocess.PIPE) as child:
        assert child.stdout is not None
        child.stdout.readline()
        now = 0

        def clock() -> int:
            nonlocal now
            now += 1
            return now

        with (
            closing(ProcAccount([child.pid])) as account,
            closing(NeighbourHealth(account, clock)) as health,
        ):
            health.look_on()
            child.send_signal(signal.SIGSTOP)
            os.waitid(os.P_PID, child.pid, os.WSTOPPED)
            asking = health.late()
            asking.start(0)
            assert not asking.poll(0)
            child.send_signal(signal.SIGCONT)
            while not asking.poll(0):
                pass
            assert asking.result()
        child.kill()


# Who is at the other end.


def test_the_other_end_of_a_unix_socket_is_known() -> None:
    """The kernel tells."""
    here, there = socket.socketpair()
    with here, there:
        assert processes_behind(here) == [os.getpid()]


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
