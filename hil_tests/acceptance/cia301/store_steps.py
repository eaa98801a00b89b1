"""Steps that the tests of stored parameters share (CiA 301 4.2.0, 7.5.2.13 and 7.5.2.14)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager

from hil_tests.acceptance.cia301.steps import RESTORE, STORE, needs_writable, reset, shown
from hil_tests.api import LOOK_ON_NS, Cia301Bench, Limits, Sdo, Sheet, matchers, sdo_frames

SAVE, LOAD = b"save", b"load"
ALL, COMMUNICATION, APPLICATION = 1, 2, 3


def order(bench: Cia301Bench, sdo: Sdo, index: int, sub: int, signature: bytes) -> None:
    """Store or restore; it is answered within the time that storing may take.

    Storing may keep a device busy for longer than an SDO request usually takes.
    """
    sent = sdo.post(sdo_frames.write(index, sub, signature))
    within = bench.profile.limits.store_ns
    matcher = matchers.cob(sdo.answer_id, "an SDO answer")
    seen = bench.first(matcher, sent, sent.at + within + LOOK_ON_NS)
    told = seen.frame if seen else "nothing"
    wanted = b"\x60" + sdo_frames.multiplexer(index, sub) + bytes(4)
    text = f"{signature!r} to {shown(index, sub)} is confirmed; the answer was {told}"
    served = seen is not None and seen.frame.data[:4] == wanted[:4]
    bench.check(served, text, requirement="C-ST-02", since=sent)
    assert seen is not None
    text, limits = f"{signature!r} to {shown(index, sub)}", Limits(at_most_ns=within)
    bench.measure_between(sent, seen, limits, text, requirement="C-ST-08", since=sent)
    bench.wait(within)


def storing(bench: Cia301Bench, sheet: Sheet, sub: int = ALL) -> None:
    """The device stores on command, and may be told to."""
    needs_writable(sheet, (STORE, sub), (RESTORE, sub))
    bench.needs_writes("the device's non-volatile memory is written")


def expect_stored(
    bench: Cia301Bench, sdo: Sdo, values: Mapping[tuple[int, int], bytes], requirement: str
) -> None:
    """They are written and stored, and are there after a reset."""
    for (index, sub), data in values.items():
        sdo.write(index, sub, data)
    order(bench, sdo, STORE, ALL, SAVE)
    reset(bench)
    for (index, sub), data in values.items():
        found = sdo.read(index, sub)
        text = f"{shown(index, sub)} is {data.hex()}, as it was stored; it is {found.hex()}"
        bench.check(found == data, text, requirement=requirement)


@contextmanager
def put_back(bench: Cia301Bench, sdo: Sdo, *places: tuple[int, int]) -> Iterator[None]:
    """What is stored inside is stored as it was before, and read back after a reset."""
    before = {place: sdo.read(*place) for place in places}
    try:
        yield
    finally:
        reset(bench)
        expect_stored(bench, sdo, before, "C-ST-04")
