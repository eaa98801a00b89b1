"""Facilities over the control protocol: what answers mean, and which are lies."""

from __future__ import annotations

import contextlib
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from hil_tests.bench.drivers.control import (
    ControlBitRate,
    ControlFaults,
    ControlHealth,
    ControlKeys,
    ControlLeds,
    ControlPower,
    ControlSession,
)
from hil_tests.clock import MS, Interval, S
from hil_tests.errors import ControlError
from tests.drivers.peers import Reply, answer, finish, scripted

NOW = 1_795_329_081_123_456_789
LEDS = ("aut", "k3")


class Clock:
    """Each reading is a millisecond later."""

    def __init__(self) -> None:
        self.now = NOW

    def __call__(self) -> int:
        """The present."""
        self.now += MS
        return self.now


@contextlib.contextmanager
def session(folder: Path, *replies: Reply, **hello: Any) -> Iterator[ControlSession]:
    """A session with a peer that gives these replies."""
    with scripted(folder, [*replies, answer(), answer()], **hello) as address:
        made = ControlSession(address, clock=Clock())
        made.connect()
        try:
            yield made
        finally:
            made.close()


def raw(text: str) -> Reply:
    """An answer written by hand; the id of the second request."""
    return f'{{"id": 2, "ok": true, {text}}}\n'.encode()


def seconds(instant: int) -> str:
    """An instant as JSON, exact."""
    return f"{instant // S}.{instant % S:09d}"


def test_at_of_the_same_clock_is_exact(tmp_path: Path) -> None:
    """To the nanosecond: no float in between."""
    at = NOW + MS + 333
    with session(tmp_path, raw(f'"at": [{seconds(at)}, {seconds(at + 1)}]')) as peer:
        when = finish(ControlPower(peer).switch(True), peer.clock)

    assert when == Interval(at, at + 1)


@pytest.mark.parametrize("clock", [None, "other"])
def test_at_of_another_clock_does_not_count(clock: str | None, tmp_path: Path) -> None:
    """Then it happened between request and answer, read after the answer came."""
    with session(tmp_path, raw('"at": [1.0, 2.0]'), clock=clock) as peer:
        when = finish(ControlPower(peer).switch(True), peer.clock)

    assert NOW < when.earliest < when.latest < NOW + S


def test_missing_at_is_between_request_and_answer(tmp_path: Path) -> None:
    """Also on the same clock."""
    with session(tmp_path, answer()) as peer:
        when = finish(ControlPower(peer).switch(False), peer.clock)

    assert NOW < when.earliest < when.latest < NOW + S


LYING_AT = [
    ("5", "is no"),
    ("[]", "is no"),
    ("[1]", "is no"),
    ('["a", "b"]', "no time in seconds"),
    ("[true, true]", "no time in seconds"),
    ("[null, null]", "no time in seconds"),
    ("[-1, 1]", "no time in seconds"),
    ("[1e999999, 1e999999]", "no time in seconds"),
    (f"[{seconds(NOW + 3 * MS)}, {seconds(NOW + 2 * MS)}]", "ends before it begins"),
    ("[0, 0]", "before the request"),
    (f"[{seconds(NOW - 60 * MS)}, {seconds(NOW + MS)}]", "before the request"),
    (f"[{seconds(NOW)}, {seconds(NOW + 3600 * S)}]", "after the answer"),
]


@pytest.mark.parametrize(("at", "text"), LYING_AT)
def test_impossible_at_is_a_control_error(at: str, text: str, tmp_path: Path) -> None:
    """Nothing takes effect before it is asked for, or after it is said to be done."""
    with (
        session(tmp_path, raw(f'"at": {at}')) as peer,
        pytest.raises(ControlError, match=text),
    ):
        finish(ControlPower(peer).switch(True), peer.clock)


