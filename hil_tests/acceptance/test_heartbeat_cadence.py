"""Nothing disturbs the cadence of the heartbeat, and it does not drift (HB-04)."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from hil_tests.acceptance.cadence import (
    beats_since,
    judge_row,
    next_beat,
    period_ns,
    row,
    settle_in,
)
from hil_tests.acceptance.nmt_steps import QUICK, name_of
from hil_tests.api import (
    Frame,
    Interval,
    KeypadBench,
    Keys,
    Nmt,
    S,
    State,
    cobs,
    exactly,
    matchers,
    nmt_frame,
)
from hil_tests.judge.periodic import ENOUGH

SLOWER = {"heartbeat_ms": 250}
"""An hour of that has beats enough."""

STEPS = 20
"""Stimuli, each at another phase of the period."""

WINDOW = 2 * ENOUGH
"""Intervals at each end of a long time that are judged one by one; the monitors judge all."""

ACTIVE_STATES = (State.OPERATIONAL, State.PRE_OPERATIONAL, State.STOPPED)


def stir(
    bench: KeypadBench, state: State, act: Callable[[int], object], every_ns: int = 0
) -> None:
    """Judge the beats while `act(n)` is done at phases all through the period.

    Args:
        bench: the bench.
        state: in which the node is meanwhile.
        act: the stimulus number n.
        every_ns: least span between two stimuli.
    """
    first = settle_in(bench, state)
    period = period_ns(bench)
    turn = max(-(-every_ns // period), 1) * period
    for step in range(STEPS):
        bench.wait_until(first.at + step * turn + period * step // STEPS)
        act(step)
    bench.wait(2 * period)
    beats = beats_since(bench, first)
    missing = max(ENOUGH + 1 - len(beats), 0)
    if missing:
        bench.wait(missing * period)
        beats = beats_since(bench, first)
    judge_row(bench, beats)


@pytest.mark.requirement("HB-04", "HB-01")
@pytest.mark.parametrize("state", ACTIVE_STATES, ids=name_of)
def test_keys_do_not_disturb_it(bench: KeypadBench, keys: Keys, state: State) -> None:
    """Key presses and releases at all phases leave the heartbeat as it is."""
    parameters = bench.fresh({**QUICK, "debounce": 1})
    bench.boot()
    names = keys.names[2:3] or keys.names[:1]

    def act(step: int) -> None:
        keys.hold(*(names if step % 2 == 0 else ()))

    # Each edge matures before the next, so that key frames come at all phases too.
    stir(bench, state, act, parameters.debounce_ns + 2 * bench.profile.limits.scan_ns)
    keys.release()


@pytest.mark.requirement("HB-04", "HB-01")
@pytest.mark.parametrize("state", ACTIVE_STATES, ids=name_of)
def test_led_frames_do_not_disturb_it(bench: KeypadBench, state: State) -> None:
    """LED frames at all phases leave the heartbeat as it is."""
    bench.start(QUICK)
    size = bench.profile.led_frame_bytes
    ids = (cobs.LED_STEADY + bench.node_id, cobs.LED_BLINK + bench.node_id)

    def act(step: int) -> None:
        bench.send(Frame(ids[step % 2], bytes((step,)) * size))

    stir(bench, state, act)


@pytest.mark.requirement("HB-04", "HB-01")
@pytest.mark.parametrize("state", ACTIVE_STATES, ids=name_of)
def test_traffic_of_others_does_not_disturb_it(bench: KeypadBench, state: State) -> None:
    """SYNC, NMT for others, PDOs and heartbeats of others leave the heartbeat as it is."""
    bench.needs_exclusive()
    bench.start(QUICK)
    other = bench.node_id + 16
    frames = (
        Frame(0x080),
        nmt_frame(Nmt.STOP, other),
        Frame(0x100, bytes(6)),
        Frame(0x180 + other, b"\xff"),
        Frame(0x700 + other, b"\x05"),
        Frame(0x700 + other, b"\x00"),
        nmt_frame(0x03, bench.node_id),
        Frame(0x200 + other, b"\xff"),
        Frame(0x700 + bench.node_id, dlc=1, remote=True),
        Frame(0x600 + other, bytes(8)),
    )
    stir(bench, state, lambda step: bench.send(frames[step % len(frames)]))


@pytest.mark.requirement("HB-04", "HB-01")
@pytest.mark.parametrize("state", ACTIVE_STATES, ids=name_of)
def test_command_to_the_same_state_does_not_disturb_it(bench: KeypadBench, state: State) -> None:
    """A command into the state in which the node is already skips no beat."""
    bench.start(QUICK)
    command = {
        State.OPERATIONAL: Nmt.START,
        State.PRE_OPERATIONAL: Nmt.PRE_OPERATIONAL,
        State.STOPPED: Nmt.STOP,
    }[state]
    stir(bench, state, lambda _: bench.nmt(command))


@pytest.mark.timed("only arbitration shows who had to wait for whom")
@pytest.mark.requirement("HB-04", "HB-01")
@pytest.mark.parametrize(
    ("share", "can_id"),
    [(30, 0x010), (60, 0x010), (30, 0x7FF), (60, 0x7FF), (95, 0x7FF)],
    ids=["30-higher", "60-higher", "30-lower", "60-lower", "95-lower"],
)
def test_bus_load_does_not_disturb_it(bench: KeypadBench, share: int, can_id: int) -> None:
    """Under bus load the node asks for its beats in time, however long they must wait."""
    bench.start({"heartbeat_ms": 50})
    first = settle_in(bench, State.OPERATIONAL)
    bench.needs_load([Frame(can_id, bytes(8))], share * 10_000)
    bench.wait((ENOUGH + 5) * period_ns(bench))
    judge_row(bench, beats_since(bench, first))


@pytest.mark.requirement("HB-04", "HB-01")
def test_it_does_not_drift(bench: KeypadBench) -> None:
    """Over a long time (an hour, where it is virtual) beats neither drift nor get lost."""
    bench.start(SLOWER if bench.stage.virtual else QUICK)
    first = settle_in(bench, State.OPERATIONAL)
    period = period_ns(bench)
    begin = row(bench, WINDOW, first)
    bench.wait((3600 * S if bench.stage.virtual else 10 * S) - WINDOW * period)
    end = row(bench, WINDOW, next_beat(bench, exactly(bench.now()), "HB-04"))
    judge_row(bench, begin, what=" at the beginning")
    judge_row(bench, end, what=" at the end")
    if bench.stage.virtual:
        seen = bench.trace.others(first.index + 1)
        can_id, last = first.frame.can_id, end[-1].index
        count = sum(frame.can_id == can_id for index, frame in seen if index <= last)
        span = end[-1].wanted.since(first.wanted)
        mean = Interval(span.earliest // count, -(-span.latest // count))
        text = f"mean of {count} heartbeat intervals"
        bench.measure(mean, bench.watch.expected.heartbeat_mean, text)


@pytest.mark.requirement("HB-04", "HB-06")
def test_reset_starts_it_anew(bench: KeypadBench) -> None:
    """After a reset at any phase the heartbeat has its period again, from boot-up."""
    bench.start(QUICK)
    period = period_ns(bench)
    for step in range(4):
        beat = settle_in(bench, State.OPERATIONAL)
        bench.wait_until(beat.at + period * (2 * step + 1) // 8)
        reset = bench.nmt(Nmt.RESET_NODE)
        within = bench.profile.limits.boot_up_ns
        boot_up = matchers.boot_up(bench.node_id)
        boot = bench.expect(boot_up, after=reset, within=within, requirement="NMT-06")
        first = next_beat(bench, boot, "HB-06")
        bench.wait(3 * period)
        judge_row(bench, beats_since(bench, first))
