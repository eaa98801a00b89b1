"""What a device makes of RPDOs and SYNCs that stay away or come late: its own affair.

CiA 301 4.2.0 lets it tell of them, or not (7.5.2.6, 7.5.2.7, 7.5.2.35).
"""

from __future__ import annotations

import pytest

from hil_tests.acceptance.cia301.pdo_steps import (
    SETTLE_NS,
    SYNCHRONOUS,
    find,
    receiving,
    set_up,
    sync,
    values,
)
from hil_tests.acceptance.cia301.steps import CYCLE, RPDO, WINDOW, needs_writable
from hil_tests.api import MS, Cia301Bench, Frame, Sdo, Seen, Sheet, cobs, matchers, u16, u32

DEADLINE_MS = 50
CYCLE_NS = 50 * MS
LATE_NS = 20 * MS


def told_since(bench: Cia301Bench, since: Seen) -> str:
    """The first emergency message since then, in words."""
    matcher = matchers.cob(cobs.EMCY + bench.node_id)
    seen = bench.first(matcher, since, bench.now())
    if seen is None:
        return "leads to no emergency message"
    return f"leads to EMCY {int.from_bytes(seen.frame.data[:2], 'little'):04X}h"


@pytest.mark.requirement("C-RP-05")
def test_what_an_rpdo_that_stays_away_means_is_written_down(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet
) -> None:
    """Its deadline is set, one RPDO comes, and no other."""
    index = find(sheet, RPDO)
    needs_writable(sheet, (index, 5))
    objects, can_id = receiving(bench, sdo, sheet)
    set_up(sdo, index, objects, 255, extra=[(5, u16(DEADLINE_MS))])
    sent = bench.send(Frame(can_id, b"\x22"))
    bench.wait(4 * DEADLINE_MS * MS)
    told = told_since(bench, sent)
    bench.characteristic("C-RP-05", f"an RPDO that misses its deadline {told}")


@pytest.mark.requirement("C-SY-12")
def test_what_a_sync_that_stays_away_means_is_written_down(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet
) -> None:
    """The communication cycle is set, five SYNCs come, and no other."""
    needs_writable(sheet, (CYCLE, 0))
    bench.needs_exclusive()
    bench.start()
    sdo.write(CYCLE, 0, u32(CYCLE_NS // 1000), requirement="C-SY-02")
    last = sync(bench)
    for _ in range(4):
        bench.wait(CYCLE_NS)
        last = sync(bench)
    bench.wait(10 * CYCLE_NS)
    told = told_since(bench, last)
    bench.characteristic("C-SY-12", f"a SYNC that stays away {told}")


@pytest.mark.requirement("C-SY-11")
def test_what_an_rpdo_after_the_window_means_is_written_down(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet
) -> None:
    """The next SYNC applies it, or it is lost: CiA 301 lets a device discard it."""
    needs_writable(sheet, (WINDOW, 0))
    objects, can_id = receiving(bench, sdo, sheet, SYNCHRONOUS)
    sdo.write(WINDOW, 0, u32(1), requirement="C-OD-04")
    sync(bench)
    bench.wait(LATE_NS)
    bench.send(Frame(can_id, b"\x22"))
    sync(bench)
    bench.wait(SETTLE_NS)
    found = values(sdo, objects)
    told = "is applied" if found == b"\x22" else "is discarded"
    bench.characteristic("C-SY-11", f"a synchronous RPDO that comes after the window {told}")
