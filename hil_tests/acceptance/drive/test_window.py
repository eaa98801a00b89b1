"""The synchronous window: what comes too late after a SYNC does not count."""

from __future__ import annotations

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from hil_tests.acceptance.drive.steps import (
    RPDO,
    SPARE_ID,
    TPDO,
    TYPE,
    WINDOW,
    axis,
    enable,
    map_objects,
    margin_ns,
    open_window,
    pause_ns,
    rpdo,
    run,
    run_proven,
    set_point,
    set_up,
    sync,
    tpdo,
)
from hil_tests.api import (
    MS,
    Cia301Bench,
    Frame,
    Interval,
    Nmt,
    Outcome,
    S,
    Sdo,
    Seen,
    Verdict,
    cobs,
    number,
    show_span,
    u8,
    u16,
    window,
)

ON_ITS_WAY_NS = 1 * MS
"""How long before an instant a frame is sent that shall end at it."""

BURST = 40
"""Frames that keep the bus busy for 18 ms at 250 kbit/s."""


def around(seen: Seen) -> Interval:
    """When a frame of ours was on the bus."""
    return Interval(seen.at, seen.at)


def send_at(bench: Cia301Bench, frame: Frame, since: Seen, phase_ns: int) -> Seen:
    """Send a frame so that it ends about `phase_ns` after a SYNC."""
    bench.wait_until(since.at + phase_ns - ON_ITS_WAY_NS)
    return bench.send(frame)


def expect_taken(
    bench: Cia301Bench, sdo: Sdo, phase_ns: int, window_ns: int, requirement: str = ""
) -> None:
    """One RPDO at a phase of the cycle; the next SYNC takes it or not, as the window says."""
    first = sync(bench)
    before = set_point(bench, sdo)
    value = before + 1000
    sent = send_at(bench, rpdo(bench, value), first, phase_ns)
    bench.wait_until(first.at + max(phase_ns, window_ns) + 5 * MS)
    second = sync(bench)
    bench.wait(bench.profile.limits.sync_pdo_ns)
    found = set_point(bench, sdo)
    rule = window.Window(window_ns, 0)
    syncs = (around(first), around(second))
    rpdos = (window.Received(around(sent), value),)
    (right,) = window.permitted(before, syncs, rpdos, rule)[1]
    span = (sent.at - first.at) / MS
    text = f"RPDO {span:.3f} ms after the SYNC, window {window_ns // MS} ms: set-point {right}"
    if abs(sent.at - first.at - window_ns) < margin_ns(bench) // 2 and window_ns:
        # The host let the frame come to the very end of the window: nobody can say.
        bench.conclude(Verdict(requirement, Outcome.INCONCLUSIVE, text, at=sent.at))
    bench.check(found == right, f"{text}; it is {found}", requirement=requirement, since=first)


@pytest.mark.requirement("SYN-03")
@pytest.mark.parametrize("phase_ms", [2, 40, 99, 140])
def test_a_set_point_that_misses_the_window_is_ignored(
    bench: Cia301Bench, sdo: Sdo, phase_ms: int
) -> None:
    """Of a window of 60 ms: an RPDO within it counts, one after it does not, then as before."""
    window_ns = 60 * MS
    run_proven(bench, sdo, window_ns)
    expect_taken(bench, sdo, phase_ms * MS, window_ns)
    expect_taken(bench, sdo, 10 * MS, window_ns)


@pytest.mark.requirement("SYN-03")
def test_a_set_point_in_time_outlasts_one_that_is_late(bench: Cia301Bench, sdo: Sdo) -> None:
    """One RPDO within the window and another after it: the SYNC takes the first."""
    window_ns = 60 * MS
    run_proven(bench, sdo, window_ns)
    first = sync(bench)
    before = set_point(bench, sdo)
    send_at(bench, rpdo(bench, before + 1), first, 20 * MS)
    send_at(bench, rpdo(bench, before + 2), first, window_ns + 2 * margin_ns(bench))
    second = sync(bench)
    bench.wait(bench.profile.limits.sync_pdo_ns)
    found = set_point(bench, sdo)
    bench.check(found == before + 1, f"set-point {before + 1}; it is {found}", since=second)


@pytest.mark.requirement("SYN-05", "SYN-03")
@pytest.mark.parametrize("window_ms", [20, 50, 300])
@pytest.mark.parametrize("side", ["within", "after"])
def test_the_window_is_as_long_as_it_is_set(
    bench: Cia301Bench, sdo: Sdo, window_ms: int, side: str
) -> None:
    """In the unit of its manual: just within it an RPDO counts, just after it none does."""
    window_ns = window_ms * MS
    run_proven(bench, sdo, window_ns)
    written = number(sdo.read(WINDOW))
    steps = window_ns // axis(bench).window_unit_ns
    bench.check(written == steps, f"1007h is {steps}; it reads {written}", requirement="SYN-05")
    # That there is a window at all is SYN-03; how long it is, SYN-05.
    expect_taken(bench, sdo, 5 * window_ns, window_ns, "SYN-03")
    beside = margin_ns(bench)
    phase_ns = window_ns + (beside + ON_ITS_WAY_NS if side == "after" else -beside)
    expect_taken(bench, sdo, phase_ns, window_ns)


