"""The period, the content and the beginning of the heartbeat (HB-01..03, HB-05, HB-06)."""

from __future__ import annotations

import pytest

from hil_tests.acceptance.cadence import (
    judge_row,
    next_beat,
    period_ns,
    row,
    settle_in,
    some_row,
)
from hil_tests.acceptance.nmt_steps import QUICK, RESETS, RUNNING_STATES, enter, name_of
from hil_tests.api import MS, Chance, KeypadBench, Nmt, Power, S, State, exactly, matchers

PERIODS_MS = (10, 20, 100, 256, 1000, 65535)
"""256 is 0100h: with its bytes swapped it would be 1 ms."""

RATES = {1: 500_000, 2: 250_000, 3: 125_000, 4: 100_000, 5: 50_000, 6: 20_000}
"""The source's table: bit/s by code."""

SHOWN = {State.PRE_OPERATIONAL: "7F", State.OPERATIONAL: "05", State.STOPPED: "04"}
"""Literal bytes (CiA 301, 7.2.8.3.2.2)."""


def rate_name(code: int) -> str:
    """A readable id for a bit-rate code."""
    return f"{RATES[code] // 1000}k"


@pytest.mark.requirement("HB-01")
@pytest.mark.parametrize("state", RUNNING_STATES, ids=name_of)
def test_period_in_every_state(bench: KeypadBench, state: State) -> None:
    """In each state the heartbeat keeps the commissioned period."""
    bench.start(QUICK)
    judge_row(bench, some_row(bench, settle_in(bench, state)))


@pytest.mark.requirement("HB-01")
def test_period_as_commissioned(bench: KeypadBench) -> None:
    """The heartbeat has the period that the node is commissioned to, whatever that is."""
    boot = bench.start()
    period_ns(bench)
    judge_row(bench, some_row(bench, next_beat(bench, boot, "HB-06")))


@pytest.mark.requirement("HB-01")
@pytest.mark.parametrize("period_ms", PERIODS_MS)
def test_range_of_periods(bench: KeypadBench, period_ms: int) -> None:
    """Each period of the range is kept, short and long, the high byte first."""
    boot = bench.start(heartbeat_ms=period_ms)
    judge_row(bench, some_row(bench, next_beat(bench, boot, "HB-06")))


HIGH_BYTES = (0x01, 0x02, 0x04, 0x08, 0x10, 0x20)
LOW_BYTES = (0x7F, 0x80, 0xFF)


@pytest.mark.virtual("they take minutes; what is commissioned from the seed has one of them")
@pytest.mark.requirement("HB-01", "COM-09")
def test_periods_at_the_borders_of_bytes(bench: KeypadBench, chance: Chance) -> None:
    """Both bytes of a period count, wherever it stands; some are drawn by the seed."""
    row = chance.row("period")
    drawn = [row.randrange(1, 0x28) << 8 | chance.byte(row) for _ in range(18)]
    for period_ms in (*(h << 8 | low for h in HIGH_BYTES for low in LOW_BYTES), *drawn):
        boot = bench.start(heartbeat_ms=period_ms)
        judge_row(bench, some_row(bench, next_beat(bench, boot, "HB-06")))


@pytest.mark.requirement("HB-01")
@pytest.mark.parametrize("code", RATES, ids=rate_name)
def test_shortest_period_at_each_bit_rate(bench: KeypadBench, code: int) -> None:
    """At each bit rate the shortest period that is asked of the node is kept."""
    shortest_ms = bench.profile.shortest_heartbeat[RATES[code]] // MS
    boot = bench.start(bit_rate_code=code, heartbeat_ms=shortest_ms)
    judge_row(bench, some_row(bench, next_beat(bench, boot, "HB-06")))


@pytest.mark.virtual("no limit of a real board is known for every period at every bit rate")
@pytest.mark.requirement("HB-01")
@pytest.mark.parametrize("code", [1, 2, 3], ids=rate_name)
@pytest.mark.parametrize("state", RUNNING_STATES, ids=name_of)
def test_period_of_one_ms(bench: KeypadBench, code: int, state: State) -> None:
    """A period of 1 ms is kept where the wire carries it: the mean, over a second."""
    bench.start(bit_rate_code=code, heartbeat_ms=1)
    judge_row(bench, row(bench, 1000, settle_in(bench, state)))


@pytest.mark.requirement("HB-02")
def test_byte_is_the_state(bench: KeypadBench) -> None:
    """The heartbeat is 0x70X with one byte: 7Fh, 05h or 04h; its top bit never toggles."""
    bench.start({**QUICK, "node_id": 12})
    for state in (*RUNNING_STATES, State.PRE_OPERATIONAL):
        wanted = f"70{bench.node_id:X}#{SHOWN[state]}"
        for beat in row(bench, 3, settle_in(bench, state)):
            bench.check(
                str(beat.frame) == wanted,
                f"{state} shown as {wanted}; it was {beat.frame}",
                since=beat,
            )


