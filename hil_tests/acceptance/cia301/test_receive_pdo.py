"""RPDOs of any device that lets them be set up (CiA 301 4.2.0, 7.2.2 and 7.5.2.35)."""

from __future__ import annotations

import pytest

from hil_tests.acceptance.cia301.pdo_steps import (
    EVENT,
    RECEIVED,
    SETTLE_NS,
    SYNCHRONOUS,
    expect_default_ids,
    find,
    mappable,
    numbered,
    receiving,
    set_up,
    sync,
    values,
)
from hil_tests.acceptance.cia301.steps import RPDO, expect_emcy, first, go
from hil_tests.acceptance.nmt_steps import name_of
from hil_tests.api import (
    MS,
    Cia301Bench,
    EdsObject,
    Frame,
    NotApplicable,
    Sdo,
    Sheet,
    State,
    matchers,
    u32,
)

DEFAULT_IDS = {0x1400: 0x200, 0x1401: 0x300, 0x1402: 0x400, 0x1403: 0x500}


def expect_values(
    bench: Cia301Bench, sdo: Sdo, objects: list[EdsObject], wanted: bytes, rule: str, what: str
) -> None:
    """The objects have these values after a while."""
    bench.wait(SETTLE_NS)
    found = values(sdo, objects)
    text = f"{what} leaves {wanted.hex(' ')}; SDO reads {found.hex(' ')}"
    bench.check(found == wanted, text, requirement=rule)


def works(bench: Cia301Bench, sdo: Sdo, objects: list[EdsObject], can_id: int) -> None:
    """An RPDO of exact length is applied, with a SYNC where it waits for one."""
    data = bytes(range(0x71, 0x71 + len(objects)))
    bench.send(Frame(can_id, data))
    sync(bench)
    expect_values(bench, sdo, objects, data, "C-RP-04", "an RPDO of exact length")


@pytest.mark.requirement("C-RP-01")
def test_default_identifiers_are_those_of_the_node(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet
) -> None:
    """200h, 300h, 400h and 500h + node id, unless somebody stored others."""
    bench.start()
    expect_default_ids(bench, sdo, sheet, DEFAULT_IDS, "C-RP-01")


@pytest.mark.requirement("C-RP-02", "C-RP-04", "C-PC-04")
@pytest.mark.parametrize("kind", [254, 255])
def test_an_event_driven_rpdo_is_applied_at_once(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet, kind: int
) -> None:
    """SDO reads what it carried."""
    objects, can_id = receiving(bench, sdo, sheet, kind, 2)
    bench.send(Frame(can_id, b"\x22\x33"))
    expect_applied(bench, sdo, objects, b"\x22\x33", "C-RP-02")


def expect_applied(
    bench: Cia301Bench, sdo: Sdo, objects: list[EdsObject], data: bytes, rule: str
) -> None:
    """The RPDO that was sent has been applied at once.

    If a SYNC must come first, `rule` is broken; else the RPDO was not applied at all.
    """
    bench.wait(SETTLE_NS)
    found = values(sdo, objects)
    text = f"an RPDO of exact length leaves {data.hex(' ')}; SDO reads {found.hex(' ')}"
    if found != data:
        sync(bench)
        bench.wait(SETTLE_NS)
        waits = values(sdo, objects) == data
        rule, text = (rule, f"{text} until a SYNC comes") if waits else ("C-RP-04", text)
    bench.check(found == data, text, requirement=rule)


@pytest.mark.requirement("C-PC-12", "C-RP-04")
def test_another_transmission_type_acts_at_once(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet
) -> None:
    """Set from synchronous to event-driven in operational: the next RPDO waits for no SYNC."""
    objects, can_id = receiving(bench, sdo, sheet, SYNCHRONOUS)
    works(bench, sdo, objects, can_id)
    set_up(sdo, find(sheet, RPDO), objects, EVENT, requirement="C-PC-12")
    bench.send(Frame(can_id, b"\x22"))
    expect_applied(bench, sdo, objects, b"\x22", "C-PC-12")


@pytest.mark.requirement("C-RP-02")
@pytest.mark.parametrize("kind", [0, 1, 240])
def test_a_synchronous_rpdo_waits_for_the_sync(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet, kind: int
) -> None:
    """Not applied before, and applied with the next one whatever its type is."""
    objects, can_id = receiving(bench, sdo, sheet, kind)
    bench.send(Frame(can_id, b"\x22"))
    expect_values(bench, sdo, objects, b"\x11", "C-RP-02", "an RPDO before its SYNC")
    sync(bench)
    expect_values(bench, sdo, objects, b"\x22", "C-RP-02", "the SYNC after an RPDO")


@pytest.mark.requirement("C-RP-03", "C-NMT-14")
@pytest.mark.parametrize("state", [State.PRE_OPERATIONAL, State.STOPPED], ids=name_of)
def test_an_rpdo_is_ignored_outside_operational(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet, state: State
) -> None:
    """In pre-operational and stopped; later it is not applied either."""
    objects, can_id = receiving(bench, sdo, sheet)
    go(bench, state)
    bench.send(Frame(can_id, b"\x22"))
    bench.wait(SETTLE_NS)
    go(bench, State.OPERATIONAL)
    expect_values(bench, sdo, objects, b"\x11", "C-RP-03", f"an RPDO in {state}")