@pytest.mark.requirement("SYN-05")
@pytest.mark.parametrize("phase_ms", [5, 100, 700])
def test_without_a_window_nothing_is_late(bench: Cia301Bench, sdo: Sdo, phase_ms: int) -> None:
    """1007h = 0: an RPDO counts whenever it comes."""
    run_proven(bench, sdo, 0)
    expect_taken(bench, sdo, phase_ms * MS, 0)


@pytest.mark.requirement("SYN-05")
def test_a_window_can_be_changed_in_operational(bench: Cia301Bench, sdo: Sdo) -> None:
    """A new window counts from the next SYNC on; 0 ends it."""
    run_proven(bench, sdo, 60 * MS)
    expect_taken(bench, sdo, 200 * MS, 60 * MS, "SYN-03")
    for window_ns, phase_ns in ((60, 100), (200, 100), (30, 100), (0, 100)):
        open_window(bench, sdo, window_ns * MS)
        expect_taken(bench, sdo, phase_ns * MS, window_ns * MS)


def held_back(bench: Cia301Bench) -> Seen:
    """A SYNC with a row of frames behind it that let no PDO through for a while."""
    index = len(bench.trace)
    bench.post(Frame(cobs.SYNC, b""))
    for _ in range(BURST):
        bench.post(Frame(SPARE_ID, bytes(8)))
    return bench.await_own(Frame(cobs.SYNC, b""), index)


@pytest.mark.requirement("SYN-03")
@pytest.mark.timed("fractions of a millisecond count")
def test_no_sample_is_sent_after_the_window(bench: Cia301Bench, sdo: Sdo) -> None:
    """However short the window is: a TPDO that the drive is not ready with in time never comes."""
    unit_ns = axis(bench).window_unit_ns
    limits = bench.profile.limits
    run(bench, sdo)
    # A frame can begin when the intermission is over: three bits, and one to wake up.
    slack_ns = 4 * S // bench.stage.bit_rate
    shown = set[int]()
    for steps in (1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000, 5000):
        window_ns = steps * unit_ns
        if window_ns > 10 * MS:
            break
        open_window(bench, sdo, window_ns)
        for _ in range(3):
            seen = sync(bench)
            found = bench.first(tpdo(bench), seen, seen.at + 20 * MS)
            if found is not None:
                shown.add(window_ns)
                late = found.wanted.latest > seen.at + window_ns + slack_ns
                text = f"no TPDO is sent more than {show_span(window_ns)} after the SYNC"
                bench.check(not late, f"{text}; {found.frame} was", since=seen)
            elif window_ns >= limits.sync_pdo_ns:
                text = f"no TPDO in a window of {show_span(window_ns)}"
                bench.fail(text, requirement="SYN-02", since=seen)
    least = show_span(min(shown)) if shown else "none that was tried"
    bench.characteristic("SYN-03", f"the shortest window in which a TPDO comes: {least}")


@pytest.mark.requirement("SYN-03")
@pytest.mark.timed("what goes first on the bus decides")
def test_a_sample_that_the_bus_holds_back(bench: Cia301Bench, sdo: Sdo) -> None:
    """Whether a TPDO that waits for a busy bus is taken back when the window closes is noted."""
    bench.needs_exclusive()
    run(bench, sdo, window_ns=5 * MS)
    limits = bench.profile.limits
    seen = held_back(bench)
    found = bench.first(tpdo(bench), seen, seen.at + 200 * MS)
    done = "dropped" if found is None else "sent all the same"
    bench.characteristic("SYN-03", f"a TPDO that the bus keeps waiting is {done}")
    seen = sync(bench)
    bench.expect(tpdo(bench), after=seen, within=limits.sync_pdo_ns, requirement="SYN-02")


@pytest.mark.requirement("SYN-05")
@pytest.mark.timed("what goes first on the bus decides")
@pytest.mark.parametrize("window_ms", [0, 100])
def test_a_sample_that_is_in_time_may_be_late(
    bench: Cia301Bench, sdo: Sdo, window_ms: int
) -> None:
    """Without a window, and in a long one, a TPDO that the bus holds back comes after all."""
    bench.needs_exclusive()
    run(bench, sdo, window_ns=window_ms * MS)
    within = bench.profile.limits.sync_pdo_ns
    bench.expect(tpdo(bench), after=sync(bench), within=within, requirement="SYN-02")
    bench.wait(20 * MS)
    seen = held_back(bench)
    found = bench.first(tpdo(bench), seen, seen.at + 200 * MS)
    bench.check(found is not None, f"a TPDO comes in a window of {window_ms} ms", since=seen)


