"""A change counts once it has lasted; each key by itself."""

from __future__ import annotations

from hypothesis import given, settings
from hypothesis import strategies as st

from node_model.debounce import Debouncer

A, B = 0b01, 0b10
TIME = 100


def test_a_press_counts_at_exactly_the_debounce_time() -> None:
    """One unit before it nothing has changed; at it the key is settled."""
    keys = Debouncer(TIME)
    keys.edge(A, 10)

    assert keys.due_at == 110
    assert keys.advance(109) == 0
    assert keys.settled == 0
    assert keys.advance(110) == A
    assert keys.settled == A
    assert keys.due_at is None


def test_a_release_counts_like_a_press() -> None:
    """The same time in the other direction."""
    keys = Debouncer(TIME, A)
    keys.edge(0, 0)
    assert keys.advance(99) == 0
    assert keys.advance(100) == A
    assert keys.settled == 0


def test_an_edge_back_in_time_cancels() -> None:
    """A pulse shorter than the debounce time leaves no trace."""
    keys = Debouncer(TIME)
    keys.edge(A, 0)
    keys.edge(0, 99)
    assert keys.due_at is None
    assert keys.advance(1000) == 0


def test_bouncing_starts_the_time_anew() -> None:
    """The last edge counts."""
    keys = Debouncer(TIME)
    for at, raw in ((0, A), (5, 0), (8, A)):
        keys.edge(raw, at)
    assert keys.due_at == 108


def test_keys_are_independent() -> None:
    """An edge of one key neither restarts nor hurries another one."""
    keys = Debouncer(TIME)
    keys.edge(A, 0)
    keys.edge(A | B, 60)
    assert keys.due_at == 100
    assert keys.advance(100) == A
    assert keys.due_at == 160
    assert keys.advance(160) == B
    assert keys.settled == A | B


def test_changes_that_mature_together_are_told_together() -> None:
    """One mask for both."""
    keys = Debouncer(TIME)
    keys.edge(A | B, 0)
    assert keys.advance(100) == A | B


def test_time_zero_takes_every_edge_at_once() -> None:
    """No filtering."""
    keys = Debouncer(0)
    keys.edge(A, 5)
    assert keys.due_at == 5
    assert keys.advance(5) == A


def test_what_was_held_at_the_start_is_settled() -> None:
    """The mask of the start needs no time."""
    keys = Debouncer(TIME, A)
    assert keys.settled == A
    assert keys.due_at is None


@settings(max_examples=60)
@given(st.lists(st.tuples(st.integers(1, 150), st.integers(0, 7)), max_size=30))
def test_settled_state_follows_from_the_edges_alone(edges: list[tuple[int, int]]) -> None:
    """Key by key: the settled state is the last one that lasted for the debounce time.

    Compared with a plain rule: of each stretch between two edges of a key, the state counts
    where the stretch is at least as long as the debounce time.
    """
    keys, now = Debouncer(TIME), 0
    moves: dict[int, list[tuple[int, bool]]] = {bit: [(-TIME, False)] for bit in (1, 2, 4)}
    for wait, raw in edges:
        now += wait
        while keys.due_at is not None and keys.due_at <= now:
            keys.advance(keys.due_at)
        keys.edge(raw, now)
        for bit, known in moves.items():
            if known[-1][1] is not bool(raw & bit):
                known.append((now, bool(raw & bit)))
    keys.advance(now)

    expected = 0
    for bit, known in moves.items():
        ends = [at for at, _ in known[1:]] + [now]
        lasting = [held for (at, held), end in zip(known, ends, strict=True) if end - at >= TIME]
        expected |= bit * (lasting[-1] if lasting else False)
    assert keys.settled == expected
