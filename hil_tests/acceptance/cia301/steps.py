"""Steps that the tests of CiA 301 share, and what they ask of the electronic data sheet."""

from __future__ import annotations

from collections.abc import Iterator

from hil_tests.acceptance.nmt_steps import COMMAND_TO
from hil_tests.api import (
    LOOK_ON_NS,
    MS,
    Abort,
    Bench,
    Cia301Bench,
    EdsObject,
    Frame,
    Limits,
    Moment,
    Nmt,
    NotApplicable,
    Sdo,
    Seen,
    Sheet,
    State,
    cobs,
    judge_periodic,
    matchers,
    u8,
    u16,
)

QUICK_MS, LONGEST_AWAITED_MS = 100, 200
"""A heartbeat that soon shows the state, and the longest period whose first beat is awaited."""

ENOUGH = 22
"""So many beats have 21 intervals: enough for a verdict on their mean."""

GAP_NS = 250 * MS

DEVICE_TYPE, ERROR_REGISTER, ERROR_FIELD = 0x1000, 0x1001, 0x1003
SYNC_ID, CYCLE, WINDOW, OVERFLOW = 0x1005, 0x1006, 0x1007, 0x1019
GUARD_TIME, LIFE_FACTOR = 0x100C, 0x100D
TIME_ID = 0x1012
STORE, RESTORE = 0x1010, 0x1011
EMCY_ID, INHIBIT = 0x1014, 0x1015
CONSUMER, PRODUCER = 0x1016, 0x1017
IDENTITY, BEHAVIOUR = 0x1018, 0x1029
RPDO, TPDO = 0x1400, 0x1800
"""Communication parameters of the first PDO; its mapping is 200h further on."""

APPLICATION, WHOLE_AREA = range(0x2000, 0x10000), range(0x2000, 0xA000)
"""Where objects of the application can be, and where their settings are."""
LIFE_GUARD_CODE = 0x8130
COMMUNICATION_BIT = 0x10
RESTRICTED = (0x000, 0x07F, 0x101, 0x180, 0x581, 0x5FF, 0x601, 0x67F, 0x6E0, 0x6FF, 0x701, 0x7FF)
"""Identifiers that no service may be given (CiA 301 4.2.0, 7.3.5): the edges of each range."""
REACTION = {0: State.PRE_OPERATIONAL, 1: State.OPERATIONAL, 2: State.STOPPED}
"""1029h:01 -> where a communication error leads from operational."""


def shown(index: int, sub: int = 0) -> str:
    """An object for people."""
    return f"{index:04X}h:{sub:02X}"


def needs(sheet: Sheet, *places: tuple[int, int]) -> None:
    """Raise NotApplicable where the data sheet lacks one of these objects."""
    for index, sub in places:
        if sheet.get(index, sub) is None:
            raise NotApplicable(f"the device has no {shown(index, sub)}: {sheet.file} lists none")


def needs_writable(sheet: Sheet, *places: tuple[int, int]) -> None:
    """Raise NotApplicable where one of these objects is not there, or cannot be written."""
    needs(sheet, *places)
    for index, sub in places:
        found = sheet.get(index, sub)
        if found is not None and not found.writable:
            raise NotApplicable(f"{shown(index, sub)} of the device cannot be written")


def first(found: Iterator[EdsObject], what: str) -> EdsObject:
    """The first object of a kind; NotApplicable where there is none."""
    for one in found:
        return one
    raise NotApplicable(f"the device has no object {what}")


def writable_objects(sheet: Sheet) -> Iterator[EdsObject]:
    """Objects of the application that can be read and written."""
    return (one for one in sheet if one.index in APPLICATION and one.readable and one.writable)


def long_object(sheet: Sheet) -> EdsObject:
    """An object of the application that holds bytes of any number."""
    found = (one for one in writable_objects(sheet) if one.kind.name == "DOMAIN")
    return first(found, "of type DOMAIN that can be written")


def plain_object(sheet: Sheet, size: int) -> EdsObject:
    """A number of the application of so many bytes, without limits."""
    found = (
        one
        for one in writable_objects(sheet)
        if one.kind.size == size
        and one.kind.name.startswith(("INTEGER", "UNSIGNED"))
        and one.low is None
        and one.high is None
    )
    return first(found, f"with a number of {size} bytes that can be written")


def changeable_setting(sheet: Sheet, area: range = WHOLE_AREA) -> tuple[EdsObject, bytes]:
    """A setting of the application, and a value that it can have and has not by default."""
    for one in writable_objects(sheet):
        if one.index not in area or one.pdo or not one.kind.is_number or one.default is None:
            continue
        edges = [limit for limit in (one.low, one.high) if limit is not None]
        for edge in edges:
            if edge.number != one.default.number:
                return one, edge.bytes_at(0)
        if not edges and one.kind.size == 2:
            return one, b"\x34\x12"
    raise NotApplicable(f"the device has no setting in {area[0]:04X}h to {area[-1]:04X}h")


def beats(sdo: Sdo, period_ms: int = QUICK_MS) -> None:
    """The heartbeat comes so often from now on; a short period is seen to act (C-HB-03)."""
    sdo.write(PRODUCER, 0, u16(period_ms), requirement="C-HB-01")
    if not 0 < period_ms <= LONGEST_AWAITED_MS:
        return
    bench = sdo.bench
    _, most = bench.profile.limits.heartbeat_each_ns(period_ms * MS)
    beat = matchers.heartbeat(bench.node_id)
    bench.expect(beat, after=bench.now(), within=most, requirement="C-HB-03")