def with_events(bench: Cia301Bench, sdo: Sdo, window_ns: int) -> None:
    """Besides the synchronous PDOs one of each kind that waits for no SYNC."""
    drive = axis(bench)
    set_up(bench, sdo, window_ns=window_ns)
    map_objects(sdo, RPDO + 1, (drive.control, drive.set_point))
    sdo.write(RPDO + 1, TYPE, u8(255), requirement="C-PC-04")
    enable(sdo, RPDO + 1, cobs.RPDOS[1] + bench.node_id)
    map_objects(sdo, TPDO + 1, (drive.status,))
    sdo.write(TPDO + 1, TYPE, u8(255), requirement="C-PC-04")
    enable(sdo, TPDO + 1, cobs.TPDOS[1] + bench.node_id)
    bench.enter_operational()
    bench.wait(pause_ns(bench))


@pytest.mark.requirement("SYN-03", "SYN-06")
def test_events_do_not_mind_the_window(bench: Cia301Bench, sdo: Sdo) -> None:
    """After the window an event-driven RPDO takes effect at once, and its TPDO comes."""
    with_events(bench, sdo, 10 * MS)
    before = set_point(bench, sdo)
    sent = bench.send(rpdo(bench, before, control=0x06, which=2))
    within = bench.profile.limits.event_pdo_ns
    bench.expect(tpdo(bench, 2), after=sent, within=within, requirement="SYN-06")
    first = sync(bench)
    bench.wait_until(first.at + 100 * MS)
    sent = bench.send(rpdo(bench, before + 7, control=0x00, which=2))
    bench.expect(tpdo(bench, 2), after=sent, within=within)
    found = set_point(bench, sdo)
    text = f"set-point {before + 7} at once; it is {found}"
    bench.check(found == before + 7, text, since=sent)


CYCLES = st.lists(
    st.tuples(st.integers(25, 120), st.lists(st.integers(2, 118), max_size=2)),
    min_size=1,
    max_size=6,
)
"""Periods of SYNC in ms, with the phases of the RPDOs in each."""


@pytest.mark.requirement("SYN-03", "SYN-05", "SYN-01")
@settings(max_examples=15)
@given(window_ms=st.sampled_from((0, 20, 45, 80)), cycles=CYCLES)
@example(window_ms=45, cycles=[(100, [20]), (100, [80]), (100, [20, 80]), (60, []), (60, [30])])
@example(window_ms=0, cycles=[(50, [20, 40]), (100, [80]), (40, [])])
def test_set_points_at_any_phase(
    bench: Cia301Bench, sdo: Sdo, window_ms: int, cycles: list[tuple[int, list[int]]]
) -> None:
    """Whenever SYNCs and RPDOs come, each SYNC takes the last one that was in time."""
    bench.begin_example()
    run_proven(bench, sdo, window_ms * MS)
    rule = window.Window(window_ms * MS, margin_ns(bench))
    seen, start = sync(bench), set_point(bench, sdo)
    syncs, rpdos, found = [around(seen)], list[window.Received](), [start]
    value = start
    for period_ms, phases in cycles:
        for phase_ms in sorted(phases):
            if phase_ms < period_ms - 2:
                value += 1
                sent = send_at(bench, rpdo(bench, value), seen, phase_ms * MS)
                rpdos.append(window.Received(around(sent), value))
        bench.wait_until(seen.at + period_ms * MS)
        seen = sync(bench)
        bench.wait(bench.profile.limits.sync_pdo_ns)
        syncs.append(around(seen))
        found.append(set_point(bench, sdo))
    for turn, (may, has) in enumerate(
        zip(window.permitted(start, syncs, rpdos, rule), found, strict=True)
    ):
        told = " or ".join(map(str, sorted(may)))
        text = f"set-point {told} after SYNC {turn}; it is {has}"
        requirement = "SYN-03" if window_ms else "SYN-05"
        bench.check(has in may, text, requirement=requirement, since=syncs[turn])
    bench.check_monitors()


@pytest.mark.requirement("SYN-03", "SYN-07")
def test_a_new_start_knows_no_window_yet(bench: Cia301Bench, sdo: Sdo) -> None:
    """What came before pre-operational leaves nothing behind: the first cycle is a whole one."""
    window_ns = 30 * MS
    run_proven(bench, sdo, window_ns)
    sync(bench)
    bench.enter(Nmt.PRE_OPERATIONAL)
    sdo.write(*axis(bench).control, u16(0))
    bench.enter_operational()
    expect_taken(bench, sdo, 15 * MS, window_ns)
    expect_taken(bench, sdo, 80 * MS, window_ns)
