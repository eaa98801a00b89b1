"""Where, whether and how often emergency messages are sent: 1014h, 1015h, and the NMT state."""

from __future__ import annotations

from itertools import pairwise

import pytest

from hil_tests.acceptance.drive.error_steps import (
    EMCY_ID,
    ERROR_FIELD,
    INHIBIT,
    QUICK,
    change,
    emcy,
    expect_field,
    expect_register,
    field,
    messages_after,
    nothing_told,
    shown,
    start_proven,
    told_of,
)
from hil_tests.api import (
    MS,
    Cia301Bench,
    Faults,
    Limits,
    Nmt,
    S,
    Sdo,
    accepted,
    cobs,
    matchers,
    number,
    u8,
    u16,
    u32,
)

INVALID = 1 << 31
OTHER_ID = 0x6D0
"""An identifier that no service has."""
SPREAD_NS = 1 * MS
"""What clocks, and frames that are on their way, may take from an inhibit time."""


@pytest.mark.requirement("EM-07")
def test_the_identifier_is_80h_and_the_node_id(bench: Cia301Bench, sdo: Sdo) -> None:
    """1014h says so by default, and is valid."""
    bench.start(QUICK)
    right, found = cobs.EMCY + bench.node_id, number(sdo.read(EMCY_ID))
    bench.check(found == right, f"1014h is {right:08X}h; it is {found:08X}h")


@pytest.mark.requirement("EM-07")
def test_messages_can_be_switched_off(bench: Cia301Bench, sdo: Sdo, faults: Faults) -> None:
    """With bit 31 of 1014h none comes; register and error field go on; without it they come."""
    start_proven(bench, sdo, faults)
    sdo.write(ERROR_FIELD, 0, u8(0), requirement="EM-05")
    cob_id = number(sdo.read(EMCY_ID))
    sdo.write(EMCY_ID, 0, u32(cob_id | INVALID))
    name = faults.names[0]
    moment = faults.occur(name)
    nothing_told(bench, moment, 500 * MS)
    expect_register(bench, sdo, faults)
    expect_field(bench, sdo, [faults.known[name].code])
    moment = faults.heal()
    nothing_told(bench, moment, 500 * MS)
    sdo.write(EMCY_ID, 0, u32(cob_id))
    told_of(bench, faults.occur(name))


@pytest.mark.requirement("EM-07")
def test_messages_can_have_another_identifier(
    bench: Cia301Bench, sdo: Sdo, faults: Faults
) -> None:
    """Set while it is invalid: messages come there, and no longer under the old one."""
    start_proven(bench, sdo, faults)
    sdo.write(EMCY_ID, 0, u32(cobs.EMCY + bench.node_id | INVALID))
    sdo.write(EMCY_ID, 0, u32(OTHER_ID))
    other = matchers.cob(OTHER_ID, f"an emergency message {OTHER_ID:03X}h")
    within = bench.profile.limits.emcy_ns
    for name in faults.names[:2]:
        moment = faults.exactly(name)
        found = bench.expect(other, after=moment, within=within)
        code, told = faults.known[name].code, int.from_bytes(found.frame.data[:2], "little")
        bench.check(told == code, f"the code is {code:04X}h; it is {told:04X}h", since=moment)
        bench.never(emcy(bench), after=moment, for_ns=200 * MS)


@pytest.mark.requirement("EM-07")
def test_the_identifier_of_a_valid_object_is_kept(
    bench: Cia301Bench, sdo: Sdo, faults: Faults
) -> None:
    """While 1014h is valid another identifier is refused, and changes nothing."""
    start_proven(bench, sdo, faults)
    cob_id = number(sdo.read(EMCY_ID))
    outcome = sdo.try_write(EMCY_ID, 0, u32(OTHER_ID))
    sdo.expect_abort(outcome, accepted.EMCY_ID, f"{OTHER_ID:03X}h to 1014h, which is valid")
    found = number(sdo.read(EMCY_ID))
    bench.check(found == cob_id, f"1014h stays {cob_id:08X}h; it is {found:08X}h")
    told_of(bench, faults.occur(faults.names[0]), "EM-07")


