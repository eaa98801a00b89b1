"""The client's session: whatever a peer does, the bench says which, what and what next."""

from __future__ import annotations

import contextlib
import json
import socket
from pathlib import Path
from typing import Any

import pytest

from hil_tests.bench.drivers.control import ControlPower
from hil_tests.bench.drivers.peer import LINE_LIMIT, ControlSession
from hil_tests.clock import S
from hil_tests.errors import ControlError
from tests.drivers.peers import HELLO, Reply, answer, finish, scripted


def test_hello_is_kept(tmp_path: Path) -> None:
    """Device, verbs and clock are known after connecting."""
    with scripted(tmp_path, [answer()]) as address:
        session = ControlSession(address)
        session.connect()

        assert session.device == "scripted"
        assert session.can == set(HELLO["can"])
        assert session.same_clock
        session.close()
        session.close()


@pytest.mark.parametrize(
    ("hello", "text"),
    [
        ({"protocol": 2}, "protocol 2 instead of 1"),
        ({"protocol": None}, "protocol None"),
        ({"protocol": True}, "protocol True"),
        ({"device": None}, "no device name"),
        ({"device": 5}, "no device name"),
        ({"can": None}, "no list 'can'"),
        ({"can": "power"}, "no list 'can'"),
        ({"can": [1]}, "no list 'can'"),
        ({"clock": 5}, "clock 5"),
        ({"ok": False, "error": "no"}, "refused"),
    ],
    ids=str,
)
def test_hello_that_makes_no_sense_is_refused(
    hello: dict[str, Any], text: str, tmp_path: Path
) -> None:
    """A server of another kind is found out before the first test."""
    with scripted(tmp_path, [], **hello) as address:
        session = ControlSession(address)
        with pytest.raises(ControlError, match=text):
            session.connect()
        session.close()


@pytest.mark.parametrize("clock", [None, "other", "monotonic"])
def test_only_clock_same_is_the_same_clock(clock: str | None, tmp_path: Path) -> None:
    """Any other word means that its times are its own."""
    with scripted(tmp_path, [answer()], clock=clock) as address:
        session = ControlSession(address)
        session.connect()

        assert not session.same_clock
        session.close()


def test_missing_ability_names_what_to_change(tmp_path: Path) -> None:
    """A hello that lacks what the bench file declares is a bench error."""
    with scripted(tmp_path, [answer()], can=["keys"]) as address:
        session = ControlSession(address)
        session.connect()
        with pytest.raises(ControlError, match=r"lacks power \(it can keys\).*bench file"):
            ControlPower(session)
        session.close()


HOSTILE: list[tuple[Reply, str]] = [
    (None, "hung up on"),
    (b'{"id": 2, "o', "hung up|no answer"),
    (b"nonsense\n", "no JSON: b'nonsense'"),
    (b"\xff\xfe\n", "no JSON"),
    (b"[" * 60_000 + b"\n", "no JSON"),
    (b'{"id": 2, "ok": true, "at": [NaN, 1]}\n', "no JSON"),
    (b"[1]\n", "no JSON object"),
    (b"x" * (LINE_LIMIT + 1) + b"\n", "more than 65536 bytes"),
    (b"x" * (3 * LINE_LIMIT), "more than 65536 bytes"),
    (b'{"ok": true}\n', "with id None"),
    (b'{"id": 1, "ok": true}\n', "id 2, with id 1"),
    (b'{"id": 3, "ok": true}\n', "with id 3"),
    (b'{"id": "2", "ok": true}\n', "with id '2'"),
    (b'{"id": 2.0, "ok": true}\n', "with id Decimal"),
    (b'{"id": 2}\n', "without ok"),
    (b'{"id": 2, "ok": "yes"}\n', "without ok"),
    (b'{"id": 2, "ok": 1}\n', "without ok"),
    (b'{"id": 2, "ok": false, "error": "relay stuck"}\n', "refused .*relay stuck"),
    (b'{"id": 2, "ok": false}\n', "refused .*None"),
]