def offsets_ns(bench: KeypadBench) -> list[int]:
    """Where in a period a command is placed: evenly, and about its limit before a beat."""
    period, limit = period_ns(bench), bench.profile.limits.command_ns
    steps = 40 if bench.stage.virtual else 8
    spread = [period * (2 * step + 1) // (2 * steps) for step in range(steps)]
    edge = [period - limit + shift for shift in (-MS, MS)]
    return [*spread, *(offset for offset in edge if 0 < offset < period)]


@pytest.mark.requirement("HB-03")
def test_beat_due_after_the_command_acted_shows_it(bench: KeypadBench) -> None:
    """Wherever in a period a command falls, beats later than its limit show the new state."""
    bench.start(QUICK)
    beat = settle_in(bench, State.STOPPED)
    state = State.STOPPED
    for offset in offsets_ns(bench):
        state = State.OPERATIONAL if state is State.STOPPED else State.STOPPED
        bench.wait_until(beat.at + offset)
        enter(bench, state)
        beat = next_beat(bench, exactly(bench.now()))


@pytest.mark.requirement("HB-05")
def test_no_heartbeat_with_period_zero(bench: KeypadBench) -> None:
    """With heartbeat time 0 there is boot-up but no heartbeat, in any state."""
    boot = bench.start(heartbeat_ms=0)
    silence_ns = 120 * S if bench.stage.virtual else 2 * S
    beat = matchers.heartbeat(bench.node_id)
    bench.never(beat, after=boot, for_ns=silence_ns)
    for command in (Nmt.START, Nmt.STOP, Nmt.PRE_OPERATIONAL):
        sent = bench.nmt(command)
        bench.never(beat, after=sent, for_ns=silence_ns)


@pytest.mark.requirement("HB-05")
@pytest.mark.parametrize("command", RESETS, ids=name_of)
def test_boot_up_with_period_zero(bench: KeypadBench, command: Nmt) -> None:
    """With heartbeat time 0 a reset still brings boot-up, and no heartbeat."""
    bench.start(heartbeat_ms=0)
    sent = bench.nmt(command)
    within = bench.profile.limits.boot_up_ns
    boot = bench.expect(matchers.boot_up(bench.node_id), after=sent, within=within)
    silence_ns = 120 * S if bench.stage.virtual else 2 * S
    bench.never(matchers.heartbeat(bench.node_id), after=boot, for_ns=silence_ns)


@pytest.mark.requirement("HB-05")
def test_boot_up_after_power_on_with_period_zero(bench: KeypadBench, power: Power) -> None:
    """With heartbeat time 0 power-on still brings boot-up."""
    bench.fresh(heartbeat_ms=0)
    on = power.on()
    within = 2 * bench.profile.limits.boot_up_ns  # how soon is NMT-02
    bench.expect(matchers.boot_up(bench.node_id), after=on, within=within)


@pytest.mark.requirement("HB-05")
def test_node_without_heartbeat_obeys(bench: KeypadBench) -> None:
    """With heartbeat time 0 the node starts on command: the key frame tells it."""
    bench.operational(heartbeat_ms=0)


@pytest.mark.requirement("HB-06")
@pytest.mark.parametrize("period_ms", [20, 100, 1000])
def test_first_heartbeat_after_power_on(bench: KeypadBench, period_ms: int) -> None:
    """The first heartbeat comes at most one period after boot-up."""
    boot = bench.start({"heartbeat_ms": period_ms})
    period_ns(bench)
    within = bench.watch.expected.heartbeat_first.at_most_ns
    bench.expect(matchers.heartbeat(bench.node_id), after=boot, within=within)


@pytest.mark.requirement("HB-06")
@pytest.mark.parametrize("state", RUNNING_STATES, ids=name_of)
@pytest.mark.parametrize("command", RESETS, ids=name_of)
def test_first_heartbeat_after_reset(bench: KeypadBench, command: Nmt, state: State) -> None:
    """A reset starts the heartbeat anew: at most one period after boot-up."""
    bench.start(QUICK)
    enter(bench, state)
    sent = bench.nmt(command)
    limits = bench.profile.limits
    boot = bench.expect(
        matchers.boot_up(bench.node_id),
        after=sent,
        within=limits.boot_up_ns,
        requirement="NMT-06",
    )
    within = bench.watch.expected.heartbeat_first.at_most_ns
    bench.expect(matchers.heartbeat(bench.node_id), after=boot, within=within)
