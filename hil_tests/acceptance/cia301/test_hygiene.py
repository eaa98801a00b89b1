"""Bus hygiene and robustness of any CiA 301 device."""

from __future__ import annotations

from contextlib import suppress

import pytest

from hil_tests.acceptance.cia301.steps import (
    ERROR_FIELD,
    ERROR_REGISTER,
    enter,
    quick,
    reset,
    writable_objects,
)
from hil_tests.acceptance.nmt_steps import RUNNING_STATES
from hil_tests.acceptance.robustness_steps import garbage
from hil_tests.api import (
    MS,
    Abort,
    Cia301Bench,
    Frame,
    FrameNotCarried,
    Sdo,
    Sheet,
    State,
    cobs,
    matchers,
)

GARBAGE = 1500
LSS_IDS = frozenset({0x7E4, 0x7E5})


def settings(sdo: Sdo, sheet: Sheet) -> dict[str, bytes]:
    """Every setting of the device, as SDO reads it."""
    found = {}
    for one in sheet:
        live = one.pdo or one.index in {ERROR_REGISTER, ERROR_FIELD}
        if live or not one.readable or not one.writable:
            continue
        value = sdo.try_read(one.index, one.sub)
        if not isinstance(value, Abort):
            found[one.place] = value
    return found


def services(node_id: int) -> frozenset[int]:
    """Identifiers by which the device is spoken to on purpose."""
    ours = {base + node_id for base in (0x200, 0x300, 0x400, 0x500, 0x600, 0x700)}
    return frozenset(ours | {cobs.NMT, cobs.SYNC, cobs.TIME} | LSS_IDS)


@pytest.mark.requirement("C-RB-06")
@pytest.mark.parametrize("state", RUNNING_STATES, ids=str)
def test_garbage_changes_nothing(bench: Cia301Bench, sdo: Sdo, sheet: Sheet, state: State) -> None:
    """Frames of any identifier, kind and length that speak to others: the device goes on."""
    bench.needs_exclusive()
    quick(bench, sdo, sheet)
    before = settings(sdo, sheet)
    enter(bench, state)
    spared = services(bench.node_id) | {
        base + bench.node_id for base in (0x080, 0x180, 0x280, 0x380, 0x480, 0x580)
    }
    for frame in garbage(bench.node_id, GARBAGE):
        if frame.can_id in spared and not frame.extended:
            continue
        with suppress(FrameNotCarried):
            bench.send(frame)
    found = bench.shown_state(bench.now())
    bench.check(found is state, f"it is still {state}; it is {found}")
    enter(bench, State.PRE_OPERATIONAL)
    after = settings(sdo, sheet)
    changed = [place for place, data in before.items() if after.get(place) != data]
    bench.check(not changed, f"no setting has changed; {changed[:5]} did")


@pytest.mark.requirement("C-RB-01", "C-RB-02")
def test_a_life_of_listed_frames(bench: Cia301Bench, sdo: Sdo, sheet: Sheet) -> None:
    """Through starts, states, SYNC, reads and resets every frame is one that it may send.

    The monitors of every test judge the frames; here is what they are made of.
    """
    bench.needs_exclusive()
    for _ in range(2):
        quick(bench, sdo, sheet)
        for state in (State.OPERATIONAL, State.STOPPED, State.PRE_OPERATIONAL):
            enter(bench, state)
            for _ in range(3):
                bench.send(Frame(cobs.SYNC))
                bench.wait(20 * MS)
        for one in writable_objects(sheet):
            sdo.try_read(one.index, one.sub)
        reset(bench)
    frames = bench.collect(matchers.anything(), after=0, until=bench.now())
    strange = [str(seen.frame) for seen in frames if seen.frame.remote or seen.frame.extended]
    text = f"no remote or 29-bit frame; there was {strange[:1]}"
    bench.check(not strange, text, requirement="C-RB-02")
    bench.check(bool(frames), "the device was heard", requirement="C-RB-01")