def rhythm(
    bench: Bench,
    period_ms: int,
    after: Seen | int,
    requirement: str,
    period: str = "",
    count: int = ENOUGH,
) -> None:
    """Beats in a row keep to their period, each and in the mean.

    Args:
        bench: see there.
        period_ms: as it was set.
        after: from when on.
        requirement: that there are beats.
        period: that they keep to it, if that is another one.
        count: how many.
    """
    limits, period_ns = bench.profile.limits, period_ms * MS
    patience_ns = 2 * period_ns + GAP_NS
    matcher = matchers.heartbeat(bench.node_id)
    found = bench.beats(matcher, count, after=after, patience_ns=patience_ns)
    text = f"{count} heartbeats of {period_ms} ms; there were {len(found)}"
    bench.check(len(found) == count, text, requirement=requirement)
    each, mean = limits.heartbeat_each_ns(period_ns), limits.heartbeat_mean_ns(period_ns)
    verdict = judge_periodic(
        f"heartbeat of {period_ms} ms",
        [bench.when(beat) for beat in found],
        Limits(*each),
        Limits(*mean),
        period or requirement,
    )
    bench.conclude(verdict)


def quick(bench: Bench, sdo: Sdo, sheet: Sheet) -> Seen:
    """A regular start, and a heartbeat that soon shows the state.

    Returns:
        The boot-up.
    """
    needs_writable(sheet, (PRODUCER, 0))
    boot = bench.start()
    beats(sdo)
    return boot


def enter(bench: Bench, state: State, requirement: str = "") -> Seen:
    """Command the device into a state and see that it is there (C-NMT-04, NMT-04).

    That its heartbeat goes on in stopped is C-HB-07, or HB-01.
    """
    ids = bench.watch.expected.ids
    command = bench.nmt(COMMAND_TO[state])
    period_ns = bench.watch.expected.heartbeat_ns
    if state is State.STOPPED and period_ns:
        settled = command.at + bench.profile.limits.command_ns
        beat = matchers.heartbeat(bench.node_id)
        found = bench.first(beat, settled, settled + 2 * period_ns + LOOK_ON_NS)
        text = "the heartbeat goes on in stopped"
        bench.check(found is not None, text, requirement=ids.beat_stopped, since=command)
    bench.expect_state(state, after=command, requirement=requirement or ids.obeyed)
    return command


def go(bench: Bench, state: State) -> Seen:
    """Command the device into a state, and give it more than the time to get there.

    That it gets there in time is C-NMT-21.
    """
    command = bench.nmt(COMMAND_TO[state])
    bench.wait(2 * bench.profile.limits.command_ns)
    return command


def reset(bench: Bench, command: Nmt = Nmt.RESET_NODE) -> Seen:
    """Reset the device and await its boot-up.

    That it comes is C-NMT-11 or C-NMT-12 (NMT-06), that it comes in time C-NMT-20.

    Returns:
        The boot-up.
    """
    ids = bench.watch.expected.ids
    missing = ids.reset_node if command is Nmt.RESET_NODE else ids.reset_communication
    return bench.expect_boot_up(bench.nmt(command), missing)


def without_heartbeat(sdo: Sdo, sheet: Sheet) -> None:
    """Heartbeat off where it can be, e.g. so that guarding is served."""
    producer = sheet.get(PRODUCER)
    if producer is not None and producer.writable:
        sdo.write(PRODUCER, 0, u16(0), requirement="C-HB-06")


def guarded(sdo: Sdo, sheet: Sheet, guard_ms: int, factor: int) -> None:
    """Guarding with that life time; the heartbeat is off."""
    needs_writable(sheet, (GUARD_TIME, 0), (LIFE_FACTOR, 0))
    without_heartbeat(sdo, sheet)
    sdo.write(GUARD_TIME, 0, u16(guard_ms), requirement="C-NG-11")
    sdo.write(LIFE_FACTOR, 0, u8(factor), requirement="C-NG-11")


def expect_emcy(
    bench: Cia301Bench, code: int, *, after: Seen | Moment, within: int, requirement: str
) -> Seen:
    """An EMCY with this code follows; one that came and is formed wrongly is C-EM-01."""
    matcher = matchers.emcy(bench.node_id, code=code)
    if bench.first(matcher, after, bench.now() + within) is None:
        requirement = rule_of_missing(bench, code, after, requirement)
    return bench.expect(matcher, after=after, within=within, requirement=requirement)


def rule_of_missing(
    bench: Cia301Bench, code: int, after: Seen | Moment | int, requirement: str
) -> str:
    """The requirement that an EMCY which was not seen is held against.

    C-EM-01 where one came with another length or identifier, or with its code reversed.
    """
    low_first = code.to_bytes(2, "little")
    own = cobs.EMCY + bench.node_id

    def is_ill_formed(frame: Frame) -> bool:
        if frame.can_id == own and not frame.extended:
            return len(frame.data) != 8 or frame.data[:2] == low_first[::-1] != low_first
        others = range(cobs.EMCY + 1, cobs.EMCY + 0x80)
        return bench.stage.exclusive and frame.can_id in others and frame.data[:2] == low_first

    frames = bench.collect(matchers.anything(), after=after, until=bench.now())
    return "C-EM-01" if any(is_ill_formed(seen.frame) for seen in frames) else requirement


def refused(bench: Bench, outcome: bytes | Abort, what: str, requirement: str = "") -> Abort:
    """The transfer was refused, with whatever code."""
    text = f"{what} is refused"
    if not isinstance(outcome, Abort):
        bench.fail(f"{text}; it was done", requirement=requirement)
    bench.check(True, text, requirement=requirement)
    return outcome
