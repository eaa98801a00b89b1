"""How LEDs change and blink, where the bench sees every change of light (LED-01, LED-02, LED-05).

`lights` says what the LEDs may show; here it is about when. Each stretch that was watched is
judged by itself: what the LEDs came to show in it is taken as given.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import combinations, pairwise
from typing import NamedTuple

from hil_tests.clock import Interval
from hil_tests.judge.lights import Look
from hil_tests.judge.verdict import Limits, Outcome, Verdict

LOOKED_FOR_PERIODS = 2
"""Blink periods without a change after which an LED is taken for steady."""

Change = tuple[Interval, str, bool]
"""When, which LED, on or off."""


class Watched(NamedTuple):
    """A stretch of time in which every change of light was seen, the device operational.

    Args:
        began_at, ended_at: ns.
        start: which LEDs were lit at its beginning.
        edges: in order of time.
        written_at: the end of the last frame before its end that may change a light.
        blink: that frame carried the map of blinking LEDs.
    """

    began_at: int
    ended_at: int
    start: Mapping[str, bool]
    edges: Sequence[Change]
    written_at: int
    blink: bool


class GlowRules(NamedTuple):
    """Facts and limits of a device, in ns.

    Args:
        led_ns: how long a frame may take to show, and how far a blinking light may be off.
        on_ns, off_ns: of a blinking light.
    """

    led_ns: int
    on_ns: int
    off_ns: int


def shown(watched: Watched, rules: GlowRules) -> Look | None:
    """What the LEDs came to show; None where the stretch is too short to tell.

    A light that follows its frame late, but not later than twice the limit, counts as it ends.
    """
    since = _settled_at(watched, rules)
    if watched.ended_at - since < LOOKED_FOR_PERIODS * (rules.on_ns + rules.off_ns):
        return None
    lit = dict(watched.start)
    lights: dict[str, str] = {}
    for when, led, on in watched.edges:
        lit[led] = on
        if when.latest > since:
            lights[led] = "blink"
    steady = {led: "on" if on else "off" for led, on in lit.items()}
    return Look(watched.ended_at, {**steady, **lights}, operational=True)


def _settled_at(watched: Watched, rules: GlowRules) -> int:
    """From here on what the last frame wants is shown for sure, by a late light, too."""
    return max(watched.began_at, watched.written_at + 2 * rules.led_ns)


def judge_glow(watched: Watched, rules: GlowRules) -> Iterator[Verdict]:
    """What is certainly wrong in one stretch; nothing, where it is too short to tell."""
    look = shown(watched, rules)
    if look is None:
        return
    blinking = [led for led, light in look.lights.items() if light == "blink"]
    yield from _late(watched, rules, frozenset(look.lights) - frozenset(blinking))
    since = _settled_at(watched, rules)
    edges = [each for each in watched.edges if each[0].earliest > since]
    settled = {led: [each for each in edges if each[1] == led] for led in blinking}
    for led in blinking:
        yield from _uneven(watched, rules, settled[led])
    for lead, led in combinations(blinking, 2):
        yield from _out_of_step(watched, rules, settled[lead], settled[led])


def _late(watched: Watched, rules: GlowRules, steady: frozenset[str]) -> Iterator[Verdict]:
    """LEDs that are steady in the end, and changed longer after the frame than they may."""
    limits = Limits(at_most_ns=rules.led_ns)
    written = Interval(watched.written_at, watched.written_at)
    for when, led, lit in watched.edges:
        after = when.since(written)
        if led in steady and limits.check(after) is Outcome.FAIL:
            text = f"{led} goes {'on' if lit else 'off'} after the last LED frame"
            yield _failed("LED-02" if watched.blink else "LED-01", text, after, limits, watched)


def _uneven(watched: Watched, rules: GlowRules, edges: Sequence[Change]) -> Iterator[Verdict]:
    """Complete lights and complete darks of one LED that last too long, or not long enough."""
    for (before, led, lit), (after, _, _) in pairwise(edges):
        span_ns = rules.on_ns if lit else rules.off_ns
        limits = Limits(span_ns - rules.led_ns, span_ns + rules.led_ns)
        lasted = after.since(before)
        if limits.check(lasted) is Outcome.FAIL:
            text = f"{led} blinks: one time {'on' if lit else 'off'}"
            yield _failed("LED-05", text, lasted, limits, watched)


def _out_of_step(
    watched: Watched, rules: GlowRules, lead: Sequence[Change], edges: Sequence[Change]
) -> Iterator[Verdict]:
    """Changes of one blinking LED that are not those of another one."""
    limits = Limits(-rules.led_ns, rules.led_ns)
    for when, led, lit in edges[1:-1]:
        spans = [when.since(other) for other, _, also in lead if also is lit]
        nearest = min(spans, key=lambda span: abs(span.earliest), default=None)
        if nearest is not None and limits.check(nearest) is Outcome.FAIL:
            text = f"{led} goes {'on' if lit else 'off'} with {lead[0][1]}, which blinks, too"
            yield _failed("LED-05", text, nearest, limits, watched)


def _failed(name: str, text: str, span: Interval, limits: Limits, watched: Watched) -> Verdict:
    """Told at the end of the stretch: what they show is judged then, and told before."""
    return Verdict(name, Outcome.FAIL, text, span, limits, watched.ended_at)
