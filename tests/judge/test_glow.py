"""The oracle of changing and blinking lights (LED-01, LED-02, LED-05)."""

from __future__ import annotations

from collections.abc import Sequence

import pytest

from hil_tests.clock import MS, Interval, exactly
from hil_tests.judge.glow import Change, GlowRules, Watched, judge_glow, shown
from hil_tests.judge.verdict import Outcome

RULES = GlowRules(led_ns=50 * MS, on_ns=500 * MS, off_ns=500 * MS)


def changes(led: str, *at_ms: float, lit: bool = True) -> list[Change]:
    """Changes of one LED, on and off in turn."""
    return [
        (exactly(round(at * MS)), led, lit if number % 2 == 0 else not lit)
        for number, at in enumerate(at_ms)
    ]


def watched(
    *edges: Change,
    start: Sequence[str] = (),
    written_ms: float = 0,
    blink: bool = False,
    until_ms: float = 2500,
) -> Watched:
    """A stretch from 0 on, of two LEDs."""
    first = {led: led in start for led in ("a", "b")}
    in_order = sorted(edges, key=lambda change: change[0].earliest)
    return Watched(0, round(until_ms * MS), first, in_order, round(written_ms * MS), blink)


def wrong(stretch: Watched) -> list[str]:
    """Which requirements are broken."""
    found = list(judge_glow(stretch, RULES))
    assert all(verdict.outcome is Outcome.FAIL for verdict in found)
    assert all(verdict.at == stretch.ended_at for verdict in found)
    return [verdict.requirement for verdict in found]


def test_what_leds_come_to_show() -> None:
    """Steady as it ends, blinking where it goes on changing."""
    stretch = watched(*changes("a", 20), *changes("b", 20, 520, 1020, 1520, 2020))
    look = shown(stretch, RULES)
    assert look is not None
    assert (look.lights, look.at) == ({"a": "on", "b": "blink"}, stretch.ended_at)
    dark = shown(watched(*changes("a", 20, lit=False), start="ab"), RULES)
    assert dark is not None
    assert dark.lights == {"a": "off", "b": "on"}


@pytest.mark.parametrize(("until_ms", "told"), [(2100, True), (2099, False)])
def test_two_blink_periods_tell_the_light(until_ms: int, told: bool) -> None:
    """They count from twice the limit after the last frame; less of it is not judged."""
    stretch = watched(*changes("a", 99), until_ms=until_ms)
    assert (shown(stretch, RULES) is not None) is told
    assert bool(wrong(stretch)) is told


@pytest.mark.parametrize(
    ("at_ms", "blink", "broken"),
    [(50, False, []), (51, False, ["LED-01"]), (51, True, ["LED-02"])],
)
def test_a_steady_light_follows_in_time(at_ms: int, blink: bool, broken: list[str]) -> None:
    """The last frame says which of the two maps is late."""
    assert wrong(watched(*changes("a", at_ms), blink=blink)) == broken


def test_doubt_is_no_failure() -> None:
    """A change that may have been in time is not held against the device."""
    edge = (Interval(50 * MS, 52 * MS), "a", True)
    assert wrong(watched(edge)) == []


def test_a_light_that_changes_without_a_frame() -> None:
    """A flash is late twice; long after a frame it is no steady light at all."""
    look = shown(watched(*changes("a", 30, 60), written_ms=-1000), RULES)
    assert look is not None
    assert look.lights["a"] == "blink"
    assert wrong(watched(*changes("a", 30, 60), written_ms=-30)) == ["LED-01", "LED-01"]


@pytest.mark.parametrize(
    ("edges", "broken"),
    [
        ((20, 520, 1020, 1520, 2020), []),
        ((20, 450 + 20, 1020, 1520, 2020), []),
        ((120, 670, 1170, 1670, 2170), []),
        ((120, 671, 1170, 1670, 2170), ["LED-05"]),
        ((120, 569, 1069, 1569, 2069), ["LED-05"]),
        ((120, 570, 1070, 1570, 2070), []),
        ((120, 620, 1171, 1671, 2171), ["LED-05"]),
    ],
)
def test_a_blinking_light_keeps_its_times(edges: tuple[int, ...], broken: list[str]) -> None:
    """Each complete light and dark, 50 ms up or down; what the frame cut short does not count."""
    assert wrong(watched(*changes("a", *edges))) == broken


@pytest.mark.parametrize(("by_ms", "broken"), [(50, 0), (-50, 0), (51, 3), (-51, 3), (250, 3)])
def test_lights_blink_in_step(by_ms: int, broken: int) -> None:
    """Each change of one but its first and last has one of the other within 50 ms."""
    beat = (200, 700, 1200, 1700, 2200)
    stretch = watched(*changes("a", *beat), *changes("b", *(at + by_ms for at in beat)))
    assert wrong(stretch) == ["LED-05"] * broken


def test_a_light_that_blinks_alone_has_no_step() -> None:
    """One that changes once only is judged by what it shows, elsewhere."""
    stretch = watched(*changes("a", 200, 700, 1200, 1700, 2200), *changes("b", 1200))
    assert wrong(stretch) == []
    three = watched(*changes("a", 1200), *changes("b", 700, 1200, 1700, lit=False))
    assert wrong(three) == []
