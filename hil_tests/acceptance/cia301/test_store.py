"""Storing and restoring parameters (CiA 301 4.2.0, 7.5.2.13 and 7.5.2.14)."""

from __future__ import annotations

import pytest

from hil_tests.acceptance.cia301.steps import (
    CYCLE,
    OVERFLOW,
    PRODUCER,
    RESTORE,
    STORE,
    WHOLE_AREA,
    WINDOW,
    beats,
    changeable_setting,
    needs,
    needs_writable,
    reset,
)
from hil_tests.acceptance.cia301.store_steps import (
    ALL,
    APPLICATION,
    COMMUNICATION,
    LOAD,
    SAVE,
    expect_stored,
    order,
    put_back,
    storing,
)
from hil_tests.api import (
    MS,
    Abort,
    Cia301Bench,
    Nmt,
    NotApplicable,
    Power,
    Sdo,
    Sheet,
    accepted,
    sdo_frames,
    u8,
    u16,
    u32,
)

PROFILE_AREA = range(0x6000, 0xA000)
"""What sub-index 3 stores."""
ON_COMMAND, BY_ITSELF = 1, 2
VERIFY = 0x1020
"""Date and time of the configuration that is stored."""
CUTS_MS = (0, 1, 2, 3, 4, 6, 8, 12, 20, 50)
"""How long after "save" the supply fails."""
WRONG = (b"SAVE", b"evas", b"load", bytes(4), b"\xff\xff\xff\xff")


@pytest.mark.requirement("C-ST-01")
@pytest.mark.parametrize("index", [STORE, RESTORE])
def test_what_it_can_store_and_restore_is_told(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet, index: int
) -> None:
    """1010h: bit 0 on command, bit 1 by itself; 1011h: bit 0; the other bits are 0."""
    needs(sheet, (index, 1))
    bench.start()
    for one in sheet:
        if one.index != index or not one.sub:
            continue
        value = sdo.number(index, one.sub)
        bits = ON_COMMAND | BY_ITSELF if index == STORE else ON_COMMAND
        text = f"{one.place} has no bits but {bits:X}h; it is {value:08X}h"
        bench.check(not value & ~bits, text)


@pytest.mark.requirement("C-ST-01", "C-ST-02")
def test_storing_leaves_what_it_can_as_it_was(bench: Cia301Bench, sdo: Sdo, sheet: Sheet) -> None:
    """1010h:01 reads the same before and after a "save": the signature is not kept."""
    storing(bench, sheet)
    bench.start()
    before = sdo.number(STORE, ALL)
    order(bench, sdo, STORE, ALL, SAVE)
    after = sdo.number(STORE, ALL)
    bench.check(after == before, f"1010h:01 is still {before:08X}h; it is {after:08X}h")


@pytest.mark.requirement("C-ST-02", "C-ST-04")
@pytest.mark.parametrize("signature", WRONG, ids=[data.hex() for data in WRONG])
def test_a_wrong_signature_stores_nothing(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet, signature: bytes
) -> None:
    """It is refused, and what was written before is gone after a reset."""
    storing(bench, sheet)
    needs_writable(sheet, (PRODUCER, 0))
    bench.start()
    before = sdo.number(PRODUCER)
    beats(sdo, before + 33)
    outcome = sdo.try_write(STORE, ALL, signature)
    sdo.expect_abort(outcome, accepted.SIGNATURE, f"{signature!r} to 1010h:01")
    bench.wait(bench.profile.limits.store_ns)
    reset(bench)
    found = sdo.number(PRODUCER)
    bench.check(found == before, f"1017h is {before} after a reset; it is {found}")


@pytest.mark.requirement("C-ST-02", "C-ST-05")
def test_a_wrong_signature_restores_nothing(bench: Cia301Bench, sdo: Sdo, sheet: Sheet) -> None:
    """A "save" to 1011h is refused, and stored values are still there after a reset."""
    storing(bench, sheet)
    needs_writable(sheet, (PRODUCER, 0))
    bench.start()
    with put_back(bench, sdo, (PRODUCER, 0)):
        beats(sdo, 222)
        order(bench, sdo, STORE, ALL, SAVE)
        outcome = sdo.try_write(RESTORE, ALL, SAVE)
        sdo.expect_abort(outcome, accepted.SIGNATURE, "'save' to 1011h:01")
        reset(bench)
        found = sdo.number(PRODUCER)
        bench.check(found == 222, f"1017h is 222 after a reset; it is {found}")


