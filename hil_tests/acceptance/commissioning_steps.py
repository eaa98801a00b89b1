"""Steps of the commissioning tests: parameters, the echo, and the start that follows."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import pairwise

import attrs
import pytest

from hil_tests.api import (
    ECHO_PERIOD_NS,
    MS,
    Interval,
    KeypadBench,
    Keys,
    Limits,
    Moment,
    Parameters,
    Seen,
    around,
    cobs,
    exactly,
    judge_periodic,
    matchers,
)

LATE_NS = 3000 * MS
"""How much longer than its limit a key frame is waited for, to tell late from missing."""

HALF_A_STEP_NS = 50 * MS
"""Of the debounce time: nearer than this it is the commissioned one, and not another."""

CROWDED_NS = 50 * MS
"""Boot-up, EMCY and first beats may stand back to back on the bus for that long."""

EXAMPLE = Parameters(5, 3, 100, 0, 1)
"""Node 5, 125 kbit/s, heartbeat 100 ms, debounce 100 ms."""

OTHER = Parameters(9, 3, 250, 7, 2)
"""Differs from the example in everything but the bit rate."""


NEARLY_PPM = 250_000
"""A period this near to the commissioned one is that one; how well it is kept is HB-01."""

LONG_NS = 1500 * MS
"""Longer than any period that a node may have kept from before the example."""


def answer(bench: KeypadBench, request: Seen, parameters: bytes, requirement: str) -> Seen:
    """A request is answered, which is what `requirement` says; and by the right echo in time."""
    bench.seek_answer(request, parameters, requirement)
    bench.expect(
        matchers.anything(), after=request, within=3 * ECHO_PERIOD_NS, requirement=requirement
    )
    return bench.expect_echo(request, parameters)


def anew(bench: KeypadBench) -> None:
    """A device to be commissioned: a new one in virtual time, elsewhere it is as it was left."""
    if bench.stage.virtual:
        bench.fresh()


def waiting(bench: KeypadBench) -> Seen | Moment:
    """The node waits to be commissioned, and is silent before anything was done to it."""
    on = bench.enter_commissioning()
    bench.never(matchers.anything(), after=on, for_ns=LONG_NS, requirement="COM-01")
    return on


def expect_echoes(bench: KeypadBench, since: Seen, parameters: bytes, count: int) -> list[Seen]:
    """The next echoes, all with these parameters and in their rhythm."""
    limits = bench.profile.limits
    echoes = bench.beats(
        matchers.echo(parameters), count, after=since, patience_ns=3 * ECHO_PERIOD_NS
    )
    bench.check(
        len(echoes) == count, f"{count} more echoes come", requirement="COM-05", since=since
    )
    verdict = judge_periodic(
        "echo 3F8h",
        [bench.when(echo) for echo in (since, *echoes)],
        Limits(*limits.echo_each()),
        Limits(*limits.echo_mean()),
        "COM-05",
    )
    if count > 20:
        bench.conclude(verdict, since)
    return echoes


def boots_as(
    bench: KeypadBench,
    parameters: Parameters,
    requirement: str,
    others: Iterable[int] = (),
    taken_for: str = "",
    *,
    sure: bool = True,
) -> Seen:
    """A regular start shows the node id and, being heard at all, the bit rate.

    How the node announces itself is NMT-02. The monitors judge what it did since power-on
    once it is known to be the one that is meant.

    Args:
        bench: the bench.
        parameters: what it was commissioned to.
        requirement: that it starts so. Where that is the bit rate (COM-07) or the node id
            (COM-08), and the other one is wrong, COM-06 is blamed.
        others: node ids that it would have for another reason,
        taken_for: which is this requirement.
        sure: False = with which other parameters is the question; no monitor assumes them.
    """
    if bench.power is None:  # pragma: no cover - commissioning was possible
        pytest.fail("commissioning without Power")
    bench.tolerate_missing_boot_up()
    on = bench.power.on()
    limit_ns = bench.profile.limits.boot_up_ns
    silent = "COM-06" if requirement == "COM-08" else requirement
    bench.expect(matchers.anything(), after=on, within=2 * limit_ns, requirement=silent)
    ids = frozenset(cobs.ERROR_CONTROL + node_id for node_id in others)
    found = bench.collect(matchers.any_of(ids, "another node"), after=on, until=bench.now())
    other = taken_for if found else "COM-06" if requirement == "COM-07" else requirement
    bench.expect(
        matchers.of_a_start(parameters.node_id), after=on, within=2 * limit_ns, requirement=other
    )
    if sure:
        bench.recognised(on, parameters)
    boot_up = matchers.boot_up(parameters.node_id)
    return bench.expect(boot_up, after=on, within=limit_ns, requirement="NMT-02")


def started_with(bench: KeypadBench, **changes: int) -> tuple[Parameters, Seen]:
    """Commissioned to the example with changes, and started: what to, and the boot-up."""
    bench.fresh()
    parameters = attrs.evolve(EXAMPLE, **changes)
    bench.commission(parameters)
    return parameters, boots_as(bench, parameters, "COM-06")


def expect_period(
    bench: KeypadBench, boot: Seen, parameters: Parameters, requirement: str
) -> list[Seen]:
    """Two heartbeats after boot-up are about the period apart (not the crowd right after it).

    Returns:
        Them, and one more where the period is short.
    """
    period_ns, floor_ns = parameters.heartbeat_ns, bench.profile.limits.heartbeat_floor_ns
    begin: Seen | Interval = boot
    if period_ns < CROWDED_NS:
        bench.wait(CROWDED_NS)
        begin = exactly(bench.now())
    beat = matchers.heartbeat(parameters.node_id)
    count = 3 if period_ns < LONG_NS or bench.stage.virtual else 2
    beats = bench.beats(beat, count, after=begin, patience_ns=2 * period_ns + LONG_NS)
    text = f"{count} heartbeats come; there were {len(beats)}"
    bench.check(len(beats) == count, text, requirement="HB-01", since=boot)
    # The nearest: whether all are kept, none lost and none doubled is HB-01, too.
    about_ns = max(period_ns * NEARLY_PPM // 1_000_000, 2 * floor_ns)
    text = f"the heartbeat has a period of about {period_ns // MS} ms"
    one, later = min(pairwise(beats), key=lambda two: _astray(bench, two, period_ns))
    about = around(period_ns, about_ns)
    bench.measure_between(one, later, about, text, requirement=requirement, since=boot)
    return beats


def _astray(bench: KeypadBench, beats: tuple[Seen, Seen], period_ns: int) -> int:
    """How far from its period two heartbeats lie apart."""
    span = bench.when(beats[1]).since(bench.when(beats[0]))
    return abs(span.latest - period_ns)


def press_and_release(bench: KeypadBench, keys: Keys, requirement: str) -> None:
    """One key pressed and released is reported after the debounce time, both ways."""
    bench.wait(bench.profile.limits.command_ns)
    expect_report(bench, keys, keys.press(keys.names[-1]), requirement)
    bench.wait(bench.profile.limits.key_frame_ns)
    if bench.profile.releases_reported:
        expect_report(bench, keys, keys.release(), requirement, missing="KEY-20")


def expect_report(
    bench: KeypadBench, keys: Keys, moved: Moment, requirement: str, *, missing: str = "KEY-02"
) -> None:
    """What the keys did is told after about the debounce time, which is what `requirement` says.

    How exactly that time is kept is KEY-05; that a change is told at all is `missing`.
    """
    limits = bench.profile.limits
    parameters = bench.parameters or EXAMPLE
    debounce_ns = parameters.debounce_ns
    latest = debounce_ns + limits.scan_ns + limits.key_frame_ns
    key_frame = matchers.key_frame(parameters.node_id)
    seen = bench.expect(key_frame, after=moved, within=latest + LATE_NS, requirement=missing)
    about = Limits(debounce_ns - HALF_A_STEP_NS, latest + HALF_A_STEP_NS)
    text = f"{key_frame} after about {debounce_ns // MS} ms"
    bench.measure_between(moved, seen, about, text, requirement=requirement, since=moved)
    allowed = Limits(debounce_ns - limits.scan_ns, latest)
    text = str(key_frame)
    bench.measure_between(moved, seen, allowed, text, requirement="KEY-05", since=moved)
    size = bench.profile.key_frame_bytes
    right = matchers.key_frame(parameters.node_id, keys.mask, size)
    bench.check(
        right.accepts(seen.frame),
        f"{right}; it was {seen.frame}",
        requirement="KEY-03",
        since=moved,
    )
