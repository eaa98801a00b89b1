"""Transmission types: which SYNC, event or request makes a drive send its PDO."""

from __future__ import annotations

from itertools import pairwise

import pytest

from hil_tests.acceptance.cia301.pdo_steps import wrong_in
from hil_tests.acceptance.drive.steps import (
    INHIBIT,
    OVERFLOW,
    START,
    TIMER,
    TPDO,
    TYPE,
    any_pdo,
    axis,
    disable,
    enable,
    pause_ns,
    run,
    set_up,
    sync,
    tpdo,
)
from hil_tests.api import (
    MS,
    Abort,
    Cia301Bench,
    Frame,
    Limits,
    NotApplicable,
    Sdo,
    Seen,
    accepted,
    cobs,
    judge_periodic,
    u8,
    u16,
)

READY, OFF = 0x06, 0x00
"""Control words that lead to different status words without moving the axis."""


def change(bench: Cia301Bench, sdo: Sdo, control: int) -> int:
    """Give the axis a control word that changes its status; the instant before it."""
    drive = axis(bench)
    before, began_at = sdo.read(*drive.status), bench.now()
    sdo.write(*drive.control, u16(control))
    if sdo.read(*drive.status) == before:
        raise NotApplicable(f"control word {control:04X}h changes nothing in the status word")
    return began_at


def sends_in(bench: Cia301Bench, count: int) -> list[int]:
    """Send SYNCs, 5 ms apart; the numbers of those that a TPDO follows.

    Args:
        bench: see there.
        count: how many.
    """
    found = []
    for turn in range(1, count + 1):
        seen = sync(bench)
        if bench.first(tpdo(bench), seen, seen.at + 5 * MS):
            found.append(turn)
    return found


@pytest.mark.requirement("SYN-06")
@pytest.mark.parametrize("kind", [1, 2, 3, 10, 240])
def test_every_nth_sync_brings_a_sample(bench: Cia301Bench, sdo: Sdo, kind: int) -> None:
    """Type n: one TPDO with every n-th SYNC, neither more nor less."""
    run(bench, sdo, kind)
    found = sends_in(bench, 3 * kind)
    right = list(range(found[0], 3 * kind + 1, kind)) if found else []
    text = f"a TPDO with every {kind}-th of {3 * kind} SYNCs, the first with one of the first"
    text += f" {kind}; they came with number {', '.join(map(str, found)) or 'none'}"
    bench.check(bool(found) and found[0] <= kind and found == right, text)


@pytest.mark.requirement("SYN-06")
def test_type_0_waits_for_an_event_and_then_for_a_sync(bench: Cia301Bench, sdo: Sdo) -> None:
    """Without an event SYNCs bring nothing; after one exactly the next SYNC does."""
    run(bench, sdo, kind=0)
    sends_in(bench, 2)  # what operational begins with
    found = sends_in(bench, 3)
    bench.check(not found, f"no TPDO without an event; {len(found)} came with 3 SYNCs")
    for control in (READY, OFF, READY):
        event_at = change(bench, sdo, control)
        bench.never(tpdo(bench), after=event_at, for_ns=100 * MS)
        found = sends_in(bench, 3)
        text = f"a TPDO with the first SYNC after an event, and no other; it came with {found}"
        bench.check(found == [1], text)


@pytest.mark.requirement("SYN-06")
@pytest.mark.parametrize("kind", [254, 255])
def test_an_event_is_sent_by_itself(bench: Cia301Bench, sdo: Sdo, kind: int) -> None:
    """Types 254 and 255: a change is sent in time, once, and SYNCs bring nothing."""
    run(bench, sdo, kind)
    bench.wait(pause_ns(bench))
    for control in (READY, OFF, READY):
        drive = axis(bench)
        before = bench.now()
        change(bench, sdo, control)
        within = bench.profile.limits.event_pdo_ns + 3 * bench.profile.limits.sdo_ns
        found = bench.expect(tpdo(bench), after=before, within=within)
        status = sdo.read(*drive.status)
        shown = found.frame.data[: len(status)]
        bench.check(shown == status, f"status {status.hex()}h; it is {shown.hex()}h", since=before)
        bench.never(any_pdo(bench), after=found, for_ns=100 * MS)
        found_at = sends_in(bench, 3)
        bench.check(not found_at, f"no TPDO with a SYNC; it came with {found_at}")


@pytest.mark.requirement("SYN-06", "C-TP-03")
@pytest.mark.parametrize("inhibit_ms", [50, 200])
def test_the_inhibit_time_lies_between_events(
    bench: Cia301Bench, sdo: Sdo, inhibit_ms: int
) -> None:
    """Events in quick succession: TPDOs no closer than the inhibit time, the last state last."""
    drive = axis(bench)
    set_up(bench, sdo, kind=255)
    set_inhibit(bench, sdo, inhibit_ms)
    bench.enter_operational()
    bench.wait(inhibit_ms * MS + pause_ns(bench))
    began_at = bench.now()
    changed_at = began_at
    for turn in range(7):
        changed_at = change(bench, sdo, READY if turn % 2 == 0 else OFF)
        bench.wait(3 * MS)
    status = sdo.read(*drive.status)
    until = bench.now() + 2 * inhibit_ms * MS + pause_ns(bench)
    bench.wait_until(until)
    found = bench.collect(tpdo(bench), after=began_at, until=until)
    text = f"at least two TPDOs for 7 events; {len(found)} came"
    bench.check(len(found) >= 2, text, since=began_at)
    apart = Limits(at_least_ns=inhibit_ms * MS - spread_ns(bench))
    for first, second in pairwise(found):
        bench.measure_between(first, second, apart, "from one TPDO to the next", since=first)
    last = found[-1].frame.data[: len(status)]
    text = f"the last TPDO shows the status {status.hex()}h; it is {last.hex()}h"
    rule = wrong_in(found[-1], changed_at, "SYN-06")
    bench.check(last == status, text, requirement=rule, since=began_at)


