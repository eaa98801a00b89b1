"""The verbs of the control protocol, asked for over a socket, turn by turn."""

from __future__ import annotations

import json
from typing import Any

import pytest

from node_model.frame import Frame
from node_model.host.jsonline import LINE_LIMIT
from node_model.host.loop import LATE_NS
from node_model.host.verbs import Verbs
from node_model.node import MS, S
from tests.host.fakes import PERIOD_NS
from tests.host.lab import Lab


def test_hello_tells_what_it_can(lab: Lab) -> None:
    """Protocol 1, the name of the device, its verbs, and the clock."""
    can = ["power", "keys", "key-sequences", "leds", "led-edges", "bus", "health", "faults"]

    assert lab.ask(do="hello", protocol=1) == {
        "id": 1, "ok": True, "protocol": 1, "device": "fake", "can": can, "clock": "same",
    }  # fmt: skip


def test_power_is_idempotent_and_exact(lab: Lab) -> None:
    """`at` is the very instant that the node was told; on when on changes nothing."""
    answer = lab.ask(do="power", on=True)
    assert [int(at * S) for at in answer["at"]] == [lab.clock.now] * 2
    lab.clock.now += 10 * MS
    lab.ask(do="power", on=True)

    assert [frame for frame, _ in lab.wire.sent] == [Frame(0x701, b"\0")]
    assert lab.ask(do="state")["power"] is True
    assert lab.ask(do="power", on=False)["ok"] is True
    assert lab.ask(do="state") == {"id": 1, "ok": True, "power": False, "held": []}


@pytest.mark.parametrize("request_", [{"do": "power", "on": False}, {"do": "bus", "bitrate": 1}])
def test_a_beat_due_at_a_silence_is_sent_before_it(lab: Lab, request_: dict[str, object]) -> None:
    """What is sent while the host catches up lies inside `at`.

    Over vcan a heartbeat that was due as the supply went was once stamped 32 us after it.
    """
    lab.ask(do="power", on=True)
    lab.wire.takes_ns = 32_000
    lab.clock.now += PERIOD_NS

    answer = Verbs(lab.loop)(request_)

    assert isinstance(answer, dict)
    when = answer["at"]
    assert isinstance(when, tuple)
    began, ended = map(int, when)
    frame, stamp = lab.wire.sent[-1]
    assert frame.data != b"\0"
    assert began < stamp <= ended


def test_keys_are_held_until_told_otherwise(lab: Lab) -> None:
    """The full set each time; state names it in the order of the bits."""
    lab.ask(do="keys", held=["b", "a"])
    assert lab.ask(do="state")["held"] == ["a", "b"]
    lab.ask(do="keys", held=[])

    assert lab.ask(do="state")["held"] == []


def test_errors_exist_until_told_otherwise(lab: Lab) -> None:
    """The full set each time; the node feels it at one instant, and says what it has to say."""
    lab.ask(do="power", on=True)
    answer = lab.ask(do="faults", active=["open", "short"])
    assert answer["at"][0] == answer["at"][1]
    lab.ask(do="faults", active=[])

    assert [frame for frame, _ in lab.wire.sent[-2:]] == [Frame(0x081, b"\2"), Frame(0x081, b"\0")]


@pytest.mark.parametrize(
    ("active", "why"),
    [
        (["opn"], "no fault 'opn'; it has open"),
        (["x"], "no fault 'x'; it has short, open"),
        ("open", "faults are a list of names, not 'open'"),
        (None, "faults are a list of names, not None"),
    ],
)
def test_errors_that_the_node_has_not_are_refused(lab: Lab, active: object, why: str) -> None:
    """With the near misses, as for keys."""
    answer = lab.ask(do="faults", active=active)
    assert (answer["ok"], answer["error"]) == (False, why)


def test_a_node_without_errors_says_so(lab: Lab) -> None:
    """Then `can` has no faults in it."""
    lab.node.faults = ()
    assert "faults" not in lab.ask(do="hello", protocol=1)["can"]
    assert lab.ask(do="faults", active=["x"])["error"] == "no fault 'x'; it has none"


