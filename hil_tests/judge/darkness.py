"""LED frames light nothing in commissioning (COM-03, COM-12).

What the LEDs show there is the maker's: dark, or some sign that the node waits. So two looks
must agree before the frames, and what a third one shows besides must be what they would light.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise

from hil_tests.judge.cobs import LED_BLINK, LED_STEADY
from hil_tests.judge.echoes import NODE_IDS, Stay
from hil_tests.judge.lights import Look
from hil_tests.judge.verdict import Outcome, Verdict
from node_model.frame import Frame

_MAPS = frozenset(base + node_id for base in (LED_STEADY, LED_BLINK) for node_id in NODE_IDS)


def judge_darkness(
    looks: Sequence[Look], stay: Stay, leds: Mapping[str, int]
) -> Iterator[Verdict]:
    """The first look at LEDs that frames have lit.

    Args:
        looks: at the LEDs in that stay, in order.
        stay: what was sent, and the echoes.
        leds: bit by name.
    """
    for (first, second), (_, third) in pairwise(pairwise(looks)):
        lit = [led for led, light in third.lights.items() if light != second.lights[led]]
        quiet = first.lights == second.lights and not _sent(stay, first.at, second.at)
        frames = _sent(stay, second.at, third.at)
        if not lit or not quiet or not frames or not all(map(_is_map, frames)):
            continue
        shown = sum(1 << leds[led] for led in lit if third.lights[led] != "off")
        written = _written(frames)
        begun = [echo for echo in stay.echoes[:1] if echo.wanted.latest < first.at]
        if shown and not shown & ~written and (begun or not _began_by(stay, third.at)):
            name = "COM-12" if begun else "COM-03"
            text = f"in commissioning {', '.join(lit)} follow {frames[-1]}"
            yield Verdict(name, Outcome.FAIL, text, at=third.at)
            return


def _sent(stay: Stay, after: int, until: int) -> list[Frame]:
    """What the tester sent between two looks."""
    return [each.frame for each in stay.requests if after < each.at <= until]


def _is_map(frame: Frame) -> bool:
    plain = not frame.extended and not frame.remote
    return frame.can_id in _MAPS and plain and bool(frame.data)


def _written(frames: Sequence[Frame]) -> int:
    """Every LED that one of the frames would light."""
    written = 0
    for frame in frames:
        written |= int.from_bytes(frame.data, "little")
    return written


def _began_by(stay: Stay, until: int) -> bool:
    """Whether the echo may have begun by then, and a sign of it with it."""
    return any(echo.wanted.earliest <= until for echo in stay.echoes[:1])
