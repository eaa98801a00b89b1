"""LED frames in commissioning: what they light is told from what the node shows by itself."""

from __future__ import annotations

from collections.abc import Sequence

import pytest

from hil_tests.clock import Interval
from hil_tests.judge.darkness import judge_darkness
from hil_tests.judge.echoes import Echo, Request, Stay
from hil_tests.judge.lights import Look
from node_model.frame import Frame

LEDS = {"a": 0, "b": 1}
MAP = Frame(0x206, b"\x01")
BLINK = Frame(0x30F, b"\x01")


def blamed(
    looks: Sequence[tuple[int, str, str]], *sent: tuple[int, Frame], echo_at: int | None = 5
) -> list[str]:
    """What is blamed where the two LEDs showed that at those instants."""
    echoes = [] if echo_at is None else [Echo(Interval(echo_at, echo_at), bytes(6))]
    stay = Stay(0, [Request(at, frame) for at, frame in sent], echoes, 1000)
    seen = [Look(at, {"a": a, "b": b}, operational=False) for at, a, b in looks]
    return [verdict.requirement for verdict in judge_darkness(seen, stay, LEDS)]


LIT = [(10, "off", "off"), (20, "off", "off"), (40, "on", "off")]


@pytest.mark.parametrize("frame", [MAP, BLINK])
def test_a_light_that_a_frame_lit(frame: Frame) -> None:
    """While it echoes (COM-12), or while it waits (COM-03); told once."""
    assert blamed(LIT, (30, frame)) == ["COM-12"]
    assert blamed(LIT, (30, frame), echo_at=None) == ["COM-03"]
    assert blamed([*LIT, *((at + 100, a, b) for at, a, b in LIT)], (30, frame)) == ["COM-12"]


def test_dark_is_right() -> None:
    """And so is a light that was there before."""
    assert blamed([(at, "off", "off") for at in (10, 20, 40)], (30, MAP)) == []
    assert blamed([(at, "blink", "on") for at in (10, 20, 40)], (30, MAP)) == []
    assert blamed(LIT[1:], (30, MAP)) == []
    assert blamed([], (30, MAP)) == []


def test_a_node_may_show_that_it_waits() -> None:
    """A light that comes and goes, or that no frame would light, is its own."""
    assert blamed([(10, "on", "off"), *LIT[1:]], (30, MAP)) == []
    assert blamed([*LIT[:2], (40, "off", "on")], (30, MAP)) == []
    assert blamed([(10, "on", "off"), (20, "on", "off"), (40, "off", "off")], (30, MAP)) == []
    assert blamed(LIT) == []


@pytest.mark.parametrize(
    "other",
    [
        Frame(0x4F8, bytes(6)),
        Frame(0x210, b"\x01"),
        Frame(0x206),
        Frame(0x206, remote=True, dlc=1),
        Frame(0x206, b"\x01", extended=True),
    ],
)
def test_other_frames_may_have_led_to_it(other: Frame) -> None:
    """Whatever is no LED frame of a keypad, between the looks or before them."""
    assert blamed(LIT, (30, MAP), (35, other)) == []
    assert blamed(LIT, (15, other), (30, MAP)) == []
    assert blamed(LIT, (9, other), (30, MAP), (41, other)) == ["COM-12"]


@pytest.mark.parametrize(
    ("echo_at", "names"), [(9, ["COM-12"]), (10, []), (40, []), (41, ["COM-03"])]
)
def test_the_first_echo_may_show(echo_at: int, names: list[str]) -> None:
    """A sign that it has been commissioned comes with the first echo."""
    assert blamed(LIT, (30, MAP), echo_at=echo_at) == names