def test_sequence_is_played_at_planned_instants(lab: Lab) -> None:
    """A host that comes round late does not shift the edges."""
    lab.ask(do="power", on=True)
    start = lab.clock.now
    lab.send(b'{"id": 5, "do": "keys", "sequence": [[0, ["a"]], [0.004, []], [0.007, ["b"]]]}\n')
    assert not lab.answers()
    lab.turn(50 * MS)
    (answer,) = lab.answers()

    spans = [0, 4 * MS, 7 * MS]
    assert [[int(at * S) - start for at in pair] for pair in answer["at"]] == [
        [span, span] for span in spans
    ]
    holds = [(verb, at - start) for verb, at in lab.node.log if verb.startswith("hold")]
    assert holds == [("hold ['a']", 0), ("hold []", 4 * MS), ("hold ['b']", 7 * MS)]


def test_requests_wait_for_the_sequence_before_them(lab: Lab) -> None:
    """Answers come in the order of the requests."""
    lab.send(
        b'{"id": 1, "do": "keys", "sequence": [[0, ["a"]], [1, []]]}\n{"id": 2, "do": "state"}\n'
    )
    assert not lab.answers()
    lab.turn(S)

    assert [answer["id"] for answer in lab.answers()] == [1, 2]


def test_steady_leds_are_answered_at_once(lab: Lab) -> None:
    """Where no lamp will change by itself there is nothing to wait for."""
    assert lab.ask(do="leds")["leds"] == {"red": "off", "green": "off"}


def test_blinking_leds_are_watched_for_a_period(lab: Lab) -> None:
    """An eye looks longer than one blink; steady is told from blinking."""
    lab.ask(do="power", on=True)
    lab.wire.incoming.append((Frame(0x123, b"\1"), lab.clock.now))
    lab.send(b'{"id": 1, "do": "leds"}\n')
    assert not lab.answers()
    lab.turn(1199 * MS)
    assert not lab.answers()
    lab.turn(MS)

    assert lab.answers() == [{"id": 1, "ok": True, "leds": {"red": "blink", "green": "on"}}]


def test_led_edges_have_their_instants(lab: Lab) -> None:
    """Edges by themselves and by a frame, in order, on the clock of the frames."""
    lab.ask(do="power", on=True)
    start = lab.clock.now
    lab.send(b'{"id": 1, "do": "leds", "for": 1.1}\n')
    lab.wire.incoming.append((Frame(0x123, b"\1"), start + 700 * MS))
    lab.turn(5 * S)
    (answer,) = lab.answers()

    assert answer["start"] == {"red": True, "green": False}
    assert [[int(at * S) - start, led, lit] for at, led, lit in answer["edges"]] == [
        [500 * MS, "red", False],
        [700 * MS, "green", True],
        [1000 * MS, "red", True],
    ]
    assert [int(at * S) - start for at in answer["at"]] == [0, 1100 * MS]


def test_bus_makes_the_node_deaf_and_mute(lab: Lab) -> None:
    """At another bit rate nobody hears it."""
    lab.ask(do="power", on=True)
    lab.wire.sent.clear()
    assert lab.ask(do="bus", bitrate=500_000)["ok"] is True
    lab.turn(PERIOD_NS)
    assert not lab.wire.sent
    assert lab.ask(do="state")["bus"] == 500_000
    lab.ask(do="bus", bitrate=125_000)
    lab.turn(PERIOD_NS)

    assert lab.wire.sent


def test_health_tells_late_frames_once(lab: Lab) -> None:
    """Exact to the nanosecond; asking empties the list."""
    lab.ask(do="power", on=True)
    start = lab.clock.now
    lab.turn(PERIOD_NS + LATE_NS + 1)
    late = lab.ask(do="health")["late"]

    assert [[int(at * S) - start for at in pair] for pair in late] == [
        [PERIOD_NS, PERIOD_NS + LATE_NS + 1]
    ]
    assert lab.ask(do="health")["late"] == []


