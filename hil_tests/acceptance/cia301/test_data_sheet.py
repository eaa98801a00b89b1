"""The electronic data sheet against the device that it describes (CiA 306, CiA 301 4.2.0)."""

from __future__ import annotations

import pytest

from hil_tests.acceptance.cia301.steps import IDENTITY, RPDO, TPDO, first
from hil_tests.api import Abort, Cia301Bench, EdsObject, NotApplicable, Sdo, Sheet, number

STRUCTURE = 0xFF
"""The sub-index that tells what an object is."""
PARTS = ((1, "vendor"), (2, "product"), (3, "revision"))
FIXED = frozenset({"ro", "const"})
SERVERS = range(0x1200, 0x1280)


@pytest.mark.requirement("C-EDS-08")
def test_the_device_is_the_one_that_the_sheet_names(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet
) -> None:
    """Vendor, product and revision, as far as the sheet and the device have them."""
    told = [(sub, name, getattr(sheet.device, name)) for sub, name in PARTS]
    told = [each for each in told if each[2] is not None and sheet.get(IDENTITY, each[0])]
    if not told:
        raise NotApplicable(f"{sheet.file} names no vendor, product or revision")
    bench.start()
    for sub, name, wanted in told:
        found = sdo.number(IDENTITY, sub)
        text = f"1018h:{sub:02X} is the {name} of the sheet, {wanted:08X}h; it is {found:08X}h"
        bench.check(found == wanted, text)


def expect_formula(bench: Cia301Bench, sdo: Sdo, one: EdsObject) -> None:
    """The object is its node id and a number; where it can be written it may have been."""
    assert one.default is not None
    wanted, found = int(one.default.at(bench.node_id)), sdo.number(one.index, one.sub)
    text = f"{one.place} is {wanted:08X}h with node id {bench.node_id}; it is {found:08X}h"
    if found != wanted and one.writable and not bench.stage.virtual:
        bench.characteristic("C-EDS-09", f"{text}: another value is stored")
    else:
        bench.check(found == wanted, text)


@pytest.mark.requirement("C-EDS-09")
@pytest.mark.parametrize("node_id", [None, 1, 127], ids=["own", "1", "127"])
def test_formulas_of_the_sheet_give_what_the_device_has(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet, node_id: int | None
) -> None:
    """$NODEID stands for the node id that the device has, whichever it is."""
    found = (one for one in sheet if one.readable and one.default and one.default.follows_node)
    first(found, "whose default depends on the node id")
    if node_id is None:
        bench.start()
    else:
        bench.start(node_id=node_id)
    for one in sheet:
        if one.readable and one.default is not None and one.default.follows_node:
            expect_formula(bench, sdo, one)


@pytest.mark.requirement("C-EDS-10")
@pytest.mark.parametrize(("base", "name"), [(RPDO, "rx_pdos"), (TPDO, "tx_pdos")])
def test_it_has_as_many_pdos_as_the_sheet_says(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet, base: int, name: str
) -> None:
    """NrOfRXPDO and NrOfTXPDO, as communication parameters are listed and can be read."""
    wanted = getattr(sheet.device, name)
    if wanted is None:
        raise NotApplicable(f"{sheet.file} does not tell how many PDOs there are")
    bench.start()
    listed = {one.index for one in sheet if one.index in range(base, base + 0x200)}
    served = [index for index in sorted(listed) if not isinstance(sdo.try_read(index), Abort)]
    text = f"the device has {wanted} PDOs from {base:04X}h on; it serves {len(served)}"
    bench.check(len(served) == wanted, text)


@pytest.mark.requirement("C-OD-15")
def test_sub_index_255_tells_what_the_sheet_says(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet
) -> None:
    """Where a device has it: object code in the lowest byte, data type in the two above."""
    bench.start()
    count = 0
    for group in sheet.groups.values():
        if group.object_type not in {8, 9}:
            continue
        found = sdo.try_read(group.index, STRUCTURE)
        if isinstance(found, Abort):
            continue
        count += 1
        value = number(found)
        text = f"{group.index:04X}h:FF tells object code {group.object_type}; it is {value:08X}h"
        bench.check(value & 0xFF == group.object_type and value >> 24 == 0, text)
        kind = next((one.data_type for one in group.objects if one.sub == 1), None)
        if group.object_type == 8 and kind is not None:
            text = f"{group.index:04X}h:FF tells data type {kind:04X}h; it is {value:08X}h"
            bench.check(value >> 8 & 0xFFFF == kind, text)
    if not count:
        raise NotApplicable("no object of the device has a sub-index 255")


def more_servers(sheet: Sheet) -> list[int]:
    """Parameters of SDO servers besides the default one."""
    return [index for index in SERVERS[1:] if sheet.get(index, 1) and sheet.get(index, 2)]


def identifiers(sdo: Sdo, index: int) -> tuple[int, int] | None:
    """Of requests and answers, as they are set; None = this server is not used."""
    pair = sdo.number(index, 1), sdo.number(index, 2)
    return None if any(value >> 31 for value in pair) else (pair[0] & 0x7FF, pair[1] & 0x7FF)


@pytest.mark.requirement("C-SD-19")
def test_every_further_server_serves_as_the_first(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet
) -> None:
    """Reads through it, and refusals, are the same."""
    bench.needs_exclusive()
    servers = more_servers(sheet)
    if not servers:
        raise NotApplicable(f"the device has one SDO server: {sheet.file} lists no 1201h")
    bench.start()
    used = [pair for index in servers if (pair := identifiers(sdo, index))]
    if not used:
        raise NotApplicable("no further SDO server of the device is in use")
    for asks, answers in used:
        other = Sdo(bench, bench.profile.limits.sdo_ns, asks, answers)
        for sub in range(5):
            wanted, found = sdo.try_read(IDENTITY, sub), other.try_read(IDENTITY, sub)
            text = f"1018h:{sub:02X} over {asks:03X}h is {wanted!r}; it is {found!r}"
            bench.check(found == wanted, text)