@pytest.mark.parametrize(("reply", "text"), HOSTILE, ids=lambda value: repr(value)[:30])
def test_hostile_answer_is_a_control_error(reply: Reply, text: str, tmp_path: Path) -> None:
    """It names the address, the request and what came; nothing else is raised."""
    hang_up: list[Reply] = [reply, None]
    with scripted(tmp_path, hang_up) as address:
        session = ControlSession(address, timeout_ns=S // 10)
        session.connect()
        with pytest.raises(ControlError, match=text) as caught:
            finish(ControlPower(session).switch(True), session.clock)
        session.close()

    assert address in str(caught.value)
    assert len(str(caught.value)) < 600


def test_stalled_peer_is_told_at_the_time_out(tmp_path: Path) -> None:
    """The action says when to look again, and what was not answered."""
    with scripted(tmp_path, [b""]) as address:
        now = 1_000 * S
        session = ControlSession(address, clock=lambda: now)
        session.connect()
        action = ControlPower(session).switch(True)
        action.start(now)

        assert action.wake_at == now + 5 * S
        assert not action.poll(now + 5 * S - 1)
        with pytest.raises(ControlError, match=r"no answer to .*power.* within 5 s"):
            action.poll(now + 5 * S)
        session.close()


def test_broken_session_tells_its_first_cause_to_all(tmp_path: Path) -> None:
    """After a lie nothing is asked any more; the rest fails at once."""
    with scripted(tmp_path, [b"nonsense\n"]) as address:
        session = ControlSession(address)
        session.connect()
        power = ControlPower(session)
        with pytest.raises(ControlError, match="nonsense"):
            finish(power.switch(True), session.clock)
        with pytest.raises(ControlError, match="nonsense"):
            finish(power.switch(False), session.clock)
        session.close()


def test_refusal_leaves_the_session_whole(tmp_path: Path) -> None:
    """Only that request failed."""
    refusal = b'{"id": 2, "ok": false, "error": "no"}\n'
    with scripted(tmp_path, [refusal, answer(), answer()]) as address:
        session = ControlSession(address)
        session.connect()
        power = ControlPower(session)
        with pytest.raises(ControlError, match="refused"):
            finish(power.switch(True), session.clock)

        assert finish(power.switch(True), session.clock)
        session.close()


def test_answer_before_hanging_up_counts(tmp_path: Path) -> None:
    """What was said was said; the next request meets the closed door."""

    def last_words(request: dict[str, Any]) -> bytes:
        return answer()(request)

    with scripted(tmp_path, [last_words, None]) as address:
        session = ControlSession(address)
        session.connect()
        power = ControlPower(session)
        assert finish(power.switch(True), session.clock)
        with pytest.raises(ControlError, match="hung up"):
            finish(power.switch(True), session.clock)
        session.close()


def test_requests_may_overlap(tmp_path: Path) -> None:
    """Two actions at once: each gets its own answer, whoever polls first."""
    with scripted(tmp_path, [b"", b"", answer()]) as address:
        session = ControlSession(address)
        session.connect()
        first, second = session.send({"do": "state"}), session.send({"do": "state"})
        assert session.take(second) is None
        session._sort(json.dumps({"id": first, "ok": True, "n": 1}).encode())
        session._sort(json.dumps({"id": second, "ok": True, "n": 2}).encode())
        found = [session.take(second), session.take(first)]

        assert [item and item["n"] for item in found] == [2, 1]
        session.close()


def test_words_that_nobody_asked_for_break_the_session(tmp_path: Path) -> None:
    """A peer that talks by itself is out of step."""
    with scripted(tmp_path, [lambda request: answer()(request) * 2]) as address:
        session = ControlSession(address)
        session.connect()
        with pytest.raises(ControlError, match="though nothing was asked"):
            session.ask({"do": "state"})
        session.close()


def test_request_longer_than_a_line_is_not_sent(tmp_path: Path) -> None:
    """The limit binds both sides."""
    with scripted(tmp_path, [answer()]) as address:
        session = ControlSession(address)
        session.connect()
        with pytest.raises(ControlError, match="65536 at most"):
            session.send({"do": "keys", "held": ["x" * LINE_LIMIT]})
        session.close()


@pytest.mark.parametrize(
    ("address", "text"),
    [
        ("tcp:127.0.0.1", "tcp:HOST:PORT or unix:PATH"),
        ("serial:1", "tcp:HOST:PORT or unix:PATH"),
        ("unix:/nonexistent/socket", "start the control server"),
    ],
)
def test_address_without_a_server_is_told(address: str, text: str) -> None:
    """The remedy is named."""
    session = ControlSession(address)
    with pytest.raises(ControlError, match=text):
        session.connect()
    session.close()


def test_refused_port_is_told() -> None:
    """Nobody listens there."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        number = probe.getsockname()[1]
        session = ControlSession(f"tcp:127.0.0.1:{number}")
        with pytest.raises(ControlError, match="start the control server"):
            session.connect()


def test_session_that_is_not_connected_says_so() -> None:
    """Before connecting and after closing."""
    session = ControlSession("unix:/x")
    with pytest.raises(ControlError, match="not connected"):
        session.send({"do": "state"})
    with contextlib.suppress(ControlError):
        session.close()