def test_long_list_of_late_frames_comes_in_several_answers(lab: Lab) -> None:
    """No line has more than 64 KiB; `more` says that there is more."""
    lab.loop.late.extend((lab.clock.now, lab.clock.now + number) for number in range(3000))
    answers = [lab.ask(do="health") for _ in range(4)]

    assert [len(answer["late"]) for answer in answers] == [1200, 1200, 600, 0]
    assert [answer.get("more", False) for answer in answers] == [True, True, False, False]


MALFORMED = [
    b"",
    b"nonsense",
    b"[1]",
    b'"hello"',
    b"\xff\xfe",
    b"[" * 60_000,
    b'{"id": 1, "do": "power", "on": NaN}',
    b"x" * (LINE_LIMIT + 1),
    b"y" * (5 * LINE_LIMIT),
]


@pytest.mark.parametrize("line", MALFORMED, ids=lambda line: repr(line[:12]))
def test_malformed_line_is_refused_and_the_session_goes_on(line: bytes, lab: Lab) -> None:
    """One refusal without an id, then the next request as if nothing had been."""
    lab.send(line + b'\n{"id": 2, "do": "state"}\n')
    refusal, answer = lab.answers()

    assert (refusal["id"], refusal["ok"]) == (None, False)
    assert refusal["error"]
    assert (answer["id"], answer["ok"]) == (2, True)


REFUSED: list[dict[str, Any]] = [
    {},
    {"do": None},
    {"do": "fly"},
    {"do": ["power"]},
    {"do": "hello"},
    {"do": "hello", "protocol": 2},
    {"do": "hello", "protocol": True},
    {"do": "hello", "protocol": "1"},
    {"do": "power"},
    {"do": "power", "on": 1},
    {"do": "power", "on": "yes"},
    {"do": "keys"},
    {"do": "keys", "held": "a"},
    {"do": "keys", "held": ["c"]},
    {"do": "keys", "held": [["a"]]},
    {"do": "keys", "held": {"a": 1}},
    {"do": "keys", "held": [], "sequence": []},
    {"do": "keys", "sequence": []},
    {"do": "keys", "sequence": [[0, ["a"]]] * 1001},
    {"do": "keys", "sequence": [[0]]},
    {"do": "keys", "sequence": [0]},
    {"do": "keys", "sequence": [[0, ["c"]]]},
    {"do": "keys", "sequence": [[-1, ["a"]]]},
    {"do": "keys", "sequence": [[1, ["a"]], [0, []]]},
    {"do": "keys", "sequence": [["0", ["a"]]]},
    {"do": "keys", "sequence": [[0, ["a"]], [601, []]]},
    {"do": "leds", "for": 0},
    {"do": "leds", "for": -1},
    {"do": "leds", "for": "2"},
    {"do": "leds", "for": 1e300},
    {"do": "bus"},
    {"do": "bus", "bitrate": 0},
    {"do": "bus", "bitrate": True},
    {"do": "bus", "bitrate": 125000.5},
    {"do": "bus", "bitrate": 10**30},
]


@pytest.mark.parametrize("request_", REFUSED, ids=lambda item: json.dumps(item)[:50])
def test_request_that_cannot_be_done_is_refused(request_: dict[str, Any], lab: Lab) -> None:
    """With its id and one sentence; the node is not touched, the session goes on."""
    answer = lab.ask(**request_)

    assert (answer["id"], answer["ok"]) == (1, False)
    assert 0 < len(answer["error"]) < 300
    assert not lab.node.log
    assert lab.ask(do="state")["ok"] is True


def test_unknown_key_names_near_misses(lab: Lab) -> None:
    """The sentence shows the name and what there is."""
    assert lab.ask(do="keys", held=["c"])["error"] == "no key 'c'; it has a, b"
