"""RPDOs: when they take effect, length, deadline, and the states in which they count."""

from __future__ import annotations

import pytest

from node_model.frame import Frame
from node_model.nmt import NmtState
from node_model.node import MS
from tests.node_model.pdo.axis import CONTROL, OFF, SET_POINT, Axis
from tests.node_model.services import feed, passing, write


def values(axis: Axis) -> tuple[int, int]:
    """Control word and set-point, as a client reads them."""
    return axis.od.number(CONTROL), axis.od.number(SET_POINT)


@pytest.mark.parametrize("kind", [254, 255])
def test_an_event_driven_rpdo_takes_effect_at_once(kind: int) -> None:
    """All values are there before the application is told of one."""
    axis = Axis(rpdo=kind)
    assert 0x205 in axis.pdos.listens_to()
    axis.bring("0F00 FEFFFFFF", 7)
    assert values(axis) == (15, -2)
    assert axis.applied == [(CONTROL, 0, 7), (SET_POINT, 0, 7)]


@pytest.mark.parametrize("kind", [0, 1, 240])
def test_a_synchronous_rpdo_takes_effect_at_the_next_sync(kind: int) -> None:
    """The last one that came before it, once."""
    axis = Axis(rpdo=kind)
    axis.bring("0100 01000000", 7)
    axis.bring("0200 02000000", 8)
    assert values(axis) == (0, 0)
    axis.tick(9)
    assert values(axis) == (2, 2)
    axis.od.put_number(CONTROL, 0, 5)
    axis.tick(10)
    assert values(axis) == (5, 2)


@pytest.mark.parametrize("state", [NmtState.PRE_OPERATIONAL, NmtState.STOPPED])
@pytest.mark.parametrize("kind", [1, 255])
def test_outside_operational_an_rpdo_is_ignored(state: NmtState, kind: int) -> None:
    """Also its length; and it does not wait for operational."""
    axis = Axis(rpdo=kind, state=state)
    axis.bring("0F00 FEFFFFFF", 7)
    axis.bring("0F", 7)
    axis.enter(NmtState.OPERATIONAL, 8)
    axis.tick(9)
    assert values(axis) == (0, 0)
    assert axis.reports.seen == []


def test_what_waits_for_a_sync_is_dropped_on_leaving_operational() -> None:
    """The SYNC after the return does not bring it."""
    axis = Axis(rpdo=1)
    axis.bring("0F00 FEFFFFFF", 7)
    axis.enter(NmtState.PRE_OPERATIONAL, 8)
    axis.tick(9)
    axis.enter(NmtState.OPERATIONAL, 10)
    axis.tick(11)
    assert values(axis) == (0, 0)


@pytest.mark.parametrize("text", ["", "0F00 FEFFFF"])
def test_an_rpdo_that_is_too_short_is_not_applied_and_is_an_error(text: str) -> None:
    """8210h with bit 4, once; the next right one ends it."""
    axis = Axis()
    assert axis.bring(text, 7) == ["085#1082"]
    assert axis.bring(text, 8) == []
    assert values(axis) == (0, 0)
    assert axis.bring("0F00 FEFFFFFF", 9) == ["085#0000"]
    assert axis.reports.codes == [(7, 0x8210), (9, 0)]
    fault = axis.reports.seen[0][2]
    assert fault is not None
    assert (fault.register, fault.communication) == (0x10, False)


def test_of_an_rpdo_that_is_too_long_the_first_bytes_count() -> None:
    """No error."""
    axis = Axis()
    axis.bring("0F00 FEFFFFFF 1122", 7)
    assert values(axis) == (15, -2)
    assert axis.reports.seen == []


def test_remote_frames_are_no_rpdo() -> None:
    """Nor are frames for another one."""
    axis = Axis()
    assert feed(axis.pdos, 7, Frame(0x205, remote=True, dlc=6), Frame(0x305, bytes(8))) == []
    assert (axis.applied, axis.reports.seen) == ([], [])


def test_an_rpdo_that_is_off_is_ignored() -> None:
    """From the write on."""
    axis = Axis()
    write(axis.od, 0x1400, 1, OFF | 0x205, 5)
    axis.bring("0F00 FEFFFFFF", 7)
    axis.bring("", 7)
    assert values(axis) == (0, 0)
    assert 0x205 not in axis.pdos.listens_to()
    passing(axis.pdos, MS)
    assert axis.reports.seen == []


