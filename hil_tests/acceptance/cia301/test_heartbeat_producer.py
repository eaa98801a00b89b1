"""The heartbeat that a device produces (CiA 301 4.2.0, 7.2.8.3.2.2 and 7.5.2.20)."""

from __future__ import annotations

from itertools import pairwise

import pytest

from hil_tests.acceptance.cia301.steps import (
    GAP_NS,
    GUARD_TIME,
    LIFE_FACTOR,
    PRODUCER,
    beats,
    enter,
    go,
    needs_writable,
    quick,
    reset,
    rhythm,
)
from hil_tests.acceptance.nmt_steps import RUNNING_STATES, name_of
from hil_tests.api import (
    MS,
    Cia301Bench,
    Frame,
    Limits,
    Nmt,
    S,
    Sdo,
    Sheet,
    State,
    cobs,
    matchers,
    number,
    sdo_frames,
    u8,
    u16,
)

SHOWN = {bytes((state.value,)) for state in RUNNING_STATES}


@pytest.mark.requirement("C-HB-01")
def test_the_producer_time_is_two_bytes(bench: Cia301Bench, sdo: Sdo, sheet: Sheet) -> None:
    """What was written is read."""
    needs_writable(sheet, (PRODUCER, 0))
    bench.start()
    with sdo.kept((PRODUCER, 0)):
        for value in (1000, 0x0102, 0):
            beats(sdo, value)
            data = sdo.read(PRODUCER)
            text = f"1017h is {value} in two bytes; it is {data.hex()}"
            bench.check(data == u16(value), text)


@pytest.mark.requirement("C-HB-02", "C-HB-07", "C-NMT-04")
@pytest.mark.parametrize("state", RUNNING_STATES, ids=name_of)
def test_a_heartbeat_is_the_state_in_one_byte(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet, state: State
) -> None:
    """04h, 05h or 7Fh, bit 7 always 0; ten beats in each state."""
    quick(bench, sdo, sheet)
    sent = go(bench, state)
    beat = matchers.cob(cobs.ERROR_CONTROL + bench.node_id)
    requirement = "C-HB-07" if state is State.STOPPED else "C-HB-02"
    found = bench.beats(beat, 10, after=bench.now(), patience_ns=GAP_NS)
    text = f"ten heartbeats; there were {len(found)}"
    bench.check(len(found) == 10, text, requirement=requirement)
    wrong = [seen.frame for seen in found if seen.frame.data != bytes((state.value,))]
    text = f"each heartbeat is {state.value:02X}h; there was {list(map(str, wrong[:1]))}"
    rule = fault_of(sdo, state) if wrong and wrong[0].data in SHOWN else "C-HB-02"
    bench.check(not wrong, text, requirement=rule, since=sent)


def fault_of(sdo: Sdo, state: State) -> str:
    """A heartbeat that shows another state lies (C-HB-02), or tells of a command not obeyed.

    SDO knows better in stopped: there it is silent.
    """
    is_served = sdo.offer(sdo_frames.read(0x1000, 0)) is not None
    return "C-HB-02" if state is State.STOPPED and not is_served else "C-NMT-04"


@pytest.mark.requirement("C-HB-03")
@pytest.mark.parametrize("period_ms", [50, 200, 1000])
def test_a_new_time_acts_at_once(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet, period_ms: int
) -> None:
    """The first beat comes within one new period of the answer, whatever the old one was."""
    needs_writable(sheet, (PRODUCER, 0))
    bench.start()
    beats(sdo, 0)
    sdo.write(PRODUCER, 0, u16(period_ms), requirement="C-HB-01")
    written = bench.now()
    _, most = bench.profile.limits.heartbeat_each_ns(period_ms * MS)
    bench.expect(matchers.heartbeat(bench.node_id), after=written, within=most)


@pytest.mark.requirement("C-HB-04")
def test_the_heartbeat_keeps_its_period(bench: Cia301Bench, sdo: Sdo, sheet: Sheet) -> None:
    """Each interval and the mean of many."""
    quick(bench, sdo, sheet)
    rhythm(bench, 100, bench.now(), "C-HB-04")


@pytest.mark.requirement("C-HB-05", "C-HB-04")
@pytest.mark.parametrize("period_ms", [20, 37, 500])
@pytest.mark.parametrize("state", RUNNING_STATES, ids=name_of)
def test_every_period_in_every_state(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet, period_ms: int, state: State
) -> None:
    """Short, odd and long periods."""
    needs_writable(sheet, (PRODUCER, 0))
    bench.start()
    beats(sdo, period_ms)
    enter(bench, state)
    bench.wait(2 * period_ms * MS)
    rhythm(bench, period_ms, bench.now(), "C-HB-05")


@pytest.mark.requirement("C-HB-06")
def test_0_means_no_heartbeat(bench: Cia301Bench, sdo: Sdo, sheet: Sheet) -> None:
    """After the answer to the write none follows."""
    quick(bench, sdo, sheet)
    bench.wait(350 * MS)
    sdo.write(PRODUCER, 0, u16(0))
    beat = matchers.heartbeat(bench.node_id)
    bench.never(beat, after=bench.now(), for_ns=10 * S if bench.stage.virtual else 2 * S)


