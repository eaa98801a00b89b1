"""SYNC leads a drive through its cycle: set-points in, samples out, then everything else."""

from __future__ import annotations

import pytest

from hil_tests.acceptance.drive.steps import (
    COB_ID,
    NO_REMOTE,
    QUICK,
    RPDO,
    TPDO,
    TYPE,
    any_pdo,
    axis,
    disable,
    enable,
    map_objects,
    pause_ns,
    rpdo,
    run,
    set_point,
    set_up,
    sync,
    tpdo,
)
from hil_tests.api import MS, Cia301Bench, Frame, Nmt, S, Sdo, cobs, matchers, number, u8, u16

READ_DEVICE_TYPE = b"\x40\x00\x10\x00\x00\x00\x00\x00"
FAR, FARTHER = 123_456, 234_567
WAY = 50_000
"""Increments that an axis is moved by."""


@pytest.mark.requirement("SYN-01")
def test_a_set_point_takes_effect_with_the_next_sync(bench: Cia301Bench, sdo: Sdo) -> None:
    """An RPDO changes nothing by itself; with the SYNC that follows it does."""
    run(bench, sdo)
    sync(bench)
    before = set_point(bench, sdo)

    sent = bench.send(rpdo(bench, FAR))
    bench.wait(pause_ns(bench))
    found = set_point(bench, sdo)
    bench.check(found == before, f"set-point {before} until the SYNC; it is {found}", since=sent)

    seen = sync(bench)
    bench.wait(bench.profile.limits.sync_pdo_ns)
    found = set_point(bench, sdo)
    bench.check(found == FAR, f"set-point {FAR} after the SYNC; it is {found}", since=seen)


@pytest.mark.requirement("SYN-01")
def test_of_several_set_points_the_last_one_counts(bench: Cia301Bench, sdo: Sdo) -> None:
    """Two RPDOs before a SYNC: it takes the later one, and no SYNC takes it again."""
    run(bench, sdo)
    sync(bench)
    bench.send(rpdo(bench, FARTHER))
    bench.send(rpdo(bench, FAR))
    seen = sync(bench)
    bench.wait(bench.profile.limits.sync_pdo_ns)
    found = set_point(bench, sdo)
    bench.check(found == FAR, f"set-point {FAR}, which came last; it is {found}", since=seen)

    drive = axis(bench)
    sdo.write(*drive.set_point, (FAR + 1).to_bytes(4, "little"))
    seen = sync(bench)
    bench.wait(bench.profile.limits.sync_pdo_ns)
    found = set_point(bench, sdo)
    text = f"set-point {FAR + 1}, as no RPDO has come since; it is {found}"
    bench.check(found == FAR + 1, text, since=seen)


@pytest.mark.requirement("SYN-01")
@pytest.mark.timed("what goes first on the bus decides")
def test_a_sample_is_taken_at_the_sync(bench: Cia301Bench, sdo: Sdo) -> None:
    """A change that comes after the SYNC and before the TPDO is sent shows in the next one."""
    drive = axis(bench)
    set_up(bench, sdo)
    # The TPDO goes last in arbitration, the RPDO that acts at once goes before it.
    disable(sdo, TPDO)
    enable(sdo, TPDO, cobs.TPDOS[3] + bench.node_id, NO_REMOTE)
    map_objects(sdo, RPDO + 1, (drive.control,))
    sdo.write(RPDO + 1, TYPE, u8(255), requirement="C-PC-04")
    enable(sdo, RPDO + 1, cobs.RPDOS[1] + bench.node_id)
    bench.enter_operational()
    before = sdo.read(*drive.status)
    limits = bench.profile.limits

    index = len(bench.trace)
    bench.post(Frame(cobs.SYNC, b""))
    bench.post(Frame(cobs.RPDOS[1] + bench.node_id, u16(0x06)))
    seen = bench.await_own(Frame(cobs.SYNC, b""), index)
    first = bench.expect(
        tpdo(bench, 4), after=seen, within=limits.sync_pdo_ns, requirement="SYN-02"
    )
    shown = first.frame.data[: len(before)]
    text = f"status {before.hex()}h, as it was at the SYNC; it is {shown.hex()}h"
    bench.check(shown == before, text, since=seen)

    bench.wait(limits.event_pdo_ns)
    after = sdo.read(*drive.status)
    seen = sync(bench)
    second = bench.expect(
        tpdo(bench, 4), after=seen, within=limits.sync_pdo_ns, requirement="SYN-02"
    )
    shown = second.frame.data[: len(after)]
    text = f"status {after.hex()}h, as it is now; it is {shown.hex()}h"
    bench.check(shown == after, text, since=seen)


@pytest.mark.requirement("SYN-02", "SYN-01")
def test_a_sample_follows_each_sync(bench: Cia301Bench, sdo: Sdo) -> None:
    """Each SYNC is followed by one TPDO in time, with what SDO reads, however often it comes."""
    drive = axis(bench)
    run(bench, sdo)
    content = sdo.read(*drive.status) + sdo.read(*drive.actual)
    for period_ms in (50, 20, 10, 10, 10, 5, 5):
        seen = sync(bench)
        limits = bench.profile.limits
        found = bench.expect(tpdo(bench), after=seen, within=limits.sync_pdo_ns)
        text = f"{content.hex(' ')} in the TPDO; it is {found.frame.data.hex(' ')}"
        bench.check(found.frame.data == content, text, requirement="SYN-01", since=seen)
        bench.never(any_pdo(bench), after=found, for_ns=period_ms * MS)