def test_at_that_is_rounded_to_milliseconds_is_taken(tmp_path: Path) -> None:
    """A server may know its time to a millisecond only."""
    at = (NOW // MS - 1) * MS
    with session(tmp_path, raw(f'"at": [{seconds(at)}, {seconds(at)}]')) as peer:
        assert finish(ControlPower(peer).switch(True), peer.clock) == Interval(at, at)


def test_requests_are_those_of_the_protocol(tmp_path: Path) -> None:
    """To the letter: outside servers rely on it."""
    seen: list[dict[str, Any]] = []

    def note(request: dict[str, Any]) -> bytes:
        seen.append(request)
        return answer(at=None, late=[], leds={"aut": "on", "k3": "off"})(request)

    with session(tmp_path, *[note] * 7, clock=None) as peer:
        keys = ControlKeys(peer)
        assert keys.timed_sequences
        for action in (
            ControlPower(peer).switch(True),
            keys.hold(frozenset({"on_off", "aut"})),
            keys.sequence([(0, frozenset({"aut"})), (4 * MS, frozenset())]),
            ControlLeds(peer, LEDS).read(),
            ControlBitRate(peer).set(125_000),
            ControlFaults(peer).fail(frozenset({"vendor", "encoder"})),
            ControlHealth(peer).late(),
        ):
            finish(action, peer.clock)

    for request in seen:
        del request["id"]
    assert seen == [
        {"do": "power", "on": True},
        {"do": "keys", "held": ["aut", "on_off"]},
        {"do": "keys", "sequence": [[0.0, ["aut"]], [0.004, []]]},
        {"do": "leds"},
        {"do": "bus", "bitrate": 125_000},
        {"do": "faults", "active": ["encoder", "vendor"]},
        {"do": "health"},
    ]


LATER = seconds(NOW + MS)
STEPS = [(0, frozenset({"aut"})), (4 * MS, frozenset[str]())]


def test_steps_have_one_interval_each(tmp_path: Path) -> None:
    """The server's own, where its clock is the same."""
    first, second = NOW + MS, NOW + 2 * MS
    at = f"[[{seconds(first)}, {seconds(first)}], [{seconds(second)}, {seconds(second + 5)}]]"
    with session(tmp_path, raw(f'"at": {at}')) as peer:
        found = finish(ControlKeys(peer).sequence(STEPS), peer.clock)

    assert found == [Interval(first, first), Interval(second, second + 5)]


def test_steps_without_a_clock_keep_their_spacing(tmp_path: Path) -> None:
    """All that is known: the whole sequence lay between request and answer."""
    with session(tmp_path, answer(), clock=None) as peer:
        found = finish(ControlKeys(peer).sequence(STEPS), peer.clock)

    assert [step.earliest - found[0].earliest for step in found] == [0, 4 * MS]
    assert all(step.earliest <= step.latest for step in found)


@pytest.mark.parametrize(
    ("at", "text"),
    [
        ("[]", "no list of 2"),
        ("{}", "no list of 2"),
        (f"[[{seconds(NOW)}, {seconds(NOW)}]]", "no list of 2"),
        (
            f"[[{seconds(NOW + MS)}, {seconds(NOW + MS)}], [{seconds(NOW)}, {seconds(NOW)}]]",
            "back",
        ),
    ],
)
def test_impossible_steps_are_a_control_error(at: str, text: str, tmp_path: Path) -> None:
    """One interval a step, forward in time."""
    with (
        session(tmp_path, raw(f'"at": {at}')) as peer,
        pytest.raises(ControlError, match=text),
    ):
        finish(ControlKeys(peer).sequence(STEPS), peer.clock)


def test_sequence_may_take_its_time(tmp_path: Path) -> None:
    """The time-out counts beside the time that the request itself takes."""
    with session(tmp_path) as peer:
        action = ControlKeys(peer).sequence([(0, frozenset()), (60 * S, frozenset())])
        action.start(NOW)

        assert 65 * S <= action.wake_at - NOW < 66 * S


@pytest.mark.parametrize(
    ("leds", "text"),
    [
        ({}, "missing LEDs aut, k3"),
        ({"aut": "on"}, "missing LEDs k3"),
        ({"aut": "on", "k3": "off", "kx": "on"}, "unknown LEDs 'kx'"),
        ({"aut": "on", "k3": "dim"}, "'k3' is 'dim'"),
        ({"aut": "on", "k3": True}, "'k3' is True"),
        ({"aut": "on", "k3": ["on"]}, "'k3' is"),
        ([], "no object 'leds'"),
        (None, "no object 'leds'"),
    ],
    ids=str,
)
def test_lights_that_make_no_sense_are_a_control_error(
    leds: object, text: str, tmp_path: Path
) -> None:
    """Exactly the LEDs of the profile, each off, on or blinking."""
    with (
        session(tmp_path, answer(leds=leds)) as peer,
        pytest.raises(ControlError, match=text),
    ):
        finish(ControlLeds(peer, LEDS).read(), peer.clock)


def watch(edges: object, start: object, at: bool = False) -> Reply:
    """An answer to leds for 2 ms; times of edges are spans in ns from NOW."""

    def times(value: object) -> object:
        match value:
            case [int(span), *rest]:
                return [f"@{seconds(NOW + span)}@", *rest]
        return value

    listed = [times(edge) for edge in edges] if isinstance(edges, list) else edges
    fields: dict[str, object] = {"edges": listed, "start": start}
    if at:
        fields["at"] = [f"@{seconds(NOW + span)}@" for span in (MS, 2 * MS)]
    text = json.dumps({"id": 2, "ok": True, **fields})
    return text.replace('"@', "").replace('@"', "").encode() + b"\n"


DARK = {"aut": False, "k3": False}


def test_edges_are_exact_sightings(tmp_path: Path) -> None:
    """In order, with the stretch that was watched."""
    edges = [[MS, "aut", True], [MS + 7, "k3", True], [2 * MS, "aut", False]]
    with session(tmp_path, watch(edges, DARK, at=True)) as peer:
        leds = ControlLeds(peer, LEDS)
        assert leds.sees_edges
        seen = finish(leds.watch(2 * MS), peer.clock)

    assert seen.start == DARK
    assert seen.watched == Interval(NOW + MS, NOW + 2 * MS)
    assert [(when.earliest - NOW, led, lit) for when, led, lit in seen.edges] == [
        (MS, "aut", True), (MS + 7, "k3", True), (2 * MS, "aut", False),
    ]  # fmt: skip
    assert all(when.doubt_ns == 0 for when, _, _ in seen.edges)


def test_edges_need_the_same_clock(tmp_path: Path) -> None:
    """An edge on a clock of its own cannot be compared with frames."""
    with session(tmp_path, clock=None) as peer:
        assert not ControlLeds(peer, LEDS).sees_edges


@pytest.mark.parametrize(
    ("edges", "start", "text"),
    [
        (None, DARK, "no list 'edges'"),
        ([[MS, "kx", True]], DARK, "is no"),
        ([[MS, "aut", 1]], DARK, "is no"),
        ([[MS, "aut"]], DARK, "is no"),
        ([["x", "aut", True]], DARK, "no time in seconds"),
        ([[MS, "aut", False]], DARK, "changes nothing"),
        ([[MS, "aut", True], [2 * MS, "aut", True]], DARK, "changes nothing"),
        ([[2 * MS, "aut", True], [MS, "k3", True]], DARK, "goes back in time"),
        ([[-S, "aut", True]], DARK, "before the request"),
        ([[S, "aut", True]], DARK, "after the answer"),
        ([], {"aut": False}, "missing LEDs k3"),
        ([], {"aut": False, "k3": 0}, "start of 'k3'"),
        ([], None, "no object 'start'"),
    ],
    ids=str,
)
def test_edges_that_make_no_sense_are_a_control_error(
    edges: object, start: object, text: str, tmp_path: Path
) -> None:
    """Each is a change of a known LED, in order, while it was watched."""
    with (
        session(tmp_path, watch(edges, start)) as peer,
        pytest.raises(ControlError, match=text),
    ):
        finish(ControlLeds(peer, LEDS).watch(MS), peer.clock)


def test_watch_that_is_over_too_soon_is_a_control_error(tmp_path: Path) -> None:
    """Two minutes cannot be watched in a millisecond."""
    with (
        session(tmp_path, watch([], DARK)) as peer,
        pytest.raises(ControlError, match="before the 120 s were over"),
    ):
        finish(ControlLeds(peer, LEDS).watch(120 * S), peer.clock)


def test_late_frames_are_exact(tmp_path: Path) -> None:
    """Pairs of due and sent, to the nanosecond."""
    text = f'"late": [[{seconds(NOW)}, {seconds(NOW + 1)}]]'
    with session(tmp_path, raw(text)) as peer:
        assert finish(ControlHealth(peer).late(), peer.clock) == [(NOW, NOW + 1)]


def test_late_frames_that_need_several_lines_are_all_fetched(tmp_path: Path) -> None:
    """`more` asks again."""
    replies = [answer(late=[[1, 2]], more=True), answer(late=[[3, 4]], more=True), answer(late=[])]
    with session(tmp_path, *replies) as peer:
        assert finish(ControlHealth(peer).late(), peer.clock) == [(S, 2 * S), (3 * S, 4 * S)]


@pytest.mark.parametrize("late", [None, {}, [1], [[1]], [[2, 1]], [["a", "b"]], [[1, 2, 3]]])
def test_late_frames_that_make_no_sense_are_a_control_error(late: object, tmp_path: Path) -> None:
    """A frame is not sent before it is due."""
    with (
        session(tmp_path, answer(late=late)) as peer,
        pytest.raises(ControlError, match="late"),
    ):
        finish(ControlHealth(peer).late(), peer.clock)