@pytest.mark.requirement("C-HB-07")
def test_the_heartbeat_goes_on_in_stopped(bench: Cia301Bench, sdo: Sdo, sheet: Sheet) -> None:
    """In its period, showing 04h."""
    quick(bench, sdo, sheet)
    go(bench, State.STOPPED)
    rhythm(bench, 100, bench.now(), "C-HB-07", "C-HB-04")


@pytest.mark.requirement("C-HB-08")
def test_how_it_shows_a_change_of_state_is_written_down(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet
) -> None:
    """At once, or with the next beat."""
    needs_writable(sheet, (PRODUCER, 0))
    bench.start()
    beats(sdo, 1000)
    bench.first(matchers.heartbeat(bench.node_id), bench.now(), bench.now() + 2 * S)
    bench.wait(300 * MS)
    sent = bench.nmt(Nmt.START)
    beat = matchers.heartbeat(bench.node_id, State.OPERATIONAL)
    seen = bench.first(beat, sent, bench.now() + bench.profile.limits.command_ns)
    told = "at once" if seen else "with the next beat"
    bench.characteristic("C-HB-08", f"a change of state is shown {told}")


@pytest.mark.requirement("C-HB-09")
def test_a_new_time_while_it_runs_starts_anew(bench: Cia301Bench, sdo: Sdo, sheet: Sheet) -> None:
    """From 100 ms to 400 ms between two beats: no beat of the old rhythm comes in between."""
    quick(bench, sdo, sheet)
    beat = matchers.heartbeat(bench.node_id)
    last = bench.beats(beat, 3, after=bench.now(), patience_ns=GAP_NS)[-1]
    bench.wait_until(last.at + 40 * MS)
    asked = bench.now()
    sdo.write(PRODUCER, 0, u16(400), requirement="C-HB-01")
    written = bench.now()
    found = bench.beats(beat, 3, after=written, patience_ns=1 * S)
    least, most = bench.profile.limits.heartbeat_each_ns(400 * MS)
    for before, after in pairwise(found):
        text = "an interval after 1017h was written"
        bench.measure_between(before, after, Limits(least, most), text)
    at_once = bench.when(found[0]).earliest - written < 40 * MS
    if not at_once:
        text = "the first beat after 1017h was written"
        bench.measure_between(asked, found[0], Limits(at_least_ns=least), text)
        bench.measure_between(written, found[0], Limits(at_most_ns=most), text)


@pytest.mark.requirement("C-HB-10", "EC-03")
def test_heartbeat_has_precedence_over_guarding(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet
) -> None:
    """While 1017h is not 0 guarding requests get no answer."""
    bench.needs_exclusive()
    needs_writable(sheet, (PRODUCER, 0))
    bench.start()
    if sheet.get(GUARD_TIME) is not None:
        sdo.write(GUARD_TIME, 0, u16(100), requirement="C-NG-11")
        sdo.write(LIFE_FACTOR, 0, u8(3), requirement="C-NG-11")
    beats(sdo, 1000)
    matcher = matchers.cob(cobs.ERROR_CONTROL + bench.node_id)
    beat = bench.first(matcher, bench.now(), bench.now() + 2 * S)
    bench.check(beat is not None, "the heartbeat runs", requirement="C-HB-03")
    for turn in range(3):
        bench.wait(50 * MS)
        asked = bench.send(Frame(cobs.ERROR_CONTROL + bench.node_id, remote=True, dlc=1))
        text = f"guarding request {turn + 1} is not answered while the heartbeat runs"
        answer = bench.first(matcher, asked, bench.now() + 30 * MS)
        bench.check(answer is None, text, since=asked)


@pytest.mark.requirement("C-HB-11", "C-NMT-11")
@pytest.mark.parametrize("command", cobs.RESETS, ids=name_of)
def test_a_time_that_was_not_stored_is_gone_after_a_reset(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet, command: Nmt
) -> None:
    """The power-on value is back; one that reset communication keeps is noted."""
    needs_writable(sheet, (PRODUCER, 0))
    bench.start()
    before = sdo.number(PRODUCER)
    beats(sdo, before + 77)
    reset(bench, command)
    found = sdo.number(PRODUCER)
    text = f"1017h is {before} after {name_of(command)}; it is {found}"
    if command is Nmt.RESET_NODE:
        bench.check(found == before, text, requirement="C-NMT-11")
    elif found == before:
        bench.check(True, text)
    else:
        bench.characteristic("C-HB-11", text)


@pytest.mark.requirement("C-HB-13")
def test_a_stored_time_starts_with_the_boot_up(bench: Cia301Bench, sdo: Sdo, sheet: Sheet) -> None:
    """With 1017h not 0 from the start the first beat comes within one period."""
    needs_writable(sheet, (PRODUCER, 0))
    boot = bench.start()
    data = sdo.read(PRODUCER)
    if not number(data):
        bench.characteristic("C-HB-13", "1017h is 0 from the start")
        return
    boot = reset(bench)
    _, most = bench.profile.limits.heartbeat_each_ns(number(data) * MS)
    bench.expect(matchers.heartbeat(bench.node_id), after=boot, within=most)