def set_inhibit(bench: Cia301Bench, sdo: Sdo, inhibit_ms: int) -> None:
    """The inhibit time of TPDO1, which is invalid while it is set (steps of 100 us)."""
    disable(sdo, TPDO)
    sdo.write(TPDO, INHIBIT, u16(inhibit_ms * 10), requirement="SYN-06")
    enable(sdo, TPDO, cobs.TPDOS[0] + bench.node_id)


def spread_ns(bench: Cia301Bench) -> int:
    """What a clock and the end of the frame before may take from an inhibit time."""
    return 1 * MS if bench.stage.port.timed else 10 * MS


@pytest.mark.requirement("SYN-06")
@pytest.mark.parametrize("timer_ms", [20, 100])
def test_the_event_timer_sends_without_an_event(
    bench: Cia301Bench, sdo: Sdo, timer_ms: int
) -> None:
    """With an event time TPDOs come that often by themselves; with 0 none does."""
    run(bench, sdo, kind=255)
    sdo.write(TPDO, TIMER, u16(timer_ms), requirement="SYN-06")
    count = 25
    began_at = bench.now()
    found = bench.beats(tpdo(bench), count, after=began_at, patience_ns=10 * timer_ms * MS)
    text = f"{count} TPDOs by the event timer of {timer_ms} ms; {len(found)} came"
    bench.check(len(found) == count, text, since=began_at)
    limits = bench.profile.limits
    each, mean = limits.heartbeat_ns(timer_ms * MS)
    beats = [bench.when(one) for one in found]
    bench.conclude(judge_periodic("TPDO1", beats, Limits(*each), Limits(*mean)), since=began_at)
    sdo.write(TPDO, TIMER, u16(0), requirement="SYN-06")
    off_at = bench.now()
    bench.never(tpdo(bench), after=off_at, for_ns=5 * timer_ms * MS)


@pytest.mark.requirement("SYN-06")
@pytest.mark.parametrize("kind", [252, 253])
def test_a_remote_request_is_answered(bench: Cia301Bench, sdo: Sdo, kind: int) -> None:
    """Types 252 and 253, where the drive has them: a remote frame brings the TPDO, a SYNC none."""
    set_up(bench, sdo)
    disable(sdo, TPDO)
    outcome = sdo.try_write(TPDO, TYPE, u8(kind))
    if isinstance(outcome, Abort):
        text = f"transmission type {kind} is refused with {outcome.code:08X}h"
        bench.characteristic("SYN-06", text)
        return
    can_id = cobs.TPDOS[0] + bench.node_id
    if isinstance(sdo.try_write(TPDO, 1, can_id.to_bytes(4, "little")), Abort):
        bench.characteristic("SYN-06", f"type {kind} is there, but remote requests are refused")
        return
    bench.enter_operational()
    found = sends_in(bench, 3)
    bench.check(not found, f"no TPDO with a SYNC alone; it came with {found}")
    change(bench, sdo, READY)
    status = sdo.read(*axis(bench).status)
    sync(bench)
    request = ask(bench, can_id)
    within = bench.profile.limits.event_pdo_ns
    seen = bench.expect(tpdo(bench), after=request, within=within)
    shown = seen.frame.data[: len(status)]
    bench.check(shown == status, f"status {status.hex()}h; it is {shown.hex()}h", since=request)
    bench.never(tpdo(bench), after=seen, for_ns=100 * MS)


def ask(bench: Cia301Bench, can_id: int) -> Seen:
    """Send a remote frame."""
    return bench.send(Frame(can_id, remote=True, dlc=6))


@pytest.mark.requirement("SYN-06")
@pytest.mark.parametrize("kind", [241, 246, 251])
def test_reserved_types_are_refused(bench: Cia301Bench, sdo: Sdo, kind: int) -> None:
    """Types 241 to 251 mean nothing: the drive refuses them, and keeps what it has."""
    set_up(bench, sdo)
    disable(sdo, TPDO)
    outcome = sdo.try_write(TPDO, TYPE, u8(kind))
    sdo.expect_abort(outcome, accepted.INVALID_VALUE, f"transmission type {kind}")
    kept = sdo.read(TPDO, TYPE)
    bench.check(kept == u8(1), f"the type is 1 as before; it is {kept.hex()}h")


@pytest.mark.requirement("SYN-06")
@pytest.mark.parametrize("start", [2, 5])
def test_the_sync_start_value_delays_the_first_sample(
    bench: Cia301Bench, sdo: Sdo, start: int
) -> None:
    """With a counter in SYNC: type 2 sends with the start value, and with every second one on."""
    overflow = 8
    set_up(bench, sdo)
    sdo.write(OVERFLOW, 0, u8(overflow), requirement="SYN-06")
    disable(sdo, TPDO)
    sdo.write(TPDO, TYPE, u8(2), requirement="SYN-06")
    sdo.write(TPDO, START, u8(start), requirement="SYN-06")
    enable(sdo, TPDO, cobs.TPDOS[0] + bench.node_id)
    bench.enter_operational()
    found = []
    counters = [*range(1, overflow + 1)] * 2
    for place, counter in enumerate(counters, 1):
        seen = sync(bench, counter)
        if bench.first(tpdo(bench), seen, seen.at + 5 * MS):
            found.append(place)
    right = list(range(start, len(counters) + 1, 2))
    text = f"TPDOs with the SYNCs {right}, counted from 1; they came with {found}"
    bench.check(found == right, text)
