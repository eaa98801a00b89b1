"""The witness: what the kernel's account of a process says of what it sent late."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path

import pytest

from hil_tests.bench.drivers.witness import (
    ENOUGH_NS,
    FULLY,
    LOOK_NS,
    PATIENCE_NS,
    ProcAccount,
    Witness,
    look_on,
    main,
)
from hil_tests.clock import MS, US, S


class Told:
    """An account that a test writes."""

    def __init__(self) -> None:
        self.now = 1 * S
        self.wait_ns = 0
        self.state = "S"
        self.ran_ns = 0
        self.spent_ns = 0

    def waited(self) -> int:
        """Once."""
        found, self.wait_ns = self.wait_ns, 0
        return found

    def states(self) -> frozenset[str]:
        """As set."""
        return frozenset(self.state)

    def spent(self) -> tuple[int, int]:
        """Once."""
        found, self.ran_ns, self.spent_ns = (self.ran_ns, self.spent_ns), 0, 0
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
        self.account.spent_ns = self.account.spent_ns or after_ns - LOOK_NS
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


@pytest.mark.parametrize(
    ("spent_ns", "pairs"), [(1 * MS, []), (1 * MS - 1, [(2 * MS, 5 * MS + 500 * US)])]
)
def test_a_witness_that_is_late_for_no_reason_vouches_for_nobody(
    spent_ns: int, pairs: list[tuple[int, int]]
) -> None:
    """Its own run and its own wait are a reason; else the machine had no processor there."""
    scene = Scene()
    scene.look()
    scene.account.spent_ns = spent_ns
    scene.look(3 * MS + 500 * US)
    assert scene.pairs == pairs


@pytest.mark.parametrize(
    ("ran_ns", "pause_ns"),
    [(0, LOOK_NS), (100 * US, LOOK_NS), (101 * US, 2_020 * US), (6 * MS, 100 * MS)],
)
def test_dear_looks_are_rare(ran_ns: int, pause_ns: int) -> None:
    """On a slow machine the witness must not take the time that it is to measure."""
    scene = Scene()
    scene.account.ran_ns = ran_ns
    scene.look()
    assert scene.witness.pause_ns == pause_ns
    scene.account.spent_ns = 1
    scene.look(pause_ns + 500 * US)
    assert scene.pairs == []


# Answering the bench.


def told(states: str, *words: bytes | None) -> list[str]:
    """What a witness answers to words, each said before a look at the next state."""
    account = Told()
    lines: list[str] = []
    said, state = iter(words), iter(states)

    def wait(pause_ns: int) -> bytes | None:
        assert pause_ns == LOOK_NS
        account.now += 2 * MS
        account.state = next(state, "S")
        return next(said, b"")

    look_on(Witness(account, account.clock), wait, lines.append)
    return lines


def test_the_bench_is_answered_when_the_work_is_done() -> None:
    """At once where the process sleeps; nobody who was not asked says anything."""
    assert told("SSS", None, b"?", None) == ["[]"]
    assert told("SRRS", None, b"?", None, None) == ["[]"]
    assert told("SRR", None, b"?", None) == []
    assert told("SS", b"?", b"?") == ["[]", "[]"]


def test_a_process_that_never_rests_is_not_waited_for_for_ever() -> None:
    """After a second the bench hears what is known."""
    looks = PATIENCE_NS // LOOK_NS
    assert told("R" * looks, b"?", *(None,) * (looks - 2)) == []
    assert told("R" * looks, b"?", *(None,) * (looks - 1)) == ["[]"]


def test_a_process_that_does_not_exist_has_no_account(capsys: pytest.CaptureFixture[str]) -> None:
    """Said in one line."""
    assert main(["999999999"]) == 1
    assert capsys.readouterr().err == "the kernel keeps no account of 999999999\n"


# What procfs says.


class Proc:
    """A procfs of files."""

    def __init__(self, root: Path) -> None:
        self.root = root
        self.cpus: list[set[int]] = []
        """Where the witness was sent."""
        self.own(0, 0)

    def own(self, run_ns: int, waited_ns: int) -> None:
        """What the witness itself did."""
        (self.root / "self").mkdir(exist_ok=True)
        (self.root / "self" / "schedstat").write_text(f"{run_ns} {waited_ns} 6\n")

    def thread(self, number: int, waited_ns: int, state: str = "S", cpu: int = 1) -> Path:
        """A thread of process 7."""
        folder = self.root / "7" / "task" / str(number)
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "schedstat").write_text(f"12345 {waited_ns} 6\n")
        (folder / "stat").write_text(f"{number} (a) S (b) {state} {'0 ' * 35}{cpu} 0 0\n")
        return folder

    @contextmanager
    def account(self) -> Iterator[ProcAccount]:
        """Of process 7."""
        with closing(ProcAccount([7], self.root, self.cpus.append)) as account:
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


def test_the_witness_goes_where_the_process_runs(tmp_path: Path) -> None:
    """To the processors of all its threads, when they have changed."""
    proc = Proc(tmp_path)
    proc.thread(7, 0, cpu=1)
    proc.thread(8, 0, cpu=3)
    with proc.account() as account:
        account.states()
        account.states()
        proc.thread(8, 0, cpu=1)
        account.states()
    assert proc.cpus == [{1, 3}, {1}]


def test_a_witness_that_may_not_go_there_stays(tmp_path: Path) -> None:
    """A processor may be kept for others."""

    def refused(cpus: set[int]) -> None:
        raise PermissionError(cpus)

    Proc(tmp_path).thread(7, 0)
    with closing(ProcAccount([7], tmp_path, refused)) as account:
        assert account.states() == {"S"}


def test_what_the_witness_did_itself_counts_from_the_beginning(tmp_path: Path) -> None:
    """Run and wait."""
    proc = Proc(tmp_path)
    proc.thread(7, 0)
    proc.own(1_000, 50)
    with proc.account() as account:
        assert account.spent() == (0, 0)
        proc.own(1_500, 70)
        assert account.spent() == (500, 20)
