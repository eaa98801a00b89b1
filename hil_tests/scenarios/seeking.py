"""A device that did not start is looked for, before anybody is blamed for its silence.

Silence may be a start that needs a longer pause than it must (NMT-02), or a start at another
bit rate (COM-07). Both look alike until somebody waits longer, or listens elsewhere.
"""

from __future__ import annotations

from typing import NamedTuple

from hil_tests.api import MS, KeypadBench, Moment, Parameters, matchers
from hil_tests.clock import show_span
from hil_tests.judge.matchers import Matcher
from hil_tests.scenarios.origins import Origin

LONG_PAUSE_NS = 2_000 * MS

RATES = (500_000, 250_000, 125_000, 100_000, 50_000, 20_000, 1_000_000, 800_000, 10_000)
"""Those of the keypad first, then the others of CiA 301 4.2.0, 5.2."""

NAMED = 6
"""So many are the keypad's: a real bench, where each try takes seconds, tries no others."""


class Sought(NamedTuple):
    """How a device starts that did not start as it should.

    Args:
        rate: at which bit rate, in bit/s.
        needs_pause: only after a long pause; after the shortest one, again, not.
    """

    rate: int
    needs_pause: bool = False

    def __str__(self) -> str:
        if self.needs_pause:
            return (
                f"it starts after a pause of {show_span(LONG_PAUSE_NS)}, and not after a short one"
            )
        return f"it starts at {self.rate} bit/s"


def sought(bench: KeypadBench, start: Matcher) -> Sought | None:
    """Switch a silent device on again, after a longer pause, and at other bit rates.

    Args:
        bench: it is at the device's bit rate; no monitor judges what the device does now.
        start: what tells that it has started.

    Returns:
        None where it starts nowhere.
    """
    own = bench.stage.bit_rate
    if needs_pause(bench, start):
        return Sought(own, needs_pause=True)
    if _starts(bench, start, LONG_PAUSE_NS):
        return Sought(own)
    if bench.bitrate is None or not bench.stage.exclusive:
        return None
    for rate in RATES if bench.stage.virtual else RATES[:NAMED]:
        if rate != own:
            bench.tune(rate)
            if _starts(bench, start, 0):
                return Sought(rate)
    bench.tune(own)
    return None


def needs_pause(bench: KeypadBench, start: Matcher) -> bool:
    """Whether a silent device starts after a long pause, and after the shortest one not."""
    return _starts(bench, start, LONG_PAUSE_NS) and not _starts(bench, start, 0)


def is_silent(bench: KeypadBench, on: Moment) -> bool:
    """Whether the bus was free, so that nothing of the start can have been missed."""
    bench.settle()
    due_at = on.ended_at + bench.profile.limits.boot_up_ns
    return bench.watch.quiet_from(bench.known_until) > due_at


def _starts(bench: KeypadBench, start: Matcher, pause_ns: int) -> bool:
    assert bench.power is not None
    bench.power.off()
    bench.wait(pause_ns)
    on = bench.power.on()
    return bench.first(start, on, on.ended_at + bench.profile.limits.boot_up_ns) is not None


def seek(bench: KeypadBench, own: Parameters, on: Moment, origin: Origin) -> None:
    """Nothing came of a start: look for it, before its silence is blamed.

    Raises:
        DeviceFailure: it was found.
    """
    boot_up = matchers.boot_up(own.node_id)
    bench.tolerate_missing_boot_up()
    if bench.keys is not None and bench.held:
        bench.keys.release()
        if _starts(bench, boot_up, 0):
            text = f"expected {boot_up}; none came: it starts with no key held"
            bench.fail(text, requirement=origin.blames, since=on)
        origin.keys_tell_nothing()
    found = sought(bench, boot_up)
    if found is None:
        return
    if found.needs_pause:
        origin.blamed("NMT-02")
    elif found.rate != own.bit_rate:
        origin.elsewhere(own, found.rate)
    bench.fail(f"expected {boot_up}; none came: {found}", requirement=origin.blames, since=on)


def seek_after_pause(bench: KeypadBench, start: Matcher, on: Moment) -> None:
    """As `seek`, where the device may be one of two: that it needs a pause can be told."""
    if is_silent(bench, on) and needs_pause(bench, start):
        found = Sought(bench.stage.bit_rate, needs_pause=True)
        bench.fail(f"expected {start}; none came: {found}", requirement="NMT-02", since=on)
