"""Steps of the commissioning tests: parameters, the echo, and the start that follows."""

from __future__ import annotations

import attrs
import pytest

from hil_tests.api import (
    ECHO_PERIOD_NS,
    MS,
    Bench,
    Keys,
    Limits,
    Parameters,
    Seen,
    judge_periodic,
    matchers,
)

CROWDED_NS = 50 * MS
"""Boot-up, EMCY and first beats may stand back to back on the bus for that long."""

EXAMPLE = Parameters(5, 3, 100, 0, 1)
"""Node 5, 125 kbit/s, heartbeat 100 ms, debounce 100 ms."""

OTHER = Parameters(9, 3, 250, 7, 2)
"""Differs from the example in everything but the bit rate."""


READINGS = "COM-20"
"""From here on the requirements are our readings of a source that is silent."""


def first_echo(bench: Bench, request: Seen, parameters: bytes) -> Seen:
    """The first echo, in time."""
    return bench.expect(
        matchers.echo(parameters),
        after=request,
        within=ECHO_PERIOD_NS + bench.profile.limits.echo_each_ns,
        requirement="COM-05",
    )


def expect_echoes(bench: Bench, since: Seen, parameters: bytes, count: int) -> list[Seen]:
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


def boots_as(bench: Bench, parameters: Parameters, requirement: str) -> Seen:
    """A regular start shows the node id and, being heard at all, the bit rate."""
    if bench.power is None:  # pragma: no cover - commissioning was possible
        pytest.fail("commissioning without Power")
    if requirement >= READINGS:
        bench.tolerate_missing_boot_up()  # else a monitor would hold our reading against a must
    on = bench.power.on()
    return bench.expect(
        matchers.boot_up(parameters.node_id),
        after=on,
        within=bench.profile.limits.boot_up_ns,
        requirement=requirement,
    )


def started_with(bench: Bench, **changes: int) -> tuple[Parameters, Seen]:
    """Commissioned to the example with changes, and started: what to, and the boot-up."""
    bench.fresh()
    parameters = attrs.evolve(EXAMPLE, **changes)
    bench.commission(parameters)
    return parameters, boots_as(bench, parameters, "COM-06")


def expect_period(bench: Bench, boot: Seen, parameters: Parameters, requirement: str) -> None:
    """Two heartbeats follow boot-up, the period apart (not the crowd right after it)."""
    limits = bench.expected(parameters).heartbeat_each
    beat = matchers.heartbeat(parameters.node_id)
    begin: Seen | int = boot
    if parameters.heartbeat_ns < CROWDED_NS:
        bench.wait(CROWDED_NS)
        begin = bench.now()
    first = bench.expect(beat, after=begin, within=limits.at_most_ns, requirement=requirement)
    bench.expect(beat, after=first, within=limits, requirement=requirement)


def press_and_release(bench: Bench, keys: Keys, requirement: str) -> None:
    """One key pressed and released is reported after the debounce time, both ways."""
    limits = bench.profile.limits
    parameters = bench.parameters or EXAMPLE
    latest = parameters.debounce_ns + limits.scan_ns + limits.key_frame_ns
    early = parameters.debounce_ns - limits.scan_ns
    allowed = Limits(early, latest) if early > 0 else Limits(at_most_ns=latest)
    name, size = keys.names[-1], bench.profile.key_frame_bytes
    bench.wait(limits.command_ns)
    pressed = keys.press(name)
    bench.expect(
        matchers.key_frame(parameters.node_id, keys.mask, size),
        after=pressed,
        within=allowed,
        requirement=requirement,
    )
    if bench.profile.releases_reported:
        released = keys.release()
        bench.expect(
            matchers.key_frame(parameters.node_id, 0, size),
            after=released,
            within=allowed,
            requirement=requirement,
        )