def test_a_new_type_acts_at_once() -> None:
    """From the next PDO on."""
    axis = Axis(rpdo=1)
    write(axis.od, 0x1400, 2, 255, 5)
    axis.bring("0F00 FEFFFFFF", 7)
    assert values(axis) == (15, -2)


def test_an_rpdo_that_maps_nothing_is_not_watched() -> None:
    """It can be switched on, and what comes has no effect."""
    axis = Axis()
    write(axis.od, 0x1401, 5, 20, 0)
    write(axis.od, 0x1401, 1, 0x305, 0)
    passing(axis.pdos, 0)
    assert feed(axis.pdos, 5, Frame(0x305, b"\1\2")) == []
    assert axis.pdos.deadline() is None


def test_before_operational_a_parameter_that_is_written_waits() -> None:
    """Nothing is due because of it."""
    axis = Axis(state=NmtState.PRE_OPERATIONAL)
    write(axis.od, 0x1400, 2, 1, 5)
    write(axis.od, 0x1800, 2, 255, 5)
    assert axis.pdos.deadline() is None


# Deadline


def test_a_missing_rpdo_is_an_error_once() -> None:
    """8250h one event time after the last; watching begins with the first one."""
    axis = Axis()
    write(axis.od, 0x1400, 5, 20, 0)
    passing(axis.pdos, 100 * MS)
    axis.bring("0F00 FEFFFFFF", 100 * MS)
    axis.bring("0F00 FEFFFFFF", 119 * MS)
    passing(axis.pdos, 119 * MS)
    assert passing(axis.pdos, 1000 * MS) == [(139 * MS, "085#5082")]
    assert axis.bring("0F00 FEFFFFFF", 1000 * MS) == ["085#0000"]
    assert axis.reports.codes == [(139 * MS, 0x8250), (1000 * MS, 0)]
    fault = axis.reports.seen[0][2]
    assert fault is not None
    assert (fault.register, fault.communication) == (0x10, False)


def test_a_new_deadline_counts_from_its_writing() -> None:
    """0 ends the watching."""
    axis = Axis()
    write(axis.od, 0x1400, 5, 20, 0)
    axis.bring("0F00 FEFFFFFF", 0)
    write(axis.od, 0x1400, 5, 50, 10 * MS)
    passing(axis.pdos, 60 * MS - 1)
    assert axis.reports.seen == []
    write(axis.od, 0x1400, 5, 0, 60 * MS - 1)
    passing(axis.pdos, 1000 * MS)
    assert axis.reports.seen == []


@pytest.mark.parametrize(("sub", "value"), [(1, OFF | 0x205), (5, 0), (2, 254)])
def test_the_errors_of_an_old_setting_are_over(sub: int, value: int) -> None:
    """Whether it is switched off, not watched any more, or set up anew."""
    axis = Axis()
    write(axis.od, 0x1400, 5, 20, 0)
    passing(axis.pdos, 0)
    axis.bring("0F00 FEFFFFFF", 0)
    axis.bring("", 1)
    passing(axis.pdos, 30 * MS)
    write(axis.od, 0x1400, sub, value, 30 * MS)
    assert passing(axis.pdos, 1000 * MS) == [(30 * MS, "085#0000")] * 2
    assert axis.reports.codes == [(1, 0x8210), (20 * MS, 0x8250), (30 * MS, 0), (30 * MS, 0)]


def test_outside_operational_no_rpdo_is_missed() -> None:
    """Watching begins anew with the first one after the return."""
    axis = Axis()
    write(axis.od, 0x1400, 5, 20, 0)
    axis.bring("0F00 FEFFFFFF", 0)
    axis.enter(NmtState.PRE_OPERATIONAL, 10 * MS)
    write(axis.od, 0x1400, 5, 30, 11 * MS)
    assert axis.pdos.deadline() is None
    axis.enter(NmtState.OPERATIONAL, 500 * MS)
    passing(axis.pdos, 1000 * MS)
    assert axis.reports.seen == []
