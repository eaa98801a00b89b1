"""What follows the node id when LSS changes it, and what does not (CiA 301 4.2.0, 7.3.5)."""

from __future__ import annotations

import pytest

from hil_tests.acceptance.cia301.lss_steps import known, may_configure, renumbered
from hil_tests.acceptance.cia301.pdo_steps import INVALID, NO_RTR, find
from hil_tests.acceptance.cia301.steps import STORE, TPDO, beats, reset
from hil_tests.acceptance.cia301.store_steps import ALL, SAVE, order, put_back, storing
from hil_tests.api import (
    MS,
    Cia301Bench,
    Limits,
    Lss,
    NotApplicable,
    Sdo,
    Sheet,
    matchers,
    u32,
)
from hil_tests.api import lss as services

SPARE_ID = 0x1C8
"""Of no node by default (that of node 72 is 1C8h: the device under test is not that one)."""
SWITCH_MS = 200


@pytest.mark.requirement("C-PC-13")
def test_default_identifiers_follow_the_node_id(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet, lss: Lss
) -> None:
    """Those that are as the sheet says before are as it says for the new node id."""
    known(bench, sdo, sheet)
    may_configure(bench)
    found = [one for one in sheet if one.default and one.default.follows_node and one.readable]
    fresh = [
        (one, int(one.default.number))
        for one in found
        if one.default and sdo.number(one.index, one.sub) == one.default.at(bench.node_id)
    ]
    with renumbered(bench, lss) as (new, other):
        for one, base in fresh:
            value = other.number(one.index, one.sub)
            text = f"{one.place} is {base + new:08X}h with node id {new}; it is {value:08X}h"
            bench.check(value == base + new, text)


@pytest.mark.requirement("C-PC-13", "C-ST-04")
def test_an_identifier_that_was_stored_does_not(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet, lss: Lss
) -> None:
    """It is what was stored, whatever the node id is."""
    known(bench, sdo, sheet)
    may_configure(bench)
    storing(bench, sheet)
    index = find(sheet, TPDO)
    with put_back(bench, sdo, (index, 1)):
        sdo.write(index, 1, u32(INVALID | NO_RTR | SPARE_ID), requirement="C-PC-04")
        order(bench, sdo, STORE, ALL, SAVE)
        reset(bench)
        value = sdo.number(index, 1)
        text = f"{index:04X}h:01 is {SPARE_ID:03X}h, as it was stored; it is {value:08X}h"
        bench.check(value & 0x7FF == SPARE_ID, text, requirement="C-ST-04")
        with renumbered(bench, lss) as (_, other):
            value = other.number(index, 1)
        text = f"{index:04X}h:01 is still {SPARE_ID:03X}h; it is {value:08X}h"
        bench.check(value & 0x7FF == SPARE_ID, text)


@pytest.mark.requirement("C-LS-05")
def test_a_new_bit_timing_begins_with_a_silence(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet, lss: Lss
) -> None:
    """The second of two switch delays is silent, then it is back; the bit rate stays the same."""
    known(bench, sdo, sheet)
    may_configure(bench)
    beats(sdo, 20)
    lss.configure()
    index = services.BIT_RATES[bench.stage.bit_rate]
    found = lss.set_bit_timing(index)
    if found != 0:
        raise NotApplicable(f"the device's bit timing is not set by LSS; it answers {found}")
    bench.tolerate_missing_boot_up()
    sent = lss.tell(services.activate(SWITCH_MS))
    slack = SWITCH_MS * MS // 10
    quiet_from = sent.at + SWITCH_MS * MS + slack
    back_at = sent.at + 2 * SWITCH_MS * MS
    bench.wait_until(quiet_from)
    anything = matchers.anything()
    bench.never(anything, after=quiet_from, for_ns=SWITCH_MS * MS - 2 * slack)
    bench.expect(
        matchers.heartbeat(bench.node_id),
        after=back_at - slack,
        within=Limits(at_most_ns=2 * SWITCH_MS * MS),
    )
    lss.leave()
    reset(bench)