@pytest.mark.requirement("EM-07")
@pytest.mark.parametrize("inhibit_ms", [100, 1500])
def test_the_inhibit_time_lies_between_messages(
    bench: Cia301Bench, sdo: Sdo, faults: Faults, inhibit_ms: int
) -> None:
    """Errors in quick succession: messages no closer than 1015h, in order; none is early."""
    start_proven(bench, sdo, faults)
    sdo.write(INHIBIT, 0, u16(inhibit_ms * 10))
    names = faults.names[:3]
    began_at = bench.now()
    for name in names:
        faults.occur(name)
        bench.wait(5 * MS)
    until = bench.now() + 3 * inhibit_ms * MS + 200 * MS
    bench.wait_until(until)
    found = bench.collect(emcy(bench), after=began_at, until=until)
    bench.check(bool(found), "the first error is told", requirement="EM-01", since=began_at)
    apart = Limits(at_least_ns=inhibit_ms * MS - spread_ns(bench))
    for first, second in pairwise(found):
        text = "from one emergency message to the next"
        bench.measure_between(first, second, apart, text, since=first)
    codes = [int.from_bytes(one.frame.data[:2], "little") for one in found]
    right = [faults.known[name].code for name in names]
    orderly = [code for code in right if code in codes] == codes
    text = f"the errors are told in the order {shown(right)}; it was {shown(codes)}"
    bench.check(orderly, text, since=began_at)
    text = f"of {len(names)} errors within the inhibit time {len(found)} are told"
    bench.characteristic("EM-07", text)


def spread_ns(bench: Cia301Bench) -> int:
    """What clocks, and the host of a model, may take from an inhibit time."""
    return SPREAD_NS if bench.stage.port.timed else 10 * SPREAD_NS


@pytest.mark.requirement("EM-07")
def test_the_inhibit_time_delays_no_lonely_message(
    bench: Cia301Bench, sdo: Sdo, faults: Faults
) -> None:
    """Where the last message is long ago, the next one comes at once."""
    start_proven(bench, sdo, faults)
    sdo.write(INHIBIT, 0, u16(2_000))
    bench.wait(1 * S)
    for name in faults.names[:3]:
        told_of(bench, faults.exactly(name), "EM-07")
        bench.wait(1 * S)


@pytest.mark.requirement("EM-08")
def test_nothing_is_told_in_stopped(bench: Cia301Bench, sdo: Sdo, faults: Faults) -> None:
    """An error that comes in stopped is not told there; it is known afterwards."""
    bench.start(QUICK)
    sdo.write(ERROR_FIELD, 0, u8(0), requirement="EM-05")
    bench.enter(Nmt.STOP)
    one = faults.names[0]
    first = faults.occur(one)
    nothing_told(bench, first, 1 * S)
    left = bench.nmt(Nmt.PRE_OPERATIONAL)
    limits = bench.profile.limits
    until = left.at + limits.command_ns + limits.emcy_ns
    bench.wait_until(until)
    found = bench.collect(emcy(bench), after=left, until=until)
    told = ", ".join(str(seen.frame) for seen in found) or "nothing"
    bench.characteristic("EM-08", f"told on leaving stopped of errors that occurred there: {told}")
    expect_register(bench, sdo, faults)
    codes = field(sdo)
    code = faults.known[one].code
    text = f"1003h holds {code:04X}h, which occurred in stopped; it holds {shown(codes)}"
    bench.check(code in codes, text, requirement="EM-04")


@pytest.mark.requirement("EM-08")
@pytest.mark.parametrize("command", [Nmt.PRE_OPERATIONAL, Nmt.START], ids=["pre-op", "op"])
def test_after_stopped_errors_are_told_again(
    bench: Cia301Bench, sdo: Sdo, faults: Faults, command: Nmt
) -> None:
    """Having left stopped, the device tells errors as before."""
    bench.start(QUICK)
    bench.enter(Nmt.STOP)
    bench.enter(command)
    change(bench, sdo, faults, frozenset(faults.names[:1]))
    change(bench, sdo, faults, frozenset())


@pytest.mark.requirement("EM-08", "EM-01", "C-NMT-02", "C-EM-24")
def test_an_error_at_power_on_is_told_after_the_boot_up(
    bench: Cia301Bench, faults: Faults
) -> None:
    """While the device initialises nothing is told; after the boot-up the error is."""
    bench.fresh(QUICK)
    name = faults.names[0]
    since = faults.occur(name)
    boot = bench.boot()
    early = bench.collect(emcy(bench), after=since, until=boot.at)
    early = [seen for seen in early if seen.index < boot.index]
    text = f"no message comes before the boot-up; there was {[str(one.frame) for one in early]}"
    bench.check(not early, text, requirement="C-EM-24", since=boot)
    messages = matchers.emcy(bench.node_id, code=faults.known[name].code)
    bench.expect(messages, after=boot, within=bench.profile.limits.emcy_ns, requirement="EM-01")
    messages_after(bench, faults.heal())
