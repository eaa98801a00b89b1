"""What a device stands: long runs, load, error frames, a supply that comes and goes."""

from __future__ import annotations

import pytest

from hil_tests.acceptance.cia301.steps import (
    DEVICE_TYPE,
    PRODUCER,
    beats,
    enter,
    needs_writable,
    quick,
    rhythm,
)
from hil_tests.api import (
    MS,
    Cia301Bench,
    Frame,
    NotApplicable,
    Power,
    Sdo,
    Sheet,
    State,
    matchers,
    sdo_frames,
)

MANY = 1001
PERIOD_MS = 20
PAUSES_MS = (0, 1, 50, 300, 0, 10, 1000, 0)
"""How long beyond its shortest time the supply stays off."""


@pytest.mark.requirement("C-HB-12")
def test_a_thousand_beats_keep_the_period(bench: Cia301Bench, sdo: Sdo, sheet: Sheet) -> None:
    """Each interval and their mean, in operational."""
    needs_writable(sheet, (PRODUCER, 0))
    bench.start()
    beats(sdo, PERIOD_MS)
    enter(bench, State.OPERATIONAL)
    rhythm(bench, PERIOD_MS, bench.now(), "C-HB-12", count=MANY)


@pytest.mark.timed("only arbitration shows who had to wait for whom")
@pytest.mark.requirement("C-RB-05")
@pytest.mark.parametrize(
    ("share", "can_id"), [(60, 0x010), (95, 0x7FF)], ids=["60-higher", "95-lower"]
)
def test_load_on_the_bus_delays_nothing_that_it_asks_for(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet, share: int, can_id: int
) -> None:
    """Heartbeats and SDO answers are asked for in time, however long they wait for the bus."""
    quick(bench, sdo, sheet)
    bench.needs_load([Frame(can_id, bytes(8))], share * 10_000)
    for _ in range(20):
        sdo.serves("C-RB-05")
    rhythm(bench, 100, bench.now(), "C-RB-05", count=25)


@pytest.mark.requirement("C-RB-04")
def test_error_frames_reset_nothing(bench: Cia301Bench, sdo: Sdo, sheet: Sheet) -> None:
    """It goes on in its state and serves; no boot-up comes that nobody asked for."""
    quick(bench, sdo, sheet)
    enter(bench, State.OPERATIONAL)
    since = bench.now()
    for _ in range(10):
        bench.needs_error_frames()
        bench.wait(20 * MS)
    sdo.serves("C-RB-04")
    boots = bench.collect(matchers.boot_up(bench.node_id), after=since, until=bench.now())
    bench.check(not boots, f"no boot-up; there were {len(boots)}")
    bench.expect_state(State.OPERATIONAL, after=bench.now(), requirement="C-RB-04")


@pytest.mark.requirement("C-RB-07")
def test_a_supply_that_comes_and_goes_is_survived(
    bench: Cia301Bench, sdo: Sdo, power: Power
) -> None:
    """Again and again, off for a short or a long time: it starts each time, and serves."""
    bench.start()
    for pause_ms in PAUSES_MS:
        power.off()
        bench.wait(pause_ms * MS)
        bench.expect_boot_up(power.on(), "C-RB-07")
        sdo.serves("C-RB-07")


@pytest.mark.requirement("C-RB-08")
@pytest.mark.parametrize("node_id", [1, 127])
def test_it_works_under_the_outermost_node_ids(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet, node_id: int
) -> None:
    """Boot-up, SDO, heartbeat and NMT, as under its own."""
    shows = sheet.get(PRODUCER) is not None
    bench.start()
    if shows:
        beats(sdo)
        enter(bench, State.OPERATIONAL)
    bench.fresh(node_id=node_id)
    bench.expect_boot_up(bench.switch_on(), "C-RB-08")
    sdo.serves("C-RB-08")
    if shows:
        beats(sdo)
        enter(bench, State.OPERATIONAL, "C-RB-08")


@pytest.mark.requirement("C-RB-08")
def test_it_works_at_every_bit_rate_of_the_sheet(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet
) -> None:
    """It boots up and answers, as at its own."""
    if not sheet.device.bit_rates:
        raise NotApplicable(f"{sheet.file} lists no bit rate")
    bench.start()
    for bit_rate in sheet.device.bit_rates:
        bench.fresh(bit_rate=bit_rate)
        bench.expect_boot_up(bench.switch_on(), "C-RB-08")
        answer = sdo.ask(sdo_frames.read(DEVICE_TYPE, 0), "C-RB-08")
        text = f"1000h is read at {bit_rate} bit/s; the answer is {answer.hex(' ')}"
        bench.check(answer[0] == 0x43, text)