@pytest.mark.requirement("C-ST-04", "C-ST-02", "C-ST-08")
@pytest.mark.parametrize("command", [Nmt.RESET_NODE, Nmt.RESET_COMMUNICATION])
def test_what_was_stored_survives_a_reset(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet, command: Nmt
) -> None:
    """What was changed since is gone, but for what reset communication keeps."""
    storing(bench, sheet)
    needs_writable(sheet, (PRODUCER, 0))
    bench.start()
    with put_back(bench, sdo, (PRODUCER, 0)):
        beats(sdo, 222)
        order(bench, sdo, STORE, ALL, SAVE)
        beats(sdo, 444)
        reset(bench, command)
        found = sdo.number(PRODUCER)
        text = f"1017h is 222, as it was stored; it is {found}"
        if command is Nmt.RESET_COMMUNICATION and found == 444:
            bench.characteristic("C-NMT-12", "1017h is kept over reset communication")
        else:
            bench.check(found == 222, text)


@pytest.mark.requirement("C-ST-04")
def test_what_was_stored_survives_without_supply(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet, power: Power
) -> None:
    """The supply is cut and comes back."""
    storing(bench, sheet)
    needs_writable(sheet, (PRODUCER, 0))
    bench.start()
    with put_back(bench, sdo, (PRODUCER, 0)):
        beats(sdo, 222)
        order(bench, sdo, STORE, ALL, SAVE)
        power.off()
        bench.expect_boot_up(power.on())
        found = sdo.number(PRODUCER)
        bench.check(found == 222, f"1017h is 222, as it was stored; it is {found}")


@pytest.mark.requirement("C-ST-05", "C-ST-02")
def test_load_acts_with_the_next_reset(bench: Cia301Bench, sdo: Sdo, sheet: Sheet) -> None:
    """Until then the stored value is there; then the default is."""
    storing(bench, sheet)
    needs_writable(sheet, (PRODUCER, 0))
    one = sheet.get(PRODUCER)
    if one is None or one.default is None:
        raise NotApplicable("the data sheet gives no default for 1017h")
    bench.start()
    with put_back(bench, sdo, (PRODUCER, 0)):
        beats(sdo, 222)
        order(bench, sdo, STORE, ALL, SAVE)
        order(bench, sdo, RESTORE, ALL, LOAD)
        found = sdo.number(PRODUCER)
        bench.check(found == 222, f"1017h is 222 until the reset; it is {found}")
        reset(bench)
        found = sdo.number(PRODUCER)
        wanted = int(one.default.at(bench.node_id))
        bench.check(found == wanted, f"1017h is {wanted} by default; it is {found}")


@pytest.mark.requirement("C-ST-06")
@pytest.mark.parametrize("sub", [COMMUNICATION, APPLICATION])
def test_each_group_is_stored_by_itself(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet, sub: int
) -> None:
    """Communication (1017h) with sub-index 2, the application with 3: the other is gone."""
    storing(bench, sheet, sub)
    storing(bench, sheet)
    needs_writable(sheet, (PRODUCER, 0))
    one, other = changeable_setting(sheet, PROFILE_AREA if sub == APPLICATION else WHOLE_AREA)
    place = (one.index, one.sub)
    bench.start()
    with put_back(bench, sdo, (PRODUCER, 0), place):
        before = sdo.read(*place)
        old = sdo.number(PRODUCER)
        beats(sdo, 222)
        sdo.write(*place, other)
        order(bench, sdo, STORE, sub, SAVE)
        reset(bench)
        wanted = (222, before) if sub == COMMUNICATION else (old, other)
        found = (sdo.number(PRODUCER), sdo.read(*place))
        text = f"1017h and {one.place} are {wanted[0]} and {wanted[1].hex()}"
        bench.check(found == wanted, f"{text}; they are {found[0]} and {found[1].hex()}")


@pytest.mark.requirement("C-ST-08")
def test_storing_leaves_the_device_serving(bench: Cia301Bench, sdo: Sdo, sheet: Sheet) -> None:
    """It is over in time; how long the heartbeat pauses is written down."""
    storing(bench, sheet)
    needs_writable(sheet, (PRODUCER, 0))
    bench.start()
    with put_back(bench, sdo, (PRODUCER, 0)):
        before = sdo.number(PRODUCER)
        began = bench.now()
        order(bench, sdo, STORE, ALL, SAVE)
        bench.characteristic("C-ST-08", f"stored with a heartbeat of {before} ms")
        outcome = sdo.try_read(0x1000)
        text = "SDO is served after storing"
        bench.check(not isinstance(outcome, Abort), text, since=began)


