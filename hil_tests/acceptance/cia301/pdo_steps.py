"""Steps that the tests of PDOs share: which PDO, what it can map, and how it is set up."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from hil_tests.acceptance.cia301.steps import APPLICATION, RPDO, TPDO, first, go, needs_writable
from hil_tests.api import (
    MS,
    Cia301Bench,
    EdsObject,
    Frame,
    NotApplicable,
    Sdo,
    Seen,
    Sheet,
    State,
    cobs,
    matchers,
    u8,
    u16,
    u32,
)

INVALID, NO_RTR = 1 << 31, 1 << 30
MAPPING = 0x200
"""From the communication parameter of a PDO to its mapping."""

SENT, RECEIVED = frozenset({"rw", "rwr"}), frozenset({"rw", "rww"})
EVENT = 255
SYNCHRONOUS = 1

SETTLE_NS = 20 * MS
"""How long an RPDO may take to be applied."""


def find(sheet: Sheet, base: int) -> int:
    """The first PDO of a direction that can be set up and mapped anew."""
    for index in range(base, base + 0x200):
        parts = [(index, 1), (index, 2), (index + MAPPING, 0), (index + MAPPING, 1)]
        objects = [sheet.get(*part) for part in parts]
        if all(one is not None and one.writable for one in objects):
            return index
    direction = "RPDO" if base == RPDO else "TPDO"
    raise NotApplicable(f"the device has no {direction} that can be set up")


def mappable(sheet: Sheet, access: frozenset[str]) -> Iterator[EdsObject]:
    """Whole numbers of the application that can be mapped, read and written."""
    return (
        one
        for one in sheet
        if one.index in APPLICATION
        and one.pdo
        and one.access in access
        and one.kind.name.startswith(("INTEGER", "UNSIGNED"))
        and one.kind.size <= 4
        and one.low is None
        and one.high is None
    )


def one_mappable(sheet: Sheet, access: frozenset[str]) -> EdsObject:
    """The first of them."""
    return first(mappable(sheet, access), "that can be mapped and written")


def entry(one: EdsObject) -> bytes:
    """A mapping entry for a whole object."""
    return u32(one.index << 16 | one.sub << 8 | one.kind.size * 8)


def set_up(
    sdo: Sdo,
    index: int,
    objects: Sequence[EdsObject | bytes],
    kind: int,
    *,
    flags: int = NO_RTR,
    extra: Sequence[tuple[int, bytes]] = (),
    requirement: str = "C-PC-04",
) -> int:
    """Map objects into a PDO and make it valid, in the five steps of CiA 301.

    Args:
        sdo: the client.
        index: its communication parameter.
        objects: in their order; bytes are taken as mapping entries.
        kind: transmission type.
        flags: of its COB-ID; of a TPDO alone.
        extra: further sub-indices of the communication parameter, while it is invalid.
        requirement: that these steps work.

    Returns:
        Its identifier.
    """
    can_id = sdo.number(index, 1) & 0x7FF
    flags = flags if index >= TPDO else 0
    rule = {"requirement": requirement}
    sdo.write(index, 1, u32(INVALID | flags | can_id), **rule)
    sdo.write(index + MAPPING, 0, u8(0), **rule)
    for sub, one in enumerate(objects, 1):
        value = one if isinstance(one, bytes) else entry(one)
        sdo.write(index + MAPPING, sub, value, **rule)
    sdo.write(index + MAPPING, 0, u8(len(objects)), **rule)
    sdo.write(index, 2, u8(kind), **rule)
    for sub, value in extra:
        sdo.write(index, sub, value, **rule)
    sdo.write(index, 1, u32(flags | can_id), **rule)
    return can_id


def quiet_others(sdo: Sdo, sheet: Sheet, but: int) -> None:
    """All other TPDOs are made invalid, so that they are not taken for the one under test."""
    for index in range(TPDO, TPDO + 0x200):
        one = sheet.get(index, 1)
        if index == but or one is None or not one.writable:
            continue
        value = sdo.number(index, 1)
        if not value & INVALID:
            sdo.write(index, 1, u32(value | INVALID), requirement="C-TP-01")


def receiving(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet, kind: int = EVENT, count: int = 1
) -> tuple[list[EdsObject], int]:
    """An operational device whose first RPDO fills some objects: those, and its identifier."""
    bench.needs_exclusive()
    bench.needs_writes("application objects are written")
    index = find(sheet, RPDO)
    found = [one for one in mappable(sheet, RECEIVED) if one.kind.size == 1]
    if len(found) < count:
        raise NotApplicable(f"the device has no {count} bytes that an RPDO can fill")
    objects = found[:count]
    bench.start()
    can_id = set_up(sdo, index, objects, kind)
    for one in objects:
        sdo.write(one.index, one.sub, b"\x11")
    go(bench, State.OPERATIONAL)
    return objects, can_id


def values(sdo: Sdo, objects: list[EdsObject]) -> bytes:
    """What SDO reads of them."""
    return b"".join(sdo.read(one.index, one.sub) for one in objects)


def sending(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet, kind: int, **how: object
) -> tuple[int, EdsObject, int]:
    """A started device whose first TPDO carries one object: its parameter, object, identifier."""
    bench.needs_exclusive()
    bench.needs_writes("application objects are written")
    index, one = find(sheet, TPDO), one_mappable(sheet, SENT)
    bench.start()
    quiet_others(sdo, sheet, index)
    can_id = set_up(sdo, index, [one], kind, **how)  # type: ignore[arg-type]
    return index, one, can_id


def timed(bench: Cia301Bench, sdo: Sdo, sheet: Sheet, timer_ms: int) -> tuple[int, EdsObject, int]:
    """An operational device whose first TPDO is sent by its event timer: as `sending`."""
    index = find(sheet, TPDO)
    needs_writable(sheet, (index, 5))
    inhibit = [(3, u16(0))] if sheet.get(index, 3) else []
    found = sending(bench, sdo, sheet, EVENT, extra=[*inhibit, (5, u16(timer_ms))])
    go(bench, State.OPERATIONAL)
    return found


def change(sdo: Sdo, one: EdsObject, value: int) -> bytes:
    """Write a mapped object; its bytes."""
    data = numbered(one, value)
    sdo.write(one.index, one.sub, data)
    return data


def answered(bench: Cia301Bench, can_id: int, after: Seen, requirement: str) -> Seen:
    """The TPDO follows a SYNC in time."""
    within = bench.profile.limits.sync_pdo_ns
    matcher = matchers.cob(can_id, f"TPDO {can_id:03X}h")
    return bench.expect(matcher, after=after, within=within, requirement=requirement)


def sync(bench: Cia301Bench, data: bytes = b"") -> Seen:
    """A SYNC of the tester."""
    return bench.send(Frame(cobs.SYNC, data))


def numbered(one: EdsObject, value: int) -> bytes:
    """A number in the bytes of an object."""
    mask = (1 << 8 * one.kind.size) - 1
    return (value & mask).to_bytes(one.kind.size, "little")


def expect_default_ids(
    bench: Cia301Bench, sdo: Sdo, sheet: Sheet, wanted: Mapping[int, int], requirement: str
) -> None:
    """The PDOs that the device has use the identifiers of the predefined connection set.

    `wanted` gives the identifier, less the node id, for the index of each communication
    parameter. A real device may have stored others; that is written down then.
    """
    found = [index for index in wanted if sheet.get(index, 1) is not None]
    if not found:
        raise NotApplicable("the device has no PDO of this direction")
    for index in found:
        can_id = sdo.number(index, 1) & 0x7FF
        by_default = wanted[index] + bench.node_id
        text = f"{index:04X}h:01 is {by_default:03X}h by default; it is {can_id:03X}h"
        if can_id != by_default and not bench.stage.virtual:
            bench.characteristic(requirement, text)
        else:
            bench.check(can_id == by_default, text)


def wrong_in(last: Seen, changed_at: int, missing: str) -> str:
    """What a last TPDO with old values breaks: C-TP-03, if it is younger than the change.

    If it is older, the one that is to tell of the change is missing.
    """
    return "C-TP-03" if last.when.earliest > changed_at else missing
