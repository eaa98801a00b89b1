"""Steps that the tests of a drive share: its synchronous PDOs, set up over SDO."""

from __future__ import annotations

from collections.abc import Iterable

from hil_tests.api import (
    MS,
    Abort,
    Cia301Bench,
    DriveProfile,
    Frame,
    NotApplicable,
    S,
    Sdo,
    Seen,
    cobs,
    matchers,
    number,
    u8,
    u16,
    u32,
)

QUICK = {"heartbeat_ms": 50}
"""Where it costs nothing: a heartbeat that soon shows the state."""

SYNC_ID, CYCLE, WINDOW, OVERFLOW = 0x1005, 0x1006, 0x1007, 0x1019
RPDO, TPDO = 0x1400, 0x1800
"""Communication parameters of the first PDO; its mapping is 200h further on."""
COB_ID, TYPE, INHIBIT, TIMER, START = 1, 2, 3, 5, 6
"""Sub-indices of the communication parameters."""

INVALID, NO_REMOTE = 1 << 31, 1 << 30
PDOS = 4
FIRST, SECOND = 0x11, 0x12_3456
"""By so much set-points change; no two of their bytes are alike."""
SPARE_ID = 0x101
"""An identifier that no service has, before those of PDOs in arbitration."""


def axis(bench: Cia301Bench) -> DriveProfile:
    """The profile of the drive under test.

    Raises:
        NotApplicable: it is none.
    """
    if not isinstance(bench.profile, DriveProfile):
        raise NotApplicable("the device is no drive: its profile names no axis")
    return bench.profile


def sync(bench: Cia301Bench, counter: int | None = None) -> Seen:
    """Send a SYNC."""
    return bench.send(Frame(cobs.SYNC, b"" if counter is None else u8(counter)))


def tpdo(bench: Cia301Bench, which: int = 1) -> matchers.Matcher:
    """A transmit PDO of the pre-defined connection set."""
    can_id = cobs.TPDOS[which - 1] + bench.node_id
    return matchers.cob(can_id, f"TPDO{which} of node {bench.node_id}")


def rpdo(bench: Cia301Bench, set_point: int, control: int = 0, which: int = 1) -> Frame:
    """A receive PDO with control word and set-point."""
    data = u16(control) + u32(set_point)
    return Frame(cobs.RPDOS[which - 1] + bench.node_id, data)


def any_pdo(bench: Cia301Bench) -> matchers.Matcher:
    """Any transmit PDO of the pre-defined connection set."""
    ids = frozenset(base + bench.node_id for base in cobs.TPDOS)
    return matchers.any_of(ids, f"a PDO of node {bench.node_id}")


# Setting up.


def disable(sdo: Sdo, parameter: int) -> None:
    """Make a PDO invalid; one that the device has not is."""
    found = sdo.try_read(parameter, COB_ID)
    if not isinstance(found, Abort) and not number(found) & INVALID:
        cob_id = u32(number(found) | INVALID)
        sdo.write(parameter, COB_ID, cob_id, requirement="C-PC-04")


def enable(sdo: Sdo, parameter: int, can_id: int, extra: int = 0) -> None:
    """Make a PDO valid under an identifier."""
    sdo.write(parameter, COB_ID, u32(can_id | extra), requirement="C-PC-04")


def map_objects(sdo: Sdo, parameter: int, places: Iterable[tuple[int, int]]) -> None:
    """Map objects to a PDO that is invalid (CiA 301 4.2.0, 7.5.2.36, step 2 to 4)."""
    mapping = parameter + 0x200
    entries = [index << 16 | sub << 8 | 8 * len(sdo.read(index, sub)) for index, sub in places]
    now = [number(sdo.read(mapping, place + 1)) for place in range(number(sdo.read(mapping)))]
    if now == entries:
        return
    sdo.write(mapping, 0, u8(0), requirement="C-PC-04")
    for place, entry in enumerate(entries, 1):
        sdo.write(mapping, place, u32(entry), requirement="C-PC-04")
    sdo.write(mapping, 0, u8(len(entries)), requirement="C-PC-04")


def set_up(
    bench: Cia301Bench, sdo: Sdo, kind: int = 1, window_ns: int = 0, extra: int = NO_REMOTE
) -> None:
    """From power-on to pre-operational: TPDO1 carries status and position, RPDO1 what it is told.

    All other PDOs are invalid; RPDO1 is synchronous.

    Args:
        bench: see there.
        sdo: see there.
        kind: transmission type of TPDO1.
        window_ns: synchronous window; 0 = none.
        extra: bits of the COB-ID of TPDO1.
    """
    drive = axis(bench)
    bench.start(QUICK)
    for number_of in range(PDOS):
        disable(sdo, RPDO + number_of)
        disable(sdo, TPDO + number_of)
    map_objects(sdo, TPDO, (drive.status, drive.actual))
    map_objects(sdo, RPDO, (drive.control, drive.set_point))
    sdo.write(TPDO, TYPE, u8(kind), requirement="C-PC-04")
    sdo.write(RPDO, TYPE, u8(1), requirement="C-PC-04")
    enable(sdo, TPDO, cobs.TPDOS[0] + bench.node_id, extra)
    enable(sdo, RPDO, cobs.RPDOS[0] + bench.node_id)
    open_window(bench, sdo, window_ns)


def open_window(bench: Cia301Bench, sdo: Sdo, window_ns: int) -> None:
    """Set the synchronous window, in the unit of the device (SYN-05)."""
    sdo.write(WINDOW, 0, u32(window_ns // axis(bench).window_unit_ns))


def run(bench: Cia301Bench, sdo: Sdo, kind: int = 1, window_ns: int = 0) -> None:
    """As `set_up`, and on to operational."""
    set_up(bench, sdo, kind, window_ns)
    bench.enter_operational()


def set_point(bench: Cia301Bench, sdo: Sdo) -> int:
    """The set-point as the object dictionary has it."""
    return number(sdo.read(*axis(bench).set_point))


def margin_ns(bench: Cia301Bench) -> int:
    """How exactly the end of a window is asked for; hosts of models are slow to hear."""
    return 1 * MS if bench.stage.port.timed else 15 * MS


def pause_ns(bench: Cia301Bench) -> int:
    """A while that is short, and longer than everything that a PDO is given."""
    limits = bench.profile.limits
    return 2 * max(limits.sync_pdo_ns, limits.event_pdo_ns)


def takes_the_last(bench: Cia301Bench, sdo: Sdo) -> bool:
    """Whether the SYNC after two RPDOs takes the second one."""
    sync(bench)
    value = set_point(bench, sdo)
    bench.send(rpdo(bench, value + FIRST))
    bench.send(rpdo(bench, value + SECOND))
    sync(bench)
    bench.wait(bench.profile.limits.sync_pdo_ns)
    return set_point(bench, sdo) == value + SECOND


def run_proven(bench: Cia301Bench, sdo: Sdo, window_ns: int) -> None:
    """As `run`, with a look at what a window rests on: that set-points are taken at all."""
    run(bench, sdo)
    if not takes_the_last(bench, sdo):
        open_window(bench, sdo, 1 * S)
        requirement = "SYN-05" if takes_the_last(bench, sdo) else "SYN-01"
        bench.fail("without a window a SYNC takes the last RPDO", requirement=requirement)
    open_window(bench, sdo, window_ns)