@pytest.mark.requirement("C-SY-13", "C-ST-04")
def test_the_settings_of_sync_are_stored(bench: Cia301Bench, sdo: Sdo, sheet: Sheet) -> None:
    """Cycle, window and counter, as far as the device has them."""
    storing(bench, sheet)
    wanted = {(OVERFLOW, 0): u8(10), (WINDOW, 0): u32(5_000), (CYCLE, 0): u32(20_000)}
    found = {p: sheet.get(*p) for p in wanted}
    wanted = {p: data for p, data in wanted.items() if (one := found[p]) and one.writable}
    if not wanted:
        raise NotApplicable("the device has no setting of SYNC that can be written")
    bench.start()
    if (CYCLE, 0) in wanted and sdo.number(CYCLE):
        wanted.pop((OVERFLOW, 0), None)  # which cannot be written while there is a cycle
    with put_back(bench, sdo, *reversed(wanted)):
        expect_stored(bench, sdo, wanted, "C-SY-13")


@pytest.mark.requirement("C-ST-07", "C-ST-04")
def test_a_supply_that_fails_while_it_stores_leaves_the_old_or_the_new(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet, power: Power
) -> None:
    """Two settings that are stored together are both old or both new, whenever it fails."""
    storing(bench, sheet)
    needs_writable(sheet, (PRODUCER, 0))
    other, changed = changeable_setting(sheet)
    assert other.default is not None
    values = (changed, other.default.bytes_at(bench.node_id))
    place = (other.index, other.sub)
    bench.start()
    with put_back(bench, sdo, (PRODUCER, 0), place):
        old = (u16(2000), values[1])
        write_both(sdo, place, old)
        order(bench, sdo, STORE, ALL, SAVE)
        power.off()
        bench.expect_boot_up(power.on())
        found = read_both(sdo, place)
        text = (
            f"1017h and {other.place} are {told(old)}, as they were stored; they are {told(found)}"
        )
        bench.check(found == old, text, requirement="C-ST-04")
        for turn, phase_ms in enumerate(CUTS_MS):
            new = (u16(2001 + turn), values[turn % 2])
            write_both(sdo, place, new)
            sdo.post(sdo_frames.write(STORE, ALL, SAVE))
            bench.wait(phase_ms * MS)
            power.off()
            bench.expect_boot_up(power.on())
            found = read_both(sdo, place)
            text = (
                f"1017h and {other.place} are {told(old)} or {told(new)}; they are {told(found)}"
            )
            bench.check(found in (old, new), text)
            old = found


def write_both(sdo: Sdo, place: tuple[int, int], pair: tuple[bytes, bytes]) -> None:
    """Two settings that belong together."""
    sdo.write(PRODUCER, 0, pair[0])
    sdo.write(*place, pair[1])


def read_both(sdo: Sdo, place: tuple[int, int]) -> tuple[bytes, bytes]:
    """The same two as the device has them."""
    return sdo.read(PRODUCER), sdo.read(*place)


def told(pair: tuple[bytes, bytes]) -> str:
    """Two values for people."""
    return " and ".join(data.hex() for data in pair)


@pytest.mark.requirement("C-ST-09")
def test_the_date_of_a_configuration_is_stored_and_does_not_outlive_it(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet
) -> None:
    """1020h is what was written before "save", until a setting is changed."""
    date, time = (VERIFY, 1), (VERIFY, 2)
    needs_writable(sheet, date, time, (PRODUCER, 0))
    storing(bench, sheet)
    bench.start()
    with put_back(bench, sdo, (PRODUCER, 0), date, time):
        sdo.write(*date, u32(0x3C5A))
        sdo.write(*time, u32(0x123456))
        order(bench, sdo, STORE, ALL, SAVE)
        reset(bench)
        found = (sdo.number(*date), sdo.number(*time))
        text = f"1020h is what was stored; it is {found[0]:X}h and {found[1]:X}h"
        bench.check(found == (0x3C5A, 0x123456), text)
        sdo.write(PRODUCER, 0, u16(sdo.number(PRODUCER) ^ 0x400))
        found = (sdo.number(*date), sdo.number(*time))
        text = f"1020h is 0 after a change; it is {found[0]:X}h and {found[1]:X}h"
        bench.check(found == (0, 0), text)