@pytest.mark.requirement("SYN-02")
def test_no_sync_no_sample(bench: Cia301Bench, sdo: Sdo) -> None:
    """Without a SYNC no synchronous TPDO comes, whatever changes."""
    drive = axis(bench)
    run(bench, sdo)
    seen = sync(bench)
    first = bench.expect(tpdo(bench), after=seen, within=bench.profile.limits.sync_pdo_ns)
    sdo.write(*drive.control, u16(0x06))
    sdo.write(*drive.control, u16(0x00))
    bench.never(any_pdo(bench), after=first, for_ns=500 * MS)


@pytest.mark.requirement("SYN-04")
def test_sdo_is_served_once_the_window_has_closed(bench: Cia301Bench, sdo: Sdo) -> None:
    """In a cycle of 20 ms with a window of 5 ms, an SDO request after it is answered each time."""
    window_ns, cycle_ns = 5 * MS, 20 * MS
    run(bench, sdo, window_ns=window_ns)
    answer = matchers.cob(cobs.SDO_ANSWER + bench.node_id, "an SDO answer")
    limits = bench.profile.limits
    at = bench.now()
    for turn in range(10):
        bench.wait_until(at + turn * cycle_ns)
        seen = sync(bench)
        bench.send(rpdo(bench, FAR + turn))
        bench.wait_until(seen.at + window_ns)
        request = sdo.post(READ_DEVICE_TYPE)
        bench.expect(answer, after=request, within=limits.sdo_ns)


@pytest.mark.requirement("SYN-07")
@pytest.mark.parametrize("command", [Nmt.PRE_OPERATIONAL, Nmt.STOP], ids=["pre-op", "stopped"])
def test_sync_leads_to_no_pdo_outside_operational(
    bench: Cia301Bench, sdo: Sdo, command: Nmt
) -> None:
    """In pre-operational and stopped SYNCs bring no TPDO; in operational the next one does."""
    run(bench, sdo)
    bench.enter(command)
    began_at = bench.now()
    for _ in range(5):
        sync(bench)
        bench.wait(10 * MS)
    bench.never(any_pdo(bench), after=began_at, for_ns=100 * MS)
    bench.enter_operational()
    seen = sync(bench)
    within = bench.profile.limits.sync_pdo_ns
    bench.expect(tpdo(bench), after=seen, within=within, requirement="SYN-02")


@pytest.mark.requirement("SYN-07")
def test_sync_leads_to_no_pdo_before_the_first_start(bench: Cia301Bench, sdo: Sdo) -> None:
    """Right after the boot-up a SYNC brings nothing."""
    set_up(bench, sdo)
    began_at = bench.now()
    for _ in range(3):
        sync(bench)
    bench.never(any_pdo(bench), after=began_at, for_ns=100 * MS)


@pytest.mark.requirement("SYN-07", "SYN-01")
@pytest.mark.parametrize("command", [Nmt.PRE_OPERATIONAL, Nmt.STOP], ids=["pre-op", "stopped"])
def test_a_set_point_outside_operational_is_not_taken(
    bench: Cia301Bench, sdo: Sdo, command: Nmt
) -> None:
    """An RPDO in pre-operational or stopped counts neither with a SYNC there nor later."""
    run(bench, sdo)
    sync(bench)
    before = set_point(bench, sdo)
    bench.enter(command)
    sent = bench.send(rpdo(bench, before + FAR))
    sync(bench)
    bench.enter_operational()
    sync(bench)
    bench.wait(bench.profile.limits.sync_pdo_ns)
    found = set_point(bench, sdo)
    text = f"set-point {before}; it is {found}"
    bench.check(found == before, text, since=sent)


@pytest.mark.requirement("SYN-02", "SYN-01")
def test_a_drive_is_ready_for_sync_as_it_comes(bench: Cia301Bench, sdo: Sdo) -> None:
    """With its default settings the first TPDO is synchronous, if its data sheet's is valid."""
    bench.start(QUICK)
    kind, cob_id = number(sdo.read(TPDO, TYPE)), number(sdo.read(TPDO, COB_ID))
    bench.enter_operational()
    seen = sync(bench)
    if kind == 1 and not cob_id >> 31:
        within = bench.profile.limits.sync_pdo_ns
        bench.expect(tpdo(bench), after=seen, within=within)
    bench.characteristic("SYN-02", f"TPDO1 has the transmission type {kind} by default")


@pytest.mark.requirement("SYN-01", "SYN-02")
def test_the_axis_follows_its_set_point(bench: Cia301Bench, sdo: Sdo) -> None:
    """Enabled over RPDOs, the axis moves to the set-point that a SYNC gave it; samples show it."""
    bench.needs_writes("the test moves the axis")
    drive = axis(bench)
    run(bench, sdo)
    start = number(sdo.read(*drive.actual))
    size, limits = len(sdo.read(*drive.status)), bench.profile.limits
    for control in (0x06, 0x07, 0x0F):
        bench.send(rpdo(bench, start, control))
        seen = sync(bench)
        bench.wait(10 * MS)
    bench.send(rpdo(bench, start + WAY, control=0x0F))
    began_at, position = bench.now(), start
    while position != start + WAY and bench.now() < began_at + 10 * S:
        seen = sync(bench)
        found = bench.expect(
            tpdo(bench), after=seen, within=limits.sync_pdo_ns, requirement="SYN-02"
        )
        position = number(found.frame.data[size:])
        text = f"the position is between {start} and {start + WAY}; it is {position}"
        bench.check(start <= position <= start + WAY, text, since=seen)
        bench.wait(10 * MS)
    text = f"the axis arrives at {start + WAY}; it is at {position}"
    bench.check(position == start + WAY, text, since=began_at)
