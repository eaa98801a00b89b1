"""When LEDs change, and how they blink, where the bench sees every change (LED-01, 02, 05)."""

from __future__ import annotations

from functools import partial
from itertools import pairwise

import pytest

from hil_tests.acceptance.led_steps import (
    blink_id,
    led_data,
    set_blinking,
    show_both,
    start_dark,
    steady_id,
)
from hil_tests.api import MS, Frame, Interval, KeypadBench, Leds, Limits, NotRun

MARGIN_NS = 5 * MS
"""Beyond the limit, before the light is looked at."""

LEAD_NS = 20 * MS
"""How long the LEDs are watched before the frame is sent."""

PERIODS = 4
"""Blink periods that are watched."""


def needs_edges(bench: KeypadBench, leds: Leds) -> None:
    """Raise NotRun where the bench does not see when an LED changes."""
    if not leds.sees_edges:
        raise NotRun(f"bench {bench.stage.name!r} cannot tell when an LED changes")


def effect_of(
    bench: KeypadBench, leds: Leds, frame: Frame
) -> tuple[int, list[tuple[Interval, str]]]:
    """Send a frame while the LEDs are watched.

    Returns:
        When the frame ended, and the first change of each LED after that.
    """
    begin = len(bench.trace)
    bench.at(bench.now() + LEAD_NS, partial(bench.post, frame))
    watched = leds.watch(LEAD_NS + 2 * bench.profile.limits.led_ns + 100 * MS)
    sent_at = next(
        seen.at for seen in bench.frames_seen(begin) if seen.own and seen.frame == frame
    )
    first: dict[str, Interval] = {}
    for when, name, _ in watched.edges:
        if when.latest >= sent_at:
            first.setdefault(name, when)
    return sent_at, [(when, name) for name, when in first.items()]


@pytest.mark.requirement("LED-01")
def test_steady_light_follows_in_time(bench: KeypadBench, leds: Leds) -> None:
    """All LEDs go on, and off again, within the limit after the frame."""
    needs_edges(bench, leds)
    start_dark(bench)
    limits = Limits(at_most_ns=bench.profile.limits.led_ns)
    for names in (leds.names, ()):
        frame = Frame(steady_id(bench), led_data(bench, names))
        sent_at, effects = effect_of(bench, leds, frame)
        text = f"every LED changes after {frame}; {len(effects)} of {len(leds.names)} did"
        bench.check(len(effects) == len(leds.names), text, since=sent_at)
        for when, name in effects:
            bench.measure_between(sent_at, when, limits, f"{name} after {frame}")


@pytest.mark.requirement("LED-02")
def test_blinking_begins_and_ends_in_time(bench: KeypadBench, leds: Leds) -> None:
    """A lit LED that leaves the maps while it blinks goes dark within the limit, and stays so."""
    needs_edges(bench, leds)
    start_dark(bench)
    led_ns = bench.profile.limits.led_ns
    period_ns = bench.profile.blink_on_ns + bench.profile.blink_off_ns
    name = leds.names[0]
    started = set_blinking(bench, [name]).at
    watched = leds.watch(2 * period_ns)
    first = [when for when, led, _ in watched.edges if led == name]
    lit = watched.start[name]
    text = f"{name} blinks within a period of the frame"
    bench.check(lit or bool(first), text, since=started)
    bench.send(Frame(blink_id(bench), led_data(bench, ())))
    bench.wait(led_ns + MARGIN_NS)
    watched = leds.watch(2 * period_ns)
    dark = not watched.start[name] and not watched.edges
    bench.check(dark, f"{name} is dark after the empty map", since=started)


@pytest.mark.requirement("LED-05", "LED-02")
def test_blink_follows_the_profile(bench: KeypadBench, leds: Leds) -> None:
    """Each complete light and each complete dark of every LED is as long as the profile says."""
    needs_edges(bench, leds)
    start_dark(bench)
    profile = bench.profile
    tolerance_ns = profile.limits.led_ns
    sent = set_blinking(bench, leds.names)
    watched = leds.watch(PERIODS * (profile.blink_on_ns + profile.blink_off_ns))
    for name in leds.names:
        edges = [(when, lit) for when, led, lit in watched.edges if led == name]
        text = f"{name} changes at least {2 * PERIODS - 1} times; it did {len(edges)} times"
        by = "" if edges else "LED-02"
        bench.check(len(edges) >= 2 * PERIODS - 1, text, requirement=by, since=sent)
        for (before, lit), (after, _) in pairwise(edges):
            span_ns = profile.blink_on_ns if lit else profile.blink_off_ns
            limits = Limits(span_ns - tolerance_ns, span_ns + tolerance_ns)
            bench.measure_between(before, after, limits, f"{name} {'on' if lit else 'off'}")


@pytest.mark.requirement("LED-05")
def test_leds_blink_in_step(bench: KeypadBench, leds: Leds) -> None:
    """LEDs that blink together change together, also those that joined later."""
    needs_edges(bench, leds)
    start_dark(bench)
    profile = bench.profile
    set_blinking(bench, leds.names[:1])
    bench.wait((profile.blink_on_ns + profile.blink_off_ns) // 3)
    sent = set_blinking(bench, leds.names)
    bench.wait(profile.blink_on_ns + profile.blink_off_ns)
    watched = leds.watch(PERIODS * (profile.blink_on_ns + profile.blink_off_ns))
    lead = leds.names[0]
    beat = [(when, lit) for when, led, lit in watched.edges if led == lead]
    limits = Limits(-profile.limits.led_ns, profile.limits.led_ns)
    for name in leds.names[1:]:
        edges = [(when, lit) for when, led, lit in watched.edges if led == name]
        nearest = [
            min(
                ((other, when) for other, also in beat if also == lit),
                key=lambda ends: abs(ends[1].since(ends[0]).earliest),
                default=None,
            )
            for when, lit in edges[1:-1]
        ]
        text = f"{name} blinks with {lead}; {len(edges)} changes"
        by = "" if edges and beat else "LED-02"
        right = len(edges) >= PERIODS and None not in nearest
        bench.check(right, text, requirement=by, since=sent)
        for ends in nearest:
            assert ends is not None
            bench.measure_between(*ends, limits, f"{name} changes with {lead}")


@pytest.mark.requirement("LED-03", "LED-20")
def test_steady_light_does_not_flicker(bench: KeypadBench, leds: Leds) -> None:
    """While other LEDs blink, and while maps are written anew, steady LEDs do not change."""
    needs_edges(bench, leds)
    start_dark(bench)
    half, rest = leds.names[::2], leds.names[1::2]
    sent = show_both(bench, leds, half, rest)
    again = (
        Frame(steady_id(bench), led_data(bench, half)),
        Frame(blink_id(bench), led_data(bench, rest)),
    )
    for number, frame in enumerate(again):
        bench.at(bench.now() + (number + 1) * LEAD_NS, partial(bench.post, frame))
    watched = leds.watch(2 * (bench.profile.blink_on_ns + bench.profile.blink_off_ns))
    moved = sorted({led for _, led, _ in watched.edges if led in half})
    lit = all(watched.start[name] for name in half)
    text = f"{', '.join(half)} shine without a break; {', '.join(moved) or 'none'} changed"
    bench.check(lit and not moved, text, since=sent)
