"""What other nodes and their masters say to each other is none of the node's business (ROB-02)."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from hil_tests.acceptance.nmt_steps import PACE_NS, QUICK
from hil_tests.acceptance.robustness_steps import (
    expect_beats_only,
    expect_obeys,
    obeying,
    settled,
)
from hil_tests.api import MS, Frame, KeypadBench, Nmt

LSS_REQUESTS = (
    "0401",  # switch state global: configuration
    *("5a", "5b", "5c", "5d", "5e"),  # inquire identity and node id
    "0400",  # switch state global: waiting
    *("4034120000", "4101000000", "4201000000", "4301000000"),  # switch state selective
    *("4634120000", "4701000000", "4800000000", "49ffffffff", "4a00000000", "4bffffffff"),
    "4c",  # identify slaves that are not configured
    *("5100000000800000", "51341200001f0001"),  # fast scan
    "0400",
)
"""What changes a slave for good (node id, bit timing, store) is not among them."""


def services_of_others(node_id: int) -> Iterator[Frame]:
    """What a bus with other nodes and their masters is full of, well-formed to the last byte."""
    other = node_id % 15 + 1
    yield from (Frame(0x080), Frame(0x080, b"\x01"))  # SYNC, without and with its counter
    yield Frame(0x100, bytes.fromhex("40e201002d3c"))  # TIME
    for code in (0x5000, 0x8130, 0x0000):
        yield Frame(0x080 + other, code.to_bytes(2, "little") + bytes(6))
    for base in (0x180, 0x200, 0x280, 0x300, 0x380, 0x400, 0x480, 0x500):
        yield Frame(base + other, b"\xff")
    yield Frame(0x600 + other, bytes.fromhex("2f17100000000000"))
    yield Frame(0x580 + other, bytes.fromhex("6017100000000000"))
    for state in (0x00, 0x7F, 0x05, 0x04):
        yield Frame(0x700 + other, bytes((state,)))
    for command in Nmt:
        yield Frame(0x000, bytes((command, other)))
    for request in LSS_REQUESTS:
        yield Frame(0x7E5, bytes.fromhex(request).ljust(8, b"\0"))
    yield Frame(0x7E4, bytes.fromhex("4f00000000000000"))  # what an LSS slave answers


@pytest.mark.requirement("ROB-02", "ROB-01")
def test_services_of_others_are_not_answered(bench: KeypadBench) -> None:
    """In no state does the node say anything to what other nodes and their masters send."""
    bench.needs_exclusive()
    bench.start(prefer=QUICK)
    obeying(bench)
    for state in (Nmt.START, Nmt.STOP, Nmt.PRE_OPERATIONAL):
        quiet = settled(bench, state)
        for frame in services_of_others(bench.node_id):
            bench.send(frame)
            bench.wait(PACE_NS)
        bench.wait(100 * MS)
        expect_beats_only(bench, quiet)

    expect_obeys(bench, "ROB-01")
