"""Steps that the tests of LSS share: who it is, and another node id for it (CiA 305 3.0.0)."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from hil_tests.acceptance.cia301.steps import IDENTITY, needs
from hil_tests.api import (
    MS,
    Cia301Bench,
    Identity,
    Lss,
    Nmt,
    NotApplicable,
    Sdo,
    Sheet,
    nmt_frame,
)


def known(bench: Cia301Bench, sdo: Sdo, sheet: Sheet) -> Identity:
    """A started device that has LSS, and its identity as SDO reads it."""
    if not sheet.device.lss:
        raise NotApplicable(f"the device has no LSS: {sheet.file} says LSS_Supported=0")
    needs(sheet, *((IDENTITY, sub) for sub in range(1, 5)))
    bench.needs_exclusive()
    bench.start()
    return Identity(*(sdo.number(IDENTITY, sub) for sub in range(1, 5)))


def may_configure(bench: Cia301Bench) -> None:
    """Node ids and bit rates are changed: on a device of the user's only if allowed."""
    bench.needs_writes("LSS changes the node id or the bit rate")


def another_id(bench: Cia301Bench) -> int:
    """A node id that the device does not have."""
    return bench.node_id % 127 + 1


def give_node_id(lss: Lss, node_id: int) -> None:
    """In configuration and out again: it acts at the next reset communication."""
    lss.configure()
    lss.set_node_id(node_id)
    lss.leave()


def expect_boot_up(bench: Cia301Bench, old: int, new: int) -> None:
    """Reset communication of a node brings a boot-up under another node id."""
    bench.wait(10 * MS)
    sent = bench.send(nmt_frame(Nmt.RESET_COMMUNICATION, old))
    bench.expect_boot_up(sent, "C-LS-10", new)


@contextmanager
def renumbered(bench: Cia301Bench, lss: Lss) -> Iterator[tuple[int, Sdo]]:
    """The device has another node id inside: that, and the client of its SDO server there."""
    old, new = bench.node_id, another_id(bench)

    def give(node_id: int, before: int) -> None:
        give_node_id(lss, node_id)
        bench.tolerate_missing_boot_up()
        expect_boot_up(bench, before, node_id)

    give(new, old)
    try:
        yield new, Sdo(bench, bench.profile.limits.sdo_ns, 0x600 + new, 0x580 + new)
    finally:
        give(old, new)
