"""Emergency messages of several errors, held back, in stopped (CiA 301 4.2.0, 7.2.7)."""

from __future__ import annotations

import pytest

from hil_tests.acceptance.cia301.error_steps import SPAN_NS, Trouble, trouble
from hil_tests.acceptance.cia301.steps import (
    CONSUMER,
    INHIBIT,
    LIFE_GUARD_CODE,
    go,
    needs_writable,
)
from hil_tests.api import MS, Cia301Bench, Frame, Sdo, Sheet, State, cobs, matchers, u16, u32

HELD_NS = 600 * MS
"""Inhibit time: longer than an error takes to come, go and come again."""


def codes(bench: Cia301Bench, since: int) -> list[int]:
    """Of the emergency messages that came since then, in order."""
    matcher = matchers.cob(cobs.EMCY + bench.node_id)
    found = bench.collect(matcher, after=since, until=bench.now())
    return [int.from_bytes(seen.frame.data[:2], "little") for seen in found]


@pytest.mark.requirement("C-NMT-18")
def test_what_becomes_of_an_error_in_stopped_is_written_down(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet
) -> None:
    """It is told when the device leaves stopped, or never."""
    error = trouble(bench, sdo, sheet)
    go(bench, State.STOPPED)
    error.arise()
    since = bench.now()
    go(bench, State.PRE_OPERATIONAL)
    bench.wait(bench.profile.limits.emcy_ns)
    told = "is told on leaving stopped" if LIFE_GUARD_CODE in codes(bench, since) else "is lost"
    bench.characteristic("C-NMT-18", f"an error that arises in stopped {told}")


@pytest.mark.requirement("C-EM-16")
def test_an_inhibit_time_keeps_the_order(bench: Cia301Bench, sdo: Sdo, sheet: Sheet) -> None:
    """An error that comes and goes twice; what a device cannot keep may be lost."""
    needs_writable(sheet, (INHIBIT, 0))
    error = trouble(bench, sdo, sheet)
    sdo.write(INHIBIT, 0, u16(HELD_NS // (100_000)), requirement="C-EM-15")
    error.arise()
    bench.wait(3 * HELD_NS)
    since = bench.now()
    error.arise()
    error.arise()
    error.keep_away(5 * HELD_NS)
    wanted = [0, LIFE_GUARD_CODE, 0, LIFE_GUARD_CODE, 0]
    found = [code for code in codes(bench, since) if code in wanted]
    rest = iter(wanted)
    text = "the error goes, comes, goes, comes and goes, and so do its messages"
    told = ", ".join(f"{code:04X}h" for code in found)
    bench.check(all(code in rest for code in found), f"{text}; they were {told}")
    if found != wanted:
        bench.characteristic("C-EM-16", f"{len(found)} of 5 messages outlast an inhibit time")


@pytest.mark.requirement("C-EM-05")
def test_whether_the_end_of_one_of_two_errors_is_told_is_written_down(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet
) -> None:
    """Two nodes fall silent, and one comes back."""
    needs_writable(sheet, (CONSUMER, 1), (CONSUMER, 2))
    first = trouble(bench, sdo, sheet)
    assert first.other is not None
    second = Trouble(bench, first.other % 126 + 1)
    assert second.other is not None
    sdo.write(CONSUMER, 2, u32(second.other << 16 | SPAN_NS // MS), requirement="C-HBC-01")
    bench.send(Frame(cobs.ERROR_CONTROL + second.other, b"\x05"))
    first.arise()
    since = bench.now()
    first.heal()
    bench.wait(bench.profile.limits.life_ns + bench.profile.limits.emcy_ns)
    matcher = matchers.emcy(bench.node_id, code=0x0000)
    seen = bench.collect(matcher, after=since, until=bench.now())
    told = f"is told by {seen[0].frame}" if seen else "is not told"
    bench.characteristic("C-EM-05", f"the end of one of two errors {told}")