@pytest.mark.requirement("C-RP-07", "C-RP-02")
def test_the_last_rpdo_before_a_sync_counts(bench: Cia301Bench, sdo: Sdo, sheet: Sheet) -> None:
    """Of three the third is applied."""
    objects, can_id = receiving(bench, sdo, sheet, SYNCHRONOUS)
    works(bench, sdo, objects, can_id)
    for value in (0x22, 0x33, 0x44):
        bench.send(Frame(can_id, bytes((value,))))
    sync(bench)
    expect_values(bench, sdo, objects, b"\x44", "C-RP-07", "three RPDOs and a SYNC")


@pytest.mark.requirement("C-RP-08")
def test_remote_and_29_bit_frames_are_no_rpdos(bench: Cia301Bench, sdo: Sdo, sheet: Sheet) -> None:
    """With the identifier of the RPDO."""
    objects, can_id = receiving(bench, sdo, sheet)
    bench.send(Frame(can_id, remote=True, dlc=1))
    bench.send(Frame(can_id, b"\x22", extended=True))
    expect_values(bench, sdo, objects, b"\x11", "C-RP-08", "a strange frame")


@pytest.mark.requirement("C-EM-18")
def test_a_short_rpdo_is_not_applied_and_told(bench: Cia301Bench, sdo: Sdo, sheet: Sheet) -> None:
    """One byte where two are mapped: EMCY 8210h, and the objects keep their values."""
    objects, can_id = receiving(bench, sdo, sheet, count=2)
    works(bench, sdo, objects, can_id)
    before = values(sdo, objects)
    sent = bench.send(Frame(can_id, b"\x22"))
    within = bench.profile.limits.emcy_ns + bench.profile.limits.event_pdo_ns
    expect_emcy(bench, 0x8210, after=sent, within=within, requirement="C-EM-18")
    expect_values(bench, sdo, objects, before, "C-EM-18", "a short RPDO")


@pytest.mark.requirement("C-EM-23")
def test_1029h_does_not_react_to_a_short_rpdo(bench: Cia301Bench, sdo: Sdo, sheet: Sheet) -> None:
    """The device stays operational: an RPDO of right length is applied afterwards."""
    objects, can_id = receiving(bench, sdo, sheet, count=2)
    works(bench, sdo, objects, can_id)
    bench.send(Frame(can_id, b"\x22"))
    bench.wait(200 * MS)
    bench.send(Frame(can_id, b"\x33\x44"))
    expect_values(bench, sdo, objects, b"\x33\x44", "C-EM-23", "an RPDO after a short one")


@pytest.mark.requirement("C-EM-19")
def test_what_a_long_rpdo_leads_to_is_written_down(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet
) -> None:
    """Three bytes where two are mapped."""
    objects, can_id = receiving(bench, sdo, sheet, count=2)
    sent = bench.send(Frame(can_id, b"\x22\x33\x44"))
    emcy = matchers.emcy(bench.node_id, code=0x8220)
    seen = bench.first(emcy, sent, bench.now() + 100 * MS)
    applied = values(sdo, objects) == b"\x22\x33"
    told = f"{'applied' if applied else 'not applied'}, {'with' if seen else 'without'} EMCY 8220h"
    bench.characteristic("C-EM-19", f"an RPDO that is too long is {told}")


@pytest.mark.requirement("C-RP-06")
def test_dummy_entries_skip_their_bits(bench: Cia301Bench, sdo: Sdo, sheet: Sheet) -> None:
    """A byte that nobody wants before the one that is mapped."""
    if 0x05 not in sheet.device.dummies:
        raise NotApplicable("the device has no dummy of one byte (0005h)")
    bench.needs_exclusive()
    bench.needs_writes("application objects are written")
    index = find(sheet, RPDO)
    found = (one for one in mappable(sheet, RECEIVED) if one.kind.size == 1)
    one = first(found, "of one byte that an RPDO can fill")
    bench.start()
    can_id = set_up(sdo, index, [one], EVENT)
    go(bench, State.OPERATIONAL)
    works(bench, sdo, [one], can_id)
    go(bench, State.PRE_OPERATIONAL)
    set_up(sdo, index, [u32(0x0005_0008), one], EVENT, requirement="C-RP-06")
    sdo.write(one.index, one.sub, b"\x11")
    go(bench, State.OPERATIONAL)
    bench.send(Frame(can_id, b"\x22\x33"))
    expect_values(bench, sdo, [one], b"\x33", "C-RP-06", "an RPDO with a dummy in front")


@pytest.mark.requirement("C-RP-04", "C-PC-04")
def test_numbers_of_several_bytes_are_filled_low_byte_first(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet
) -> None:
    """A number of two to four bytes."""
    bench.needs_exclusive()
    bench.needs_writes("application objects are written")
    index = find(sheet, RPDO)
    found = (one for one in mappable(sheet, RECEIVED) if one.kind.size > 1)
    one = first(found, "of several bytes that an RPDO can fill")
    bench.start()
    can_id = set_up(sdo, index, [one], EVENT)
    go(bench, State.OPERATIONAL)
    data = numbered(one, 0x12345678)
    bench.send(Frame(can_id, data))
    expect_values(bench, sdo, [one], data, "C-RP-04", "an RPDO of exact length")
